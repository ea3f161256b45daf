"""Steps of a tree: judged, kept where they are accepted, and observed inside.

A step ends where a contact begins or ends; the search for that is in ``isolation``.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from exudyn_model.corners import CORNER_COUNT, UPPER
from exudyn_model.kernels import entry, kernel
from exudyn_model.laws import Law
from exudyn_model.linkage import driven_rod4
from exudyn_model.memory import ROUNDED
from exudyn_model.tree.isolation import NEVER, bernstein, first_change, kink_fraction
from exudyn_model.tree.motion import (
    CONTACTS,
    END,
    HEIGHT_ROW,
    PIN_ROW,
    ROCKER,
    ROD2,
    ROD4,
    SLIDER,
    Press,
    complete,
    interpolate,
)

Array = NDArray[np.float64]

_OF_CONTACTS = ("impact_speed", "start", "name", "end")
STEP = np.dtype([("first", END), ("last", END), *((name, float, CONTACTS) for name in _OF_CONTACTS)])
"""An accepted step: both ends; of the contacts during the step impact speed, start, name, and end, infinite
where it goes on."""


class Room(NamedTuple):
    """Arrays that the judgement of steps fills.

    Attributes
    ----------
    least : float
        Shortest step that ends where a contact begins or ends, s.
    ends : ndarray, shape (2,), of ``motion.END``
        Of the step.
    distances : ndarray, shape (2, 6), of ``motion.DISTANCE``
        At both ends.
    values : ndarray, shape (1,), of ``motion.VALUES``
        At the end.
    work : ndarray, shape (2, 6)
    steps : ndarray, shape (n,), of ``STEP``
        Accepted steps.
    """

    least: float
    ends: NDArray[Any]
    distances: NDArray[Any]
    values: NDArray[Any]
    work: Array
    steps: NDArray[Any]


@kernel
def close(row: int, contacts: Any, time: float, law: Law) -> None:
    """Close a contact at its wall at ``time`` (s); begin it, if it is not yet that of its side.

    The present speed, floored, is frozen as impact speed.
    """
    contacts[row].closed = 1.0
    # A contact of a side is remembered with the lower corner
    own = contacts[row % UPPER if law.shared > 0.0 else row]
    if own.impact_speed == 0.0:
        own.impact_speed = max(-contacts[row].rate, law.speed_floor)
        own.start, own.name = time, row


@kernel
def separate(row: int, contacts: Any, time: float, law: Law) -> None:
    """Open a contact at ``time`` (s) and end it, unless it goes on in the other corner."""
    contacts[row].closed, contacts[row].end = 0.0, time
    if law.shared > 0.0:
        other = contacts[(row + UPPER) % CORNER_COUNT]
        if other.closed > 0.0:
            return
        row, time = row % UPPER, max(time, other.end)
    contacts[row].impact_speed, contacts[row].end = 0.0, time


@kernel
def accepted_fraction(press: Press, workpiece: NDArray[Any], contacts: Any, room: Room) -> float:
    """Return the fraction of a step up to the first contact that begins or ends; 1: it can be accepted.

    Or up to the first kink of a workpiece's force. Where a side has one contact also up to where a corner
    goes into its wall, or out of it, while the other one of its side is inside.

    A contact that touches sooner than ``room.least`` after the start touches *at* the start: its impact speed
    is frozen here, and the step is to be tried again with it. At separation the force is 0 already but has a
    kink, across which no interpolation is accurate.
    """
    first, start, work = 1.0, room.ends[0].time, room.work
    step = room.ends[1].time - start
    for row in range(0 if press.has_guide else CORNER_COUNT, CONTACTS if press.has_journal else CORNER_COUNT):
        contact, before, after = contacts[row], room.distances[0, row], room.distances[1, row]
        closed = contact.closed > 0.0
        if bernstein(before, after, -1.0 if closed else 1.0, step, work[0]) >= ROUNDED:
            continue
        if work[0, 0] < -ROUNDED and closed:
            work[0, 0] = 0.0  # a touch within `least` is frozen before it comes
        fraction = 0.0 if work[0, 0] < -ROUNDED else first_change(work[0], work[1])
        if np.isnan(fraction):
            fraction = 0.5
        elif fraction != NEVER and fraction * step < room.least:
            if closed:
                # It separates at once. What comes back is another contact: the step must end before
                fraction = 1.0 if after.value > ROUNDED else 0.5
            else:
                # Exudyn calls back before it judges a step's error: the end of one far too long is arbitrary,
                # and only the start shows whether it is at the wall
                fraction = 0.5
                if before.value <= ROUNDED - 2.0 * room.least * before.rate:
                    contact.rate = before.rate
                    close(row, contacts, start, press.journal if row == PIN_ROW else press.guide)
        first = min(first, fraction)
    height = room.distances[:, HEIGHT_ROW]
    return min(first, kink_fraction(height[0], height[1], step, workpiece, work))


@kernel
def switch(row: int, contacts: Any, room: Room, law: Law) -> bool:
    """End the contact of a row that has opened in an accepted step, or begin one that touches at its end.

    Return whether there is one.
    """
    contact, before, after, switched = contacts[row], room.distances[0, row], room.distances[1, row], False
    # What has just touched may still be open by round-off, but it approaches
    if contact.closed > 0.0 and (after.value > ROUNDED or (after.value >= -ROUNDED and after.rate > 0.0)):
        # In an accepted step a contact separates at one of the ends alone: see `accepted_fraction`
        at = 1 if after.value < -before.value else 0
        separate(row, contacts, room.ends[at].time, law)
        switched = True
    contact.rate = after.rate
    if contact.closed == 0.0 and after.value <= ROUNDED and after.rate < 0.0:
        close(row, contacts, room.ends[1].time, law)
        switched = True
    return switched


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
        record = room.steps[number]
        record.first, record.last = start, end
        for row in range(CONTACTS):
            contact = contacts[row]
            record.impact_speed[row], record.start[row] = contact.impact_speed, contact.start
            record.name[row] = contact.name
        if press.has_guide:
            for row in range(CORNER_COUNT):
                if switch(row, contacts, room, press.guide):
                    switched = True
        if press.has_journal and switch(PIN_ROW, contacts, room, press.journal):
            switched = True
        for row in range(CONTACTS):
            contact = contacts[row]
            over = contact.impact_speed == 0.0 or contact.start != record.start[row]
            record.end[row] = contact.end if over else np.inf
    if switched:  # the right limit of the state: with the contacts that go on
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
