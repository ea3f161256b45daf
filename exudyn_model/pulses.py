"""Pulses: normal forces of the corners' contacts in time, noted in accepted states and sorted by contact."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from exudyn_model.compiled import kernel
from exudyn_model.contact.foundation import other_end, shares_contact
from exudyn_model.contact.states import CORNERS

# Of a corner: 3.2 MB. Later contacts have no pulse
_SAMPLES = 200_000
_CORNERS = len(CORNERS)


def new_pulses() -> NDArray[np.float64]:
    """Make room for time (s) and force (N) of so many samples of each corner, shape (4, samples, 2).

    Not filled: memory that no contact needs is never touched.
    """
    return np.empty((_CORNERS, _SAMPLES, 2))


@kernel
def note(time: float, force: float, contact: Any, samples: NDArray[np.float64]) -> None:
    """Note the force (N) of one contact at ``time`` (s), as long as its corner's ``samples`` have room."""
    row = int(contact.noted)
    if row < len(samples):
        samples[row, 0], samples[row, 1] = time, force
        contact.noted += 1.0


@kernel
def note_corners(time: float, contacts: NDArray[np.void], law: Any, pulses: NDArray[np.float64]) -> None:
    """Note the contacts in progress in the accepted state of five bodies at ``time`` (s)."""
    for number in range(_CORNERS):
        contact = contacts[number]
        if contact.impact_speed > 0.0:
            force = contact.normal
            if shares_contact(number, law):
                force += contacts[other_end(number)].normal
            note(time, force, contact, pulses[number])


def pulse_table(
    pulses: NDArray[np.float64], contacts: NDArray[np.void], events: dict[str, NDArray[Any]]
) -> dict[str, NDArray[Any]]:
    """Sort what is noted by contact.

    A contact that was going on when the room of its corner was full has no pulse.

    Parameters
    ----------
    pulses : ndarray, shape (4, samples, 2)
        From :func:`new_pulses`.
    contacts : ndarray, shape (5,)
    events : dict of ndarray
        From ``tables.event_table``.

    Returns
    -------
    dict of ndarray
        "row" (in ``events``), "time" (s), "force" (N), shape (n,) each, by row and time.
    """
    found = []
    for number, corner in enumerate(CORNERS):
        time, force = pulses[number, : int(contacts[number]["noted"])].T
        rows = np.flatnonzero(events["corner"] == corner)
        row = rows[np.searchsorted(events["start"][rows], time, side="right") - 1]
        # A tree may find in a step that a contact has ended at its start; a run may end with nan
        kept = (time <= events["end"][row]) & np.isfinite(force)
        if time.size == pulses.shape[1]:
            kept &= row != row[-1]
        found.append((row[kept], time[kept], force[kept]))
    row, time, force = (np.concatenate(parts) for parts in zip(*found, strict=True))
    order = np.argsort(row, kind="stable")
    return {"row": row[order], "time": time[order], "force": force[order]}
