"""Curves of channels in all pictures, with forces between samples, and the data of the interactive plots.

These data are curves of two or more models, their differences and thresholds: deflated JSON in Base64, which
``plots.js`` reads. They have the digits that a plot shows: the values of a channel's first model in 65,534
steps of their range, as second differences; the other models' distances from it and the threshold in steps of
a 32nd of an octave, i.e. to 1.1 %, as first differences.
"""

from __future__ import annotations

import base64
import json
import math
import re
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from comparison.formatting import pretty_unit
from comparison.metrics import Pulse, contact_places, pulses_of
from comparison.report.svg import envelope, upper_envelope
from comparison.tables.channels import CONTACTS, CORNERS, Array, Channel, channels, corners_of
from comparison.tables.table import Table
from comparison.verdict.results import ChannelComparison, SceneComparison
from comparison.words.verdicts import threshold_name

_ROUNDING = 1e-12
"""Range of a channel without a floor, as a share of its size, up to which it is rounding."""


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
        """The smallest and the largest value of the points and peaks."""
        numbers = np.append(self.values, self.peak)
        return float(numbers.min(initial=np.inf)), float(numbers.max(initial=-np.inf))

    def less(self, zero: float) -> Line:
        """Return the line with its values less an offset; peaks, which are forces, have no offset."""
        return replace(self, values=self.values - zero)

    def within(self, start: float, end: float) -> Line:
        """Return the part of the line within a span of time (s)."""
        inside, mask = ((start <= time) & (time <= end) for time in (self.time, self.peak_time))
        return Line(self.time[inside], self.values[inside], self.peak_time[mask], self.peak[mask])


def guide_of(channel: str, scene: Mapping[str, Any] | None) -> float:
    """Return the offset of a drawn channel: of x the guide's centre line (m), else 0."""
    return float(scene["mechanism"]["guide_x"]) if channel == "slider_x" and scene is not None else 0.0


def contact_of(channel: str, scene: Mapping[str, Any] | None) -> str:
    """Return the contact of a channel that is a normal force: "ll" of ``corner_ll_normal``; else empty.

    Of a linkage it is "PIN" or "GUIDE.ll". Under the law foundation a contact is that of a side, and two
    corners share its force: it has no channel.
    """
    for corner in CORNERS:
        if channel == f"corner_{corner}_normal" and (scene is None or corners_of(corner, scene) == [corner]):
            return corner
    match = re.fullmatch(r"(.+\.(?:ll|lr|ul|ur))_normal|(.+)\.normal", channel)
    return next(filter(None, match.groups())) if match else ""


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
    """Return the line of a channel; that of a normal force has the pulses and peaks of its contacts.

    Half of the contacts are shorter than a sample interval: samples miss many of them, and most peaks.
    """
    contact = contact_of(channel, scene)
    if not contact or events is None or "peak_force" not in events:
        return Line(time, values, np.empty(0), np.empty(0))
    of_channel = np.array(events["corner"] == contact)
    start, end, peak = (events[name].to_numpy(dtype=np.float64) for name in ("start", "end", "peak_force"))
    pulses = [pulse for pulse in pulses if of_channel[pulse.row]]
    times, first = np.unique(
        np.concatenate([time, *(start[pulse.row] + pulse.time for pulse in pulses)]), return_index=True
    )
    of_channel[[pulse.row for pulse in pulses]] = False
    middle = (start + end) / 2
    forces = np.concatenate([values, *(pulse.force for pulse in pulses)])
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

    Drawings omit the extrema of the steps: two almost equal ones, at different contacts in the two models,
    would look like a difference.
    """
    extrema = table.extrema.get(channel, {})
    steps = [value for end in ("min", "max") if (value := extrema.get(end)) is not None]
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


# ---- data of the interactive plots

MOST = 6_000
"""Most samples of a plot; a longer run is drawn by its envelopes."""
MOTION = ("slider_x", "slider_y", "slider_angle")
"""Channels that the animation needs."""
FORCES = tuple(f"corner_{corner}_normal" for corner in CORNERS)
_PULSE = 25  # most points of a resolved contact
_STEPS = 20  # smallest range of an axis, in the steps of stored values
_UNKNOWN = 1e300  # stands for a threshold that is not finite
_ONE = 40_000  # step of the size 1: the step of the least size is positive


class Curve(NamedTuple):
    """A channel of two or more models, the offset to subtract from its values, and its comparison."""

    channel: Channel
    zero: float
    models: Sequence[Array]
    result: ChannelComparison | None = None


def independent(scene: SceneComparison) -> list[str]:
    """Return the excited channels; of corners only normal forces and those that differ: others follow."""
    excited = scene.excited.items()
    at_contacts = {name for name, channel in excited if channel.definition.group in ("corners", "contacts")}
    dependents = {name for name in at_contacts if name.endswith(("gap", "friction"))}
    return [name for name, channel in excited if name not in dependents or channel.verdict == "differ"]


def displayed_channels(scene: SceneComparison) -> list[ChannelComparison]:
    """Return the channels to draw: the independent ones, and the one that decides."""
    decisive, names = scene.decisive or scene.worst_channel, independent(scene)
    channels = [c for name, c in scene.excited.items() if name in names or c is decisive]
    return channels if scene.time.size > 1 else []


def scene_plots(scene: SceneComparison) -> str:
    """Return the plots of a scene at one tier as Base64; empty if there is nothing to draw."""
    decisive, items = scene.decisive or scene.worst_channel, displayed_channels(scene)
    head = {
        "labels": scene.labels,
        "tier": scene.tier,
        "period": scene.period,
        "threshold": threshold_name(decisive or items[0]) if items else "",
        "first": ["slider_x", *([decisive.channel] if decisive is not None else [])],
    }
    curves = [
        Curve(each.definition, guide_of(each.channel, scene.scene), (each.a, each.b), each) for each in items
    ]
    return _pack(head, scene.time, curves, scene.scene, scene.events, scene.pulses) if items else ""


def table_plots(
    tables: Mapping[str, Table], names: Sequence[str], scene: Mapping[str, Any] | None = None
) -> str:
    """Return plots of the channels that all tables of a scene have as Base64."""
    time = next(iter(tables.values())).time
    curves = [
        Curve(
            channels()[name],
            guide_of(name, scene),
            [np.interp(time, table.time, table.values(name)) for table in tables.values()],
        )
        for name in names
        if all(name in table.channels for table in tables.values())
    ]
    speed = None if scene is None else scene["drive"].get("speed_rpm")
    period = None if speed is None else 60.0 / abs(float(speed))
    head = {"labels": list(tables), "tier": "", "period": period, "threshold": "", "first": ["slider_x"]}
    events = [table.events for table in tables.values()]
    pulses = [pulses_of(table) for table in tables.values()]
    return _pack(head, time, curves, scene, events, pulses)


def _pack(
    head: dict[str, Any],
    time: Array,
    curves: Sequence[Curve],
    scene: Mapping[str, Any] | None,
    events: Sequence[pd.DataFrame | None],
    pulses: Sequence[Sequence[Pulse]],
) -> str:
    rows = _sample_rows(curves, time)
    places, entries = [*dict.fromkeys([*CONTACTS, *contact_places(*events)])], []
    for channel, zero, models, result in curves:
        first, *others = (np.asarray(values)[rows] - zero for values in models)
        # Zero lies on the grid of values: a corner that is free has exactly no force.
        low, high = float(first.min()), float(first.max())
        step = (high - low) / 65534.0 or abs(low) or 1.0
        lowest = math.floor(low / step)
        # A threshold within a time tolerance does not limit the plotted |a - b|.
        limit = None if result is None or result.time_tolerance else result.threshold
        if result is not None and limit is not None:
            limit = np.nan_to_num(limit, nan=_UNKNOWN, posinf=_UNKNOWN)
            # The sign is free: negative where the sample is not predictable.
            limit = np.where(result.predictable, limit, -limit)[rows]
        signals = [np.asarray(values) - zero for values in models]
        extremes = min(float(v.min()) for v in signals), max(float(v.max()) for v in signals)
        # No plot shows the steps of the stored values, or the rounding of a constant.
        least = max(least_range(channel, scene, extremes), _STEPS * (high - low) / 65534.0)
        contact = contact_of(channel.name, scene)
        entries.append(
            {
                "name": channel.name,
                "label": channel.label,
                "unit": pretty_unit(channel.unit),
                "verdict": "" if result is None else result.verdict,
                "guide": bool(zero),
                "contact": places.index(contact) if contact in places else -1,
                "least": float(f"{least:.3g}"),
                "floor": channel.floor,
                "grid": [lowest, step],
                "steps": np.diff(
                    (np.rint(first / step) - lowest).astype(np.int64), n=2, prepend=[0, 0]
                ).tolist(),
                "apart": [_octaves(first - other) for other in others],
                "limit": None if limit is None else _octaves(limit),
                "outside": [] if result is None else np.flatnonzero(result.beyond[rows]).tolist(),
            }
        )
    if not any(contact_of(curve.channel.name, scene) for curve in curves):
        pulses = [()] * len(events)
    names = [curve.channel.name for curve in curves]
    head |= {
        "of": int(time.size),
        "start": float(time[0]),
        "time": [float(f"{since:.10g}") for since in (time[rows] - time[0]).tolist()],
        "contacts": [_contacts(table, places) for table in events],
        "places": [
            (f"corner_{p}_normal", f"the {CONTACTS[p]}")
            if p in CONTACTS
            else (f"{p}{'._'['.' in p]}normal", p)
            for p in places
        ],
        "first": [name for name in dict.fromkeys(head["first"]) if name in names] or names[:1],
        "pulses": [_pulses(table, run_pulses) for table, run_pulses in zip(events, pulses, strict=True)],
        "channels": entries,
    }
    text = json.dumps(head, separators=(",", ":"), allow_nan=False)
    return base64.b64encode(zlib.compress(text.encode(), 9)).decode()


def _sample_rows(curves: Sequence[Curve], time: Array) -> NDArray[np.intp]:
    """Return the indices of the samples to draw, increasing."""
    if time.size <= MOST:
        return np.arange(time.size)
    columns = MOST // (4 * len(curves))
    indices = [np.array([0, time.size - 1])]
    for curve in curves:
        first, *others = curve.models
        indices.append(envelope(first, columns))
        indices += [upper_envelope(np.abs(first - other), columns) for other in others]
        beyond = np.zeros(time.size) if curve.result is None else curve.result.beyond.astype(np.float64)
        indices.append(upper_envelope(beyond, columns))
    return np.unique(np.concatenate(indices))


def _contacts(events: pd.DataFrame | None, places: Sequence[str]) -> list[list[Any]]:
    """Return corner, start (s), duration (s) and peak force (N) of each contact, by start."""
    if events is None:
        return []
    peaks = events["peak_force"] if "peak_force" in events else pd.Series(0.0, events.index)
    rows = zip(events["corner"], events["start"], events["end"], peaks, strict=True)
    return [
        [places.index(corner), round(start, 8), float(f"{end - start:.4g}"), float(f"{peak:.4g}")]
        for corner, start, end, peak in sorted(rows, key=lambda row: float(row[1]))
    ]


def _pulses(events: pd.DataFrame | None, pulses: Sequence[Pulse]) -> list[dict[str, Any]]:
    """Return place by start, duration (s) and peak (N) of each resolved contact; times, forces in 1/255."""
    if events is None:
        return []
    place = np.argsort(np.argsort(events["start"].to_numpy(), kind="stable"))
    records = []
    for pulse in pulses:  # evenly spaced points with the ends, and the peak
        points = np.linspace(0, pulse.time.size - 1, min(pulse.time.size, _PULSE)).round().astype(np.intp)
        rows = np.union1d(points, int(pulse.force.argmax()))
        last, peak = float(pulse.time[-1]), float(pulse.force.max())
        times, forces = (
            np.rint(255.0 * np.maximum(share[rows], 0.0)).astype(int).tolist()
            for share in (pulse.time / last, pulse.force / peak)
        )
        place_of = int(place[pulse.row])
        records.append({"place": place_of, "last": last, "peak": peak, "t": times, "n": forces})
    return sorted(records, key=lambda pulse: pulse["place"])


def _octaves(values: Array) -> list[int]:
    """Return differences of integers, whose size is `_ONE` + 32 log2 |value|, 0 for 0."""
    sizes = np.maximum(np.abs(values), 1.0 / _UNKNOWN)
    steps = np.where(values == 0.0, 0.0, np.sign(values) * (_ONE + np.rint(32.0 * np.log2(sizes))))
    return np.diff(steps.astype(np.int64), prepend=0).tolist()  # type: ignore[no-any-return]
