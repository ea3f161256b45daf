"""Names of the channels, and the tables of extrema and contacts that a run leaves behind."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from exudyn_model.compiled import kernel
from exudyn_model.contact_memory import EVENT, write_event
from exudyn_model.point_contact import CONTACTS, CORNERS

STATE = ("slider_x", "slider_y", "slider_angle", "slider_vx", "slider_vy", "slider_omega")
ACCELERATIONS = ("slider_ax", "slider_ay", "slider_alpha")
CORNER_CHANNELS = tuple(
    f"corner_{corner}_{part}" for corner in CORNERS for part in ("gap", "normal", "friction")
)
CHANNELS = STATE + ACCELERATIONS + CORNER_CHANNELS
REACTIONS = tuple(f"reaction_{joint}_{axis}" for joint in "OABHCF" for axis in "xy")

_EXTREMA = np.dtype([(name, np.float64) for name in ("min", "time_of_min", "max", "time_of_max")])


def new_extrema(channels: int) -> NDArray[np.void]:
    """Extrema of so many channels, shape (channels,), before the first value."""
    extrema = np.zeros(channels, _EXTREMA)
    extrema["min"], extrema["max"] = np.inf, -np.inf
    return extrema


@kernel
def widen(extrema: NDArray[np.void], values: NDArray[np.float64], time: float) -> None:
    """Take the channels' ``values`` at ``time`` (s) into their extrema."""
    for channel in range(len(values)):
        if values[channel] < extrema[channel].min:
            extrema[channel].min = values[channel]
            extrema[channel].time_of_min = time
        if values[channel] > extrema[channel].max:
            extrema[channel].max = values[channel]
            extrema[channel].time_of_max = time


def extrema_table(
    extrema: NDArray[np.void], channels: tuple[str, ...], names: tuple[str, ...]
) -> dict[str, dict[str, float]]:
    """Least and greatest value of each named channel with their times in s; ``channels`` names the rows."""
    return {
        name: {part: float(extrema[channels.index(name)][part]) for part in _EXTREMA.names or ()}
        for name in names
    }


def event_table(ended: NDArray[np.void], contacts: NDArray[np.void], now: float) -> dict[str, NDArray[Any]]:
    """Contacts sorted by start: those ``ended``, and those of ``contacts`` that last until ``now`` (s)."""
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
