"""Judge a step of a tree, keep an accepted one, and observe states inside of accepted steps."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from exudyn_model.corners import CORNER_COUNT
from exudyn_model.kernels import entry
from exudyn_model.linkage import driven_rod4
from exudyn_model.tree.isolation import Room, accepted_fraction, switch
from exudyn_model.tree.motion import (
    CONTACTS,
    END,
    PIN_ROW,
    ROCKER,
    ROD2,
    ROD4,
    SLIDER,
    complete,
    interpolate,
)

Array = NDArray[np.float64]

_OF_CONTACTS = ("impact_speed", "start", "name", "end")
STEP = np.dtype([("first", END), ("last", END), *((name, float, CONTACTS) for name in _OF_CONTACTS)])
"""An accepted step: both ends; of the contacts during the step impact speed, start, name, and end, infinite
where it goes on."""


@entry
def judge(
    time: float,
    q: Array,
    v: Array,
    number: int,
    presses: NDArray[Any],
    workpiece: NDArray[Any],
    contacts: NDArray[Any],
    room: Room,
) -> float:
    """Accept the step to a state, or return the fraction of it after which a contact begins or ends.

    Also that up to a kink of a workpiece's force; not a number if the coordinates are not finite. Of an
    accepted step, returned as 1, the record ``number`` of ``room.steps`` is filled, the memory of the
    contacts and the first of ``room.ends`` are moved on.

    Parameters
    ----------
    time : float
        s.
    q, v : ndarray
        Coordinates of the tree and their rates: see ``building``.
    number : int
        Of the step; -1: this is the initial state, to which no step leads.
    presses : ndarray, shape (1,)
        Record of a ``motion.Press``.
    workpiece, contacts : ndarray
    room : Room
    """
    total = 0.0
    for k in range(len(q)):
        total += q[k] + v[k]
    if not np.isfinite(total):
        return np.nan
    press, start, end, values = presses[0], room.ends[0], room.ends[1], room.values[0]
    angle, rate = end.angle, end.rate
    end.time = time
    if press.has_journal:
        angle[ROCKER], rate[ROCKER] = q[0], v[0]
        for body, coordinate in ((ROD2, 1), (ROD4, 2)):
            angle[body], rate[body] = q[0] + q[coordinate], v[0] + v[coordinate]
        if press.has_guide:
            angle[SLIDER], rate[SLIDER] = angle[ROD4] + q[3], rate[ROD4] + v[3]
    else:
        _, ideal, ideal_rate, _ = driven_rod4(time, press.mechanism)
        angle[ROD4], rate[ROD4] = ideal + q[0], ideal_rate + v[0]
        angle[SLIDER], rate[SLIDER] = q[1], v[1]
    complete(end, press, workpiece, contacts, values, room.distances[1])
    switched = False
    if number >= 0:
        fraction = accepted_fraction(press, workpiece, contacts, room)
        if fraction < 1.0:
            return fraction
        kept = room.steps[number]
        kept.first, kept.last = start, end
        for row in range(CONTACTS):
            contact = contacts[row]
            kept.impact_speed[row], kept.start[row] = contact.impact_speed, contact.start
            kept.name[row] = contact.name
        if press.has_guide:
            for row in range(CORNER_COUNT):
                if switch(row, contacts, room, press.guide):
                    switched = True
        if press.has_journal and switch(PIN_ROW, contacts, room, press.journal):
            switched = True
        for row in range(CONTACTS):
            contact = contacts[row]
            over = contact.impact_speed == 0.0 or contact.start != kept.start[row]
            kept.end[row] = contact.end if over else np.inf
    if switched:  # what the contacts that go on make of the state: its right limit
        complete(end, press, workpiece, contacts, values, room.distances[1])
    room.ends[0] = end
    for row in range(room.distances.shape[1]):
        room.distances[0, row] = room.distances[1, row]
    return 1.0


@entry
def observe(
    number: NDArray[np.int64],
    fraction: Array,
    presses: NDArray[Any],
    workpiece: NDArray[Any],
    contacts: NDArray[Any],
    room: Room,
    values: NDArray[Any],
) -> None:
    """Fill all values of states inside of accepted steps, each in a record of ``values``.

    They are at the ``fraction`` of the step of a ``number``, shape (n,) each; ``contacts`` and all of
    ``room`` but the steps are overwritten.
    """
    here = room.ends[0]
    for k in range(len(number)):
        step = room.steps[number[k]]
        for row in range(CONTACTS):
            contacts[row].impact_speed = step.impact_speed[row]
        interpolate(step.first, step.last, fraction[k], here)
        complete(here, presses[0], workpiece, contacts, values[k], room.distances[0])
