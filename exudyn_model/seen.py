"""The worst of a run: from the watched contacts, the table of contacts, the energies and the samples."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exudyn_model.contact.laws import FOUNDATION, LAWS
from exudyn_model.contact.states import ACROSS, ALONG, CONTACTS, CORNERS, PIN, UPPER
from exudyn_model.parameters import Parameters

_CORNERS = len(CORNERS)


@dataclass(frozen=True)
class Seen:
    """The worst of one kind in a run: its value, when (s) and where."""

    name: str
    value: float
    time: float
    place: str = ""


def place_name(number: int) -> str:
    """Return the name of one of ``CONTACTS`` in a sentence."""
    return f"corner {CONTACTS[number]}" if number < len(CORNERS) else "the crank pin"


def seen_in_contacts(contacts: NDArray[np.void]) -> list[Seen]:
    """Return the worst of what is kept in the records of the contacts."""
    found = []
    for name, field in (
        ("open-depth", "open_depth"),
        ("pull", "pull"),
        ("driving-friction", "driving"),
        ("leaving-start", "leaving"),
        ("start-gap", "start_gap"),
    ):
        number = int(np.argmax(contacts[field]))
        worst = contacts[number]
        found.append(Seen(name, float(worst[field]), float(worst[f"{field}_time"]), place_name(number)))
    return found


def names_of_one(number: int, law: str) -> tuple[str, ...]:
    """Return the names in the table of what is one contact with one of ``CONTACTS``: those of its side."""
    if law == LAWS[FOUNDATION] and number != PIN:
        return CONTACTS[number], CONTACTS[(number + UPPER) % _CORNERS]
    return (CONTACTS[number],)


def seen_in_events(events: Mapping[str, NDArray[Any]], law: str) -> Seen:
    """Return the longest overlap of two contacts of one corner or, as the ``law`` has it, of one side.

    The table is sorted by start.
    """
    worst = Seen("overlap", 0.0, 0.0)
    for number in range(len(CONTACTS)):
        chosen = np.isin(events["corner"], names_of_one(number, law))
        start, end = events["start"][chosen], events["end"][chosen]
        if len(start) < 2:
            continue
        overlaps = np.maximum.accumulate(end)[:-1] - start[1:]
        row = int(np.argmax(overlaps))
        if overlaps[row] > worst.value:
            worst = Seen("overlap", float(overlaps[row]), float(start[row + 1]), place_name(number))
    return worst


def seen_in_energy(
    columns: Mapping[str, NDArray[np.float64]], extrema: Mapping[str, Mapping[str, float]]
) -> Seen:
    """Return the largest residual, over all that was dissipated and the largest kinetic energy."""
    residual = extrema["energy_residual"]
    side = "max" if residual["max"] > -residual["min"] else "min"
    base = extrema["energy_kinetic"]["max"]
    base += max(float(columns["energy_damping"][-1] + columns["energy_friction"][-1]), 0.0)
    return Seen("energy", abs(residual[side]) / base, residual[f"time_of_{side}"])


def seen_in_samples(
    columns: Mapping[str, NDArray[np.float64]], events: Mapping[str, NDArray[Any]], parameters: Parameters
) -> Seen:
    """Return the deepest corner at a sample that lies in no contact of the table.

    The state at t = 0 is not looked at: Exudyn's own contact begins with the first step.
    """
    slider, worst = parameters.mechanism.slider, Seen("open-depth", 0.0, 0.0)
    x, angle = (columns[name][1:] for name in ("slider_x", "slider_angle"))
    times = np.arange(1, len(x) + 1) * parameters.sample_interval
    earlier = times * (1.0 - 1e-12)  # those of the table are rounded
    for number in range(_CORNERS):
        side, end = ACROSS[number], ALONG[number]
        across = side * slider.width / 2 * np.cos(angle) - end * slider.length / 2 * np.sin(angle)
        place = side * (x - parameters.mechanism.guide_x + across)
        depths = place - slider.width / 2 - parameters.contact.clearance
        chosen = np.isin(events["corner"], names_of_one(number, parameters.contact.law))
        starts, ends = (np.append(-np.inf, events[column][chosen]) for column in ("start", "end"))
        depths[earlier <= ends[np.searchsorted(starts, times, side="right") - 1]] = 0.0
        row = int(np.argmax(depths)) if len(depths) else 0
        if len(depths) and depths[row] > worst.value:
            worst = Seen("open-depth", float(depths[row]), float(times[row]), place_name(number))
    return worst
