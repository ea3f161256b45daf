"""Curves of channels in all pictures: with forces between samples, on axes that rounding does not fill."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd

from comparison.metrics.contacts import Pulse, pulses_of
from comparison.tables.channels import CORNERS, Array, Channel, touching
from comparison.tables.table import Table
from comparison.verdict.results import ChannelComparison, SceneComparison

_ROUNDING = 1e-12
"""Range of a channel without a floor, as a share of its size, that is rounding."""


@dataclass(frozen=True)
class Line:
    """A channel of one model: its known points, shape (n,), and the peaks of contacts without a pulse.

    A peak, shape (m,), stands in the middle of its contact: its instant is not known.
    """

    time: Array
    values: Array
    peak_time: Array
    peak: Array

    @property
    def extremes(self) -> tuple[float, float]:
        """The smallest and the largest value that is known."""
        known = np.append(self.values, self.peak)
        return float(known.min(initial=np.inf)), float(known.max(initial=-np.inf))

    def less(self, zero: float) -> Line:
        """Return the line with an offset subtracted from its values; peaks, which are forces, have none."""
        return replace(self, values=self.values - zero)

    def within(self, start: float, end: float) -> Line:
        """Return the part of a span of time (s)."""
        inside, reached = ((start <= time) & (time <= end) for time in (self.time, self.peak_time))
        return Line(self.time[inside], self.values[inside], self.peak_time[reached], self.peak[reached])


def guide_of(channel: str, scene: Mapping[str, Any] | None) -> float:
    """Return the offset of a drawn channel: of x the guide's centre line (m), else 0."""
    return float(scene["mechanism"]["guide_x"]) if channel == "slider_x" and scene is not None else 0.0


def contact_of(channel: str, scene: Mapping[str, Any] | None) -> str:
    """Return the contact whose normal force a channel is: "ll" of ``corner_ll_normal``, empty of any other.

    Under the law foundation the contact is a side's and two corners share its force: no channel has it.
    """
    for corner in CORNERS:
        if channel == f"corner_{corner}_normal" and (scene is None or touching(corner, scene) == [corner]):
            return corner
    return ""


def scene_lines(scene: SceneComparison, channel: ChannelComparison) -> list[Line]:
    """Return the lines of a channel in both models."""
    return [
        _line(channel.channel, channel.time, values, scene=scene.scene, events=events, pulses=pulses)
        for values, events, pulses in zip((channel.a, channel.b), scene.events, scene.pulses, strict=True)
    ]


def _line(
    channel: str,
    time: Array,
    values: Array,
    *,
    scene: Mapping[str, Any] | None,
    events: pd.DataFrame | None,
    pulses: Sequence[Pulse],
) -> Line:
    """Return the line of a channel, for a normal force with the pulses and peaks of its contacts.

    Half of the contacts are shorter than a sample interval: samples miss many of them, and most peaks.
    """
    contact = contact_of(channel, scene)
    if not contact or events is None or "peak_force" not in events:
        return Line(time, values, np.empty(0), np.empty(0))
    of_channel = np.array(events["corner"] == contact)
    start, end, peak = (events[name].to_numpy(dtype=np.float64) for name in ("start", "end", "peak_force"))
    own = [pulse for pulse in pulses if of_channel[pulse.row]]
    times, first = np.unique(
        np.concatenate([time, *(start[pulse.row] + pulse.time for pulse in own)]), return_index=True
    )
    of_channel[[pulse.row for pulse in own]] = False
    middle = (start + end) / 2
    forces = np.concatenate([values, *(pulse.force for pulse in own)])
    return Line(times, forces[first], middle[of_channel], peak[of_channel])


def table_line(table: Table, channel: str) -> Line:
    """Return the line of a channel in a table."""
    scene = table.scene
    return _line(
        channel,
        table.time,
        table.values(channel),
        scene=None if scene is None else scene.data,
        events=table.events,
        pulses=pulses_of(table) if contact_of(channel, None) else (),
    )


def table_extremes(table: Table, channel: str) -> tuple[float, float]:
    """Return the smallest and the largest value of a channel: of its line, and of all steps if recorded.

    Extrema of the steps are not drawn: one of two almost equal ones, at another contact in the other model,
    would look like a difference.
    """
    known = table.extrema.get(channel, {})
    steps = [value for which in ("min", "max") if (value := known.get(which)) is not None]
    low, high = table_line(table, channel).extremes
    return min([low, *steps]), max([high, *steps])


def least_range(
    channel: Channel | None, scene: Mapping[str, Any] | None, extremes: tuple[float, float]
) -> float:
    """Return the least range, in the channel's unit, of an axis for values between these extremes.

    It is 0 for an excited channel, else the channel's scale, else the size of the values, so that a
    constant with rounding errors is drawn as constant.
    """
    low, high = extremes
    size = max(abs(low), abs(high))
    if high - low > (_ROUNDING * size if channel is None else channel.floor):
        return 0.0
    return (0.0 if channel is None else channel.scale_value(scene, 0.0)) or size or 1.0


def common_extremes(curves: Sequence[Line]) -> tuple[float, float]:
    """Return the smallest and the largest value of several models."""
    lows, highs = zip(*(each.extremes for each in curves), strict=True)
    return min(lows), max(highs)
