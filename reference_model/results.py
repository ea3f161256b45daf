"""Result of a simulation: named channels, the choice of them by a scene, their extrema by crank cycle.

Extrema are found between values at ascending times: a coordinate turns where its velocity changes sign, and
is there the cubic polynomial through both. An instant between two cycles belongs to both.
"""

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reference_model.balance import ENERGIES, REACTIONS
from reference_model.linkage import Array
from reference_model.parameters import CORNERS, Parameters
from reference_model.workpiece import exists

MOTION = ("slider_x", "slider_y", "slider_angle", "slider_vx", "slider_vy", "slider_omega")
ACCELERATIONS = ("slider_ax", "slider_ay", "slider_alpha")
CORNER_CHANNELS = tuple(
    f"corner_{corner}_{what}" for corner in CORNERS for what in ("gap", "normal", "friction")
)
JOURNAL_CHANNELS = ("journal_x", "journal_y")
_NONE = np.empty(0)
MARKS = 1000
"""Instants of a cycle at which extrema are looked for, besides the ends of steps: steps in flight are longer.
A channel that swings k times a cycle exceeds the largest of them by at most 5e-6 k^2 of its amplitude."""
EVENT_COLUMNS = ("start", "end", "normal_speed", "impulse", "peak_force", "largest_depth")


def channel_names(p: Parameters) -> list[str]:
    """Return the names of the channels in the scene's groups; an ideal slider has no corners."""
    names = [*MOTION]
    if "accelerations" in p.groups:
        names += ACCELERATIONS
    if "corners" in p.groups:
        names += () if p.ideal_slider else CORNER_CHANNELS
        names += () if p.ideal_pin else JOURNAL_CHANNELS
    if "joints" in p.groups:
        names += REACTIONS if p.ideal_slider else REACTIONS[:-2]
    if "energy" in p.groups:
        names += [name for name in ENERGIES if name != "energy_load" or exists(p.load)]
    return names


class Extrema:
    """Minimum and maximum of each channel, with their times, in each begun crank cycle of a `period` (s).

    The last cycle also contains what is later.
    """

    def __init__(self, channels: int, cycles: int, period: float) -> None:
        self.values: Array = np.tile([np.inf, 0.0, -np.inf, 0.0], (cycles, channels, 1))
        """Minimum, its time (s), maximum, its time (s); shape (cycles, channels, 4)."""
        self._period = period

    def widen(self, times: Array, values: Array, channel: int | None = None) -> None:
        """Include values at any times (s), (n,): of one channel, (n,), or of all, (channels, n)."""
        if not times.size:
            return
        channels, values = (
            (slice(None), values) if channel is None else (slice(channel, channel + 1), values[None])
        )
        slack, at = 1e-9 * self._period, np.arange(len(values))
        first, last = self._cycle_of(times.min() - slack), self._cycle_of(times.max() + slack)
        for cycle in range(first, last + 1):
            rows, when = values, times
            if first < last:
                begin = cycle * self._period - slack if cycle else -np.inf
                end = (cycle + 1) * self._period + slack if cycle < len(self.values) - 1 else np.inf
                mask = (times >= begin) & (times < end)
                rows, when = values[:, mask], times[mask]
            if when.size:
                extrema, lowest, highest = self.values[cycle, channels], rows.argmin(1), rows.argmax(1)
                least, most = rows[at, lowest], rows[at, highest]
                lower, higher = least < extrema[:, 0], most > extrema[:, 2]
                extrema[lower, 0], extrema[lower, 1] = least[lower], when[lowest[lower]]
                extrema[higher, 2], extrema[higher, 3] = most[higher], when[highest[higher]]

    def widen_between(self, channel: int, times: Array, values: Array, kinks: Array = _NONE) -> None:
        """Include the peaks of a channel between evenly spaced values, at times (s) of the same shape.

        The parabola through the largest or least value along the last axis and its neighbours has the peak,
        unless one of the `kinks` (s, ascending) lies there.
        """
        interval = (times[..., -1] - times[..., 0]) / (times.shape[-1] - 1)
        for sign in (1.0, -1.0):
            middle = np.clip((sign * values).argmax(-1), 1, values.shape[-1] - 2)[..., None]
            before, top, after = (np.take_along_axis(values, middle + j, -1)[..., 0] for j in (-1, 0, 1))
            rise, curvature = 0.5 * (after - before), before - 2.0 * top + after
            inside = np.abs(rise) < np.abs(curvature)
            shift = np.divide(-rise, curvature, out=np.zeros_like(rise), where=inside)
            when = np.take_along_axis(times, middle, -1)[..., 0]
            ends = (np.searchsorted(kinks, when + side * interval) for side in (-1.0, 1.0))
            inside, when = inside & np.equal(*ends), when + shift * interval
            self.widen(when[inside], (top + 0.5 * rise * shift)[inside], channel)

    def turn(self, times: Array, motion: Array, first: int = 0) -> None:
        """Include the turning points of a body's `motion`, shape (6, n), at ascending times (s).

        Its three coordinates are the channels from number `first` on.
        """
        length = np.diff(times)
        for i in range(3):
            rate, x = motion[3 + i], motion[i]
            j = np.flatnonzero((rate[:-1] * rate[1:] < 0.0) & (length > 0.0))
            h, r0, r1 = length[j], rate[j], rate[j + 1]
            rise = (x[j + 1] - x[j]) / h
            curved, cubic = 3.0 * rise - 2.0 * r0 - r1, r0 + r1 - 2.0 * rise
            # The rate r0 + 2 curved s + 3 cubic s^2 is zero once; in this form also where cubic is 0.
            root = np.sqrt(np.maximum(0.0, curved**2 - 3.0 * cubic * r0))
            denominator = curved + np.where(r1 > r0, root, -root)
            # The denominator is zero if the rates underflow.
            s = np.divide(-r0, denominator, out=np.zeros_like(r0), where=denominator != 0.0)
            self.widen(times[j] + s * h, x[j] + h * s * (r0 + s * (curved + s * cubic)), first + i)

    def _cycle_of(self, time: float) -> int:
        return int(max(0.0, min(time // self._period, len(self.values) - 1.0)))


@dataclass(frozen=True)
class Result:
    """Result of a simulation."""

    columns: dict[str, Array]
    """Channel -> values at the sample times, all of one length; "time" (s) first."""
    events: dict[str, NDArray[Any]]
    """One row a contact, ascending in start: "corner" and EVENT_COLUMNS (s, s, m/s, N s, N, m)."""
    pulses: dict[str, NDArray[Any]]
    """Normal forces of the contacts at the ends of steps, at marks and at peaks: "row" in the events, "time"
    (s), "force" (N)."""
    extrema: dict[str, dict[str, float]]
    """Channel -> min, time_of_min, max, time_of_max over all integration steps, whatever the samples."""
    cycle_extrema: dict[str, Array]
    """The same by crank cycle, under names such as "slider_ay_time_of_min": arrays of one length. An instant
    between two cycles belongs to both."""
    provenance: dict[str, Any] = field(default_factory=dict)
    """Formulation, integrator, settings, versions, counters, wall time, invariants."""
    status: str = "success"
    remedy: str = ""
    """Remedy to try if the status is not "success"; may be empty."""


def count_cycles(p: Parameters) -> int:
    """Return the number of crank cycles that a run begins."""
    return max(1, math.ceil(p.cycles - 1e-9))


def name_results(
    names: list[str], times: Array, values: Array, events: dict[str, NDArray[Any]], extrema: Extrema
) -> Result:
    """Return a result, without pulses, from samples (names, n) at times (n,), contacts and extrema."""
    keys = ("min", "time_of_min", "max", "time_of_max")
    each, at = extrema.values, np.arange(len(names))
    rows = each[np.isfinite(each[:, 0, 0])].reshape(-1, 4 * len(names))
    lowest, highest = each[:, :, 0].argmin(0), each[:, :, 2].argmax(0)
    overall = np.column_stack([each[lowest, at, :2], each[highest, at, 2:]])
    parts = [f"{name}_{key}" for name in names for key in keys]
    return Result(
        columns={"time": times} | dict(zip(names, values, strict=True)),
        events=events,
        pulses={"row": np.empty(0, dtype=np.int64), "time": np.empty(0), "force": np.empty(0)},
        extrema={
            name: dict(zip(keys, row, strict=True)) for name, row in zip(names, overall.tolist(), strict=True)
        },
        cycle_extrema=dict(zip(parts, rows.T.copy(), strict=True)),
    )
