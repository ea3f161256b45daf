"""Judge a step of a tree, keep an accepted one, and observe states inside of accepted steps."""

import numpy as np
from numpy.typing import NDArray

from exudyn_model.columns import IMPACT_SPEED, NAME, START
from exudyn_model.corners import CORNER_COUNT
from exudyn_model.kernels import entry, kernel
from exudyn_model.tree.isolation import accepted_fraction, switch
from exudyn_model.tree.motion import PIN_ROW, ROD2, ROD4, ROWS, SLIDER, evaluate, interpolate

Array = NDArray[np.float64]

# Of an accepted step: both ends, and impact speed, start and name of the contacts during the step
ENDS = 32
STEP_COLUMNS = ENDS + 3 * ROWS


@kernel
def complete(
    end: Array,
    linkage: Array,
    guide: Array | None,
    journal: Array | None,
    contacts: Array,
    values: Array,
    distances: Array,
) -> None:
    """Fill in the angular accelerations of an end of a step by balance of forces, and its distances."""
    found = evaluate(end[0, 0], end[1:3], linkage, guide, journal, contacts, values, distances)
    end[3, 0], end[3, 1], end[3, 2], end[3, 3] = found


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
    contacts: Array,
    least: float,
    values: Array,
    work: Array,
    steps: Array,
    count: int,
    events: Array,
    event_count: int,
) -> tuple[float, int]:
    """Accept the step to a state, or return where in it a contact first begins or ends.

    Parameters
    ----------
    time : float
        s.
    q, v : ndarray
        Coordinates of the tree and their rates: see ``building``.
    is_start : bool
        Whether this is the initial state, to which no step leads.
    ends : ndarray, shape (2, 4, 4)
        Of the step: see ``motion.interpolate``. The first one moves on with an accepted step.
    distances : ndarray, shape (2, 5, 3)
        At both ends.
    linkage : ndarray
    guide, journal : ndarray or None
        Laws.
    contacts : ndarray, shape (5, columns)
        Changed in place.
    least : float
        Shortest step that ends where a contact begins or ends, s.
    values : ndarray, shape (``motion.WIDTH``,)
    work : ndarray, shape (2, 6)
        Room.
    steps : ndarray, shape (n, ``STEP_COLUMNS``)
        Row ``count`` is filled with an accepted step.
    count : int
    events : ndarray
        With room for a row of each contact from ``event_count`` on.
    event_count : int

    Returns
    -------
    fraction : float
        1 if the step is accepted, else the fraction of it after which a contact begins or ends; nan if the
        coordinates are not finite.
    event_count : int
    """
    total = 0.0
    for k in range(len(q)):
        total += q[k] + v[k]
    if not np.isfinite(total):
        return np.nan, event_count
    start, end = ends[0], ends[1]
    end[0, 0] = time
    rod4, carried, carried_rate = 0, 0.0, 0.0
    if journal is not None:
        rod4, carried, carried_rate = 2, q[0], v[0]
        for column in range(2):
            body = ROD2 + 1 - column  # the rocker, then rod 2
            end[1, body] = q[0] + column * q[column]
            end[2, body] = v[0] + column * v[column]
    end[1, ROD4], end[2, ROD4] = carried + q[rod4], carried_rate + v[rod4]
    if guide is not None:
        end[1, SLIDER], end[2, SLIDER] = end[1, ROD4] + q[rod4 + 1], end[2, ROD4] + v[rod4 + 1]
    complete(end, linkage, guide, journal, contacts, values, distances[1])
    switched = False
    if not is_start:
        step = time - start[0, 0]
        fraction = accepted_fraction(
            start[0, 0], step, distances[0], distances[1], guide, journal, contacts, least, work
        )
        if fraction < 1.0:
            return fraction, event_count
        kept = steps[count]
        for k in range(ENDS):
            kept[k] = ends[k // 16, k // 4 % 4, k % 4]
        for row in range(ROWS):
            kept[ENDS + row], kept[ENDS + ROWS + row] = contacts[row, IMPACT_SPEED], contacts[row, START]
            kept[ENDS + 2 * ROWS + row] = contacts[row, NAME]
        for row in range(CORNER_COUNT if guide is not None else 0):
            one, event_count = switch(
                row, start[0, 0], time, distances[0], distances[1], guide, contacts, events, event_count
            )
            switched = switched or one
        if journal is not None:
            one, event_count = switch(
                PIN_ROW, start[0, 0], time, distances[0], distances[1], journal, contacts, events, event_count
            )
            switched = switched or one
    if switched:  # what the contacts that go on make of the state: its right limit
        complete(end, linkage, guide, journal, contacts, values, distances[1])
    for k in range(16):
        start[k // 4, k % 4] = end[k // 4, k % 4]
    for row in range(ROWS):
        for k in range(3):
            distances[0, row, k] = distances[1, row, k]
    return 1.0, event_count


@entry
def observe(
    steps: Array,
    number: NDArray[np.int64],
    fraction: Array,
    linkage: Array,
    guide: Array | None,
    journal: Array | None,
    values: Array,
) -> None:
    """Fill all values of states inside of accepted steps.

    Parameters
    ----------
    steps : ndarray, shape (steps, ``STEP_COLUMNS``)
    number : ndarray of int, shape (n,)
        Of the step of each state.
    fraction : ndarray, shape (n,)
        Of the step, at which the state is.
    linkage : ndarray
    guide, journal : ndarray or None
        Laws.
    values : ndarray, shape (n, ``motion.WIDTH``)
        Filled.
    """
    contacts, state, distances = np.zeros((ROWS, START + 1)), np.zeros((2, 4)), np.zeros((ROWS, 3))
    ends = np.zeros((2, 4, 4))
    for k in range(len(number)):
        step = steps[number[k]]
        for column in range(ENDS):
            ends[column // 16, column // 4 % 4, column % 4] = step[column]
        for row in range(ROWS):
            contacts[row, IMPACT_SPEED] = step[ENDS + row]
        time = interpolate(ends[0], ends[1], fraction[k], state)
        evaluate(time, state, linkage, guide, journal, contacts, values[k], distances)
