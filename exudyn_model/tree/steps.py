"""Judge a step of a tree, keep an accepted one, and observe states inside of accepted steps."""

import numpy as np
from numpy.typing import NDArray

from exudyn_model.columns import END, IMPACT_SPEED, NAME, START
from exudyn_model.corners import CORNER_COUNT
from exudyn_model.kernels import entry
from exudyn_model.linkage import driven_rod4
from exudyn_model.tree.isolation import accepted_fraction, switch
from exudyn_model.tree.motion import (
    END_COLUMNS,
    PIN_ROW,
    RATE,
    ROCKER,
    ROD2,
    ROD4,
    ROWS,
    SLIDER,
    THETA,
    TIME,
    complete,
    interpolate,
)

Array = NDArray[np.float64]

# Of an accepted step: both ends, and of the contacts during the step impact speed, start, name, and end,
# infinite where it goes on
ENDS = 2 * END_COLUMNS
STEP_COLUMNS = ENDS + 4 * ROWS


@entry
def judge(
    time: float,
    q: Array,
    v: Array,
    is_start: bool,
    ends: Array,
    distances: Array,
    linkage: Array,
    guide: Array | None,
    journal: Array | None,
    workpiece: Array | None,
    contacts: Array,
    least: float,
    values: Array,
    work: Array,
    steps: Array,
    count: int,
) -> float:
    """Accept the step to a state, or return the fraction of it after which a contact begins or ends.

    Also that up to a kink of a workpiece's force.

    Not a number if the coordinates are not finite. Of an accepted step, returned as 1, row ``count`` of
    ``steps`` is filled, the memory of the contacts and the first of the ``ends`` are moved on.

    Parameters
    ----------
    time : float
        s.
    q, v : ndarray
        Coordinates of the tree and their rates: see ``building``.
    is_start : bool
        Whether this is the initial state, to which no step leads.
    ends, distances : ndarray, shape (2, 13) and (2, 6, 3)
        Of the step at both ends: see ``motion``.
    least : float
        Shortest step that ends where a contact begins or ends, s.
    values, work : ndarray, shape (``motion.WIDTH``,) and (2, 6)
        Room.
    """
    total = 0.0
    for k in range(len(q)):
        total += q[k] + v[k]
    if not np.isfinite(total):
        return np.nan
    start, end = ends[0], ends[1]
    end[TIME] = time
    if journal is None:
        _, angle, rate, _ = driven_rod4(time, linkage)
        end[THETA + ROD4], end[RATE + ROD4] = angle + q[0], rate + v[0]
        end[THETA + SLIDER], end[RATE + SLIDER] = q[1], v[1]
    else:
        end[THETA + ROCKER], end[RATE + ROCKER] = q[0], v[0]
        for body, number in ((ROD2, 1), (ROD4, 2)):
            end[THETA + body], end[RATE + body] = q[0] + q[number], v[0] + v[number]
        if guide is not None:
            end[THETA + SLIDER], end[RATE + SLIDER] = end[THETA + ROD4] + q[3], end[RATE + ROD4] + v[3]
    complete(end, linkage, guide, journal, workpiece, contacts, values, distances[1])
    switched = False
    if not is_start:
        step = time - start[TIME]
        fraction = accepted_fraction(
            start[TIME], step, distances[0], distances[1], guide, journal, workpiece, contacts, least, work
        )
        if fraction < 1.0:
            return fraction
        kept = steps[count]
        for k in range(END_COLUMNS):
            kept[k], kept[END_COLUMNS + k] = start[k], end[k]
        for row in range(ROWS):
            kept[ENDS + row], kept[ENDS + ROWS + row] = contacts[row, IMPACT_SPEED], contacts[row, START]
            kept[ENDS + 2 * ROWS + row] = contacts[row, NAME]
        if guide is not None:
            for row in range(CORNER_COUNT):
                if switch(row, start[TIME], time, distances[0], distances[1], guide, contacts):
                    switched = True
        if journal is not None and switch(
            PIN_ROW, start[TIME], time, distances[0], distances[1], journal, contacts
        ):
            switched = True
        for row in range(ROWS):
            contact = contacts[row]
            over = contact[IMPACT_SPEED] == 0.0 or contact[START] != kept[ENDS + ROWS + row]
            kept[ENDS + 3 * ROWS + row] = contact[END] if over else np.inf
    if switched:  # what the contacts that go on make of the state: its right limit
        complete(end, linkage, guide, journal, workpiece, contacts, values, distances[1])
    for k in range(END_COLUMNS):
        start[k] = end[k]
    for row in range(len(distances[0])):
        for k in range(3):
            distances[0, row, k] = distances[1, row, k]
    return 1.0


@entry
def observe(
    steps: Array,
    number: NDArray[np.int64],
    fraction: Array,
    linkage: Array,
    guide: Array | None,
    journal: Array | None,
    workpiece: Array | None,
    here: Array,
    distances: Array,
    contacts: Array,
    values: Array,
) -> None:
    """Fill all values of states inside of accepted steps, each in a row of ``values``.

    They are at the ``fraction`` of the step of a ``number``, shape (n,) each; ``here``, ``distances`` and
    ``contacts`` are room.
    """
    for k in range(len(number)):
        step = steps[number[k]]
        for row in range(ROWS):
            contacts[row, IMPACT_SPEED] = step[ENDS + row]
        interpolate(step[:END_COLUMNS], step[END_COLUMNS:ENDS], fraction[k], here)
        complete(here, linkage, guide, journal, workpiece, contacts, values[k], distances)
