"""Tables of a run: extrema of the channels, and contacts."""

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from exudyn_model.channels import ACCELERATIONS, STATE
from exudyn_model.compiled import kernel
from exudyn_model.contact.impact_speed import turning_point
from exudyn_model.contact.memory import EVENT, write_event
from exudyn_model.contact.states import CONTACTS

# Coordinates and velocities of the slider among the channels; from each to its rate
_MOTION, _TO_RATE = len(STATE), len(ACCELERATIONS)

_EXTREMA = np.dtype([(name, np.float64) for name in ("min", "time_of_min", "max", "time_of_max")])


class Extrema(NamedTuple):
    """Least and greatest values of channels in each cycle of the crank.

    Attributes
    ----------
    values : ndarray, shape (cycles, channels)
    period : float
        Of the crank, s.
    """

    values: NDArray[np.void]
    period: float


def new_extrema(channels: int, period: float, cycles: float) -> Extrema:
    """Make the extrema of so many channels before the first value; ``period`` of a cycle in s."""
    values = np.zeros((max(1, math.ceil(cycles - 1e-9)), channels), _EXTREMA)
    values["min"], values["max"] = np.inf, -np.inf
    return Extrema(values, period)


@kernel
def cycle_at(extrema: Extrema, time: float) -> int:
    """Return the number of the cycle of a time in s; the last one takes in what is beyond it."""
    return min(max(int(time / extrema.period), 0), len(extrema.values) - 1)


@kernel
def update_extremum(extreme: Any, value: float, time: float) -> None:
    """Take a ``value`` at ``time`` (s) into the extrema of one channel in one cycle."""
    if value < extreme.min:
        extreme.min, extreme.time_of_min = value, time
    if value > extreme.max:
        extreme.max, extreme.time_of_max = value, time


@kernel
def update_extrema(extrema: Extrema, values: NDArray[np.float64], time: float) -> None:
    """Take the channels' ``values`` at ``time`` (s) into their extrema; where cycles meet, into both."""
    slack = 1e-9 * extrema.period
    for cycle in range(cycle_at(extrema, time - slack), cycle_at(extrema, time + slack) + 1):
        for channel in range(len(values)):
            update_extremum(extrema.values[cycle, channel], values[channel], time)


@kernel
def update_turning_points(
    extrema: Extrema,
    before: NDArray[np.float64],
    values: NDArray[np.float64],
    step: float,
    time: float,
) -> None:
    """Take the extrema of the slider's motion inside a step into ``extrema``.

    Parameters
    ----------
    extrema : Extrema
    before, values : ndarray
        At the start of the step and at its end: coordinates, velocities and accelerations first.
    step : float
        s.
    time : float
        Of the end, s.
    """
    for channel in range(_MOTION):
        rate = channel + _TO_RATE
        if before[rate] * values[rate] < 0.0:
            fraction, value = turning_point(
                before[channel], before[rate], values[channel], values[rate], step
            )
            now = time - (1.0 - fraction) * step
            update_extremum(extrema.values[cycle_at(extrema, now), channel], value, now)


@kernel
def update_vertices(extrema: Extrema, values: NDArray[np.float64], interval: float, time: float) -> None:
    """Take the vertices of the parabolas of the slider's motion through three states into ``extrema``.

    Parameters
    ----------
    extrema : Extrema
    values : ndarray, shape (3, channels)
        At equal intervals: coordinates, velocities and accelerations first.
    interval, time : float
        Between two of them; that of the middle one, s.
    """
    for channel in range(_MOTION + _TO_RATE):
        before, middle, after = values[0, channel], values[1, channel], values[2, channel]
        rise, bend = 0.5 * (after - before), after - 2.0 * middle + before
        if abs(rise) < abs(bend):
            now = time - rise / bend * interval
            value = middle - 0.5 * rise * rise / bend
            update_extremum(extrema.values[cycle_at(extrema, now), channel], value, now)


def cycle_extrema(
    extrema: Extrema, channels: tuple[str, ...], names: tuple[str, ...]
) -> dict[str, NDArray[np.float64]]:
    """Return least and greatest value of the named channels in each cycle that has begun, with times in s.

    ``channels`` names the columns.
    """
    begun = extrema.values[np.isfinite(extrema.values["min"][:, 0])]
    return {
        f"{name}_{part}": begun[part][:, channels.index(name)].copy()
        for name in names
        for part in _EXTREMA.names or ()
    }


def whole_extrema(
    by_cycle: Mapping[str, NDArray[np.float64]], names: tuple[str, ...]
) -> dict[str, dict[str, float]]:
    """Return the extrema of the named channels over the whole run, from those of its cycles."""
    found = {}
    for name in names:
        low, high = int(np.argmin(by_cycle[f"{name}_min"])), int(np.argmax(by_cycle[f"{name}_max"]))
        found[name] = {
            part: float(by_cycle[f"{name}_{part}"][high if part.endswith("max") else low])
            for part in _EXTREMA.names or ()
        }
    return found


def event_table(ended: NDArray[np.void], contacts: NDArray[np.void], now: float) -> dict[str, NDArray[Any]]:
    """Sort contacts by start: those ``ended``, and those of ``contacts`` that last until ``now`` (s)."""
    lasting = np.zeros(len(contacts), EVENT)
    count = 0
    for number, state in enumerate(contacts):
        if state["impact_speed"] > 0:
            write_event(lasting[count], number, state, now)
            count += 1
    table = np.concatenate([ended, lasting[:count]])
    table = table[np.lexsort((table["corner"], table["start"]))]
    columns: dict[str, NDArray[Any]] = {"corner": np.array(CONTACTS)[table["corner"]]}
    return columns | {name: table[name].copy() for name in EVENT.names or () if name != "corner"}
