"""Tables of a run: extrema of the channels, and contacts."""

from typing import Any

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


def new_extrema(channels: int) -> NDArray[np.void]:
    """Make the extrema of so many channels, shape (channels,), before the first value."""
    extrema = np.zeros(channels, _EXTREMA)
    extrema["min"], extrema["max"] = np.inf, -np.inf
    return extrema


@kernel
def update_extrema(extrema: NDArray[np.void], values: NDArray[np.float64], time: float) -> None:
    """Take the channels' ``values`` at ``time`` (s) into their extrema."""
    for channel in range(len(values)):
        if values[channel] < extrema[channel].min:
            extrema[channel].min = values[channel]
            extrema[channel].time_of_min = time
        if values[channel] > extrema[channel].max:
            extrema[channel].max = values[channel]
            extrema[channel].time_of_max = time


@kernel
def update_turning_points(
    extrema: NDArray[np.void],
    before: NDArray[np.float64],
    values: NDArray[np.float64],
    step: float,
    time: float,
) -> None:
    """Take the extrema of the slider's motion inside a step into ``extrema``.

    Parameters
    ----------
    extrema : ndarray
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
            if value < extrema[channel].min:
                extrema[channel].min, extrema[channel].time_of_min = value, now
            if value > extrema[channel].max:
                extrema[channel].max, extrema[channel].time_of_max = value, now


def extrema_table(
    extrema: NDArray[np.void], channels: tuple[str, ...], names: tuple[str, ...]
) -> dict[str, dict[str, float]]:
    """Return least and greatest value of the named channels, with times in s; ``channels`` names the rows."""
    return {
        name: {part: float(extrema[channels.index(name)][part]) for part in _EXTREMA.names or ()}
        for name in names
    }


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
