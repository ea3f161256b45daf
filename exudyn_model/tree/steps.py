"""Steps of a tree: where they end, memory of the contacts, and values inside of accepted steps.

A step ends where a contact begins or ends, and at a kink of a workpiece's force, which may be too short for
the error control to see. Over a step the distance of a contact (``motion``) is the quintic Hermite polynomial
through both ends. A polynomial lies between the least and the greatest of its Bernstein coefficients [1]_: if
none is negative, neither is the polynomial, however often it turns. Most steps are settled by that; else the
step is searched from its start on, in parts short enough to be settled each.

References
----------
.. [1] Farouki, The Bernstein polynomial basis: a centennial retrospective, Comput. Aided Geom. Des. 29 (2012)
   379-419, sections 5 and 6.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from exudyn_model.clearances import CORNER_COUNT, ROUNDED, UPPER
from exudyn_model.kernels import entry, kernel
from exudyn_model.laws import Law
from exudyn_model.linkage import driven_rod4
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

# Stands for the fraction of a step at which a distance vanishes, where it does not
NEVER = 2.0
# Parts of one step that are searched before a shorter step is required. A gap of 1e-13 m at rest over
# a step of free flight takes some 100
_SEARCH_LIMIT = 1000
_DEGREE = 5
# Distance beyond a kink of a workpiece's force at which a step ends, m: too short for any slope to matter
_BEYOND = 1e-9
_CONTACT_FIELDS = ("impact_speed", "start", "name", "end")
STEP = np.dtype([("first", END), ("last", END), *((name, float, CONTACTS) for name in _CONTACT_FIELDS)])
"""An accepted step: its ends; impact speed, start, name and end (infinite: it goes on) of each contact."""


class Workspace(NamedTuple):
    """Arrays that :func:`judge_step` and :func:`observe` fill.

    Attributes
    ----------
    least : float
        Shortest step that ends where a contact begins or ends, s.
    ends : ndarray, shape (2,), of ``motion.END``
        Start and end of the step.
    distances : ndarray, shape (2, 6), of ``motion.DISTANCE``
        Distances at both ends.
    values : ndarray, shape (1,), of ``motion.VALUES``
        Values at the end.
    work : ndarray, shape (2, 6)
        Bernstein coefficients.
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
def bernstein(first: Any, last: Any, sign: float, step: float, coefficients: Array) -> float:
    """Fill the six coefficients of ``sign`` times a distance over a step (s) from its values at both ends.

    Return the least of them.
    """
    rate0, rate1 = step * first.rate / 5.0, step * last.rate / 5.0
    bend0, bend1 = step * step * first.second / 20.0, step * step * last.second / 20.0
    coefficients[0], coefficients[5] = sign * first.value, sign * last.value
    coefficients[1], coefficients[4] = sign * (first.value + rate0), sign * (last.value - rate1)
    coefficients[2] = sign * (first.value + 2.0 * rate0 + bend0)
    coefficients[3] = sign * (last.value - 2.0 * rate1 + bend1)
    least = np.inf
    for k in range(_DEGREE + 1):
        least = min(least, coefficients[k])
    return least


@kernel
def restrict(coefficients: Array, low: float, high: float, inner: Array) -> float:
    """Fill the coefficients of the part from ``low`` to ``high`` of a step; return the least of them.

    De Casteljau's algorithm cuts the step at ``high``, then at ``low``.
    """
    for k in range(_DEGREE + 1):
        inner[k] = coefficients[k]
    for level in range(1, _DEGREE + 1):
        for k in range(_DEGREE, level - 1, -1):
            inner[k] = (1.0 - high) * inner[k - 1] + high * inner[k]
    share, least = low / high, np.inf
    for level in range(1, _DEGREE + 1):
        for k in range(_DEGREE + 1 - level):
            inner[k] = (1.0 - share) * inner[k] + share * inner[k + 1]
    for k in range(_DEGREE + 1):
        least = min(least, inner[k])
    return least


@kernel
def first_change(coefficients: Array, inner: Array) -> float:
    """Return the fraction of a step at which a distance falls below zero, or ``NEVER``.

    It is not necessarily the first zero in the step: the shorter step is searched again. 0 if the distance
    was zero from the start until it fell; nan if a shorter step must decide. ``coefficients``, shape (6,),
    are those of the distance; ``inner``, of the same shape, is overwritten.
    """
    low, width, high = 0.0, 1.0, 1.0
    passed = coefficients[_DEGREE] < -ROUNDED
    count = 0
    while not passed:
        count += 1
        if count > _SEARCH_LIMIT:
            return np.nan
        high = min(low + width, 1.0)
        if restrict(coefficients, low, high, inner) >= -ROUNDED:
            if high >= 1.0:
                return NEVER
            low, width = high, 2.0 * width
        elif inner[_DEGREE] < -ROUNDED:
            passed = True
        else:
            width *= 0.5
    # Newton's method, safeguarded by bisection; a distance of zero at the start first has to grow
    low, separated, fraction = 0.0, coefficients[0] > ROUNDED, 0.5 * high
    for _ in range(200):
        restrict(coefficients, fraction, 1.0, inner)
        value, slope = inner[0], _DEGREE * (inner[1] - inner[0]) / (1.0 - fraction)
        if not separated and value <= ROUNDED:
            high, fraction = fraction, 0.5 * fraction
            if fraction < 1e-16:
                return 0.0
            continue
        separated = True
        if abs(value) < 1e-16:
            break
        if value > 0.0:
            low = fraction
        else:
            high = fraction
        change = -value / slope if slope != 0.0 else 2.0
        if not low < fraction + change < high:
            change = 0.5 * (low + high) - fraction
        fraction += change
        if abs(change) < 1e-14:
            break
    return fraction


@kernel
def kink_fraction(before: Any, after: Any, step: float, workpiece: NDArray[Any], work: Array) -> float:
    """Return the fraction of a step up to where it has passed a kink of a workpiece's force; 1: none.

    A step passes a kink if it goes twice ``_BEYOND`` beyond it; the fraction is that at ``_BEYOND``. The step
    that ends there passes no kink, and the next one starts on the other side. ``before`` and ``after`` are
    the height, of ``motion.DISTANCE``, at both ends.
    """
    first = 1.0
    for row in range(len(workpiece)):
        height = workpiece[row].height
        if row > 0 and workpiece[row].exponent > 0.0:  # a power law has its only kink at the surface
            break
        sign = 1.0 if before.value >= height else -1.0
        if bernstein(before, after, sign, step, work[0]) - sign * height >= -_BEYOND:
            continue
        for k in range(_DEGREE + 1):
            work[0, k] += 2.0 * _BEYOND - sign * height
        if first_change(work[0], work[1]) == NEVER:
            continue
        for k in range(_DEGREE + 1):
            work[0, k] -= _BEYOND
        fraction = first_change(work[0], work[1])
        first = min(first, 0.5 if np.isnan(fraction) else fraction)
    return first


@kernel
def close(row: int, contacts: Any, time: float, law: Law) -> None:
    """Close a corner or the journal at ``time`` (s); begin its contact, unless its side has begun one.

    The present speed, floored, becomes the impact speed.
    """
    contacts[row].closed = 1.0
    # The record of the lower corner is that of its side
    memory = contacts[row % UPPER if law.shared > 0.0 else row]
    if memory.impact_speed == 0.0:
        memory.impact_speed = max(-contacts[row].rate, law.speed_floor)
        memory.start, memory.name = time, row


@kernel
def separate(row: int, contacts: Any, time: float, law: Law) -> None:
    """Open a corner or the journal at ``time`` (s); end its contact, unless the other corner keeps it."""
    contacts[row].closed, contacts[row].end = 0.0, time
    if law.shared > 0.0:
        other = contacts[(row + UPPER) % CORNER_COUNT]
        if other.closed > 0.0:
            return
        row, time = row % UPPER, max(time, other.end)
    contacts[row].impact_speed, contacts[row].end = 0.0, time


@kernel
def accepted_fraction(press: Press, workpiece: NDArray[Any], contacts: Any, workspace: Workspace) -> float:
    """Return the fraction of a step up to its first change; 1: the step can be accepted.

    A change is where a corner or the journal goes into its wall or out of it, also where the contact of its
    side goes on, and a kink of a workpiece's force. At separation the force is 0 already but has a kink,
    across which no interpolation is accurate.

    A contact that touches sooner than ``workspace.least`` after the start touches *at* the start: its impact
    speed is frozen here, and the step is to be tried again with it.
    """
    first, start, work = 1.0, workspace.ends[0].time, workspace.work
    step = workspace.ends[1].time - start
    for row in range(0 if press.has_guide else CORNER_COUNT, CONTACTS if press.has_journal else CORNER_COUNT):
        contact, before, after = contacts[row], workspace.distances[0, row], workspace.distances[1, row]
        closed = contact.closed > 0.0
        if bernstein(before, after, -1.0 if closed else 1.0, step, work[0]) >= ROUNDED:
            continue
        if work[0, 0] < -ROUNDED and closed:
            work[0, 0] = 0.0  # a touch within `least` is frozen in advance
        fraction = 0.0 if work[0, 0] < -ROUNDED else first_change(work[0], work[1])
        if np.isnan(fraction):
            fraction = 0.5
        elif fraction != NEVER and fraction * step < workspace.least:
            if closed:
                # It separates at once. If it comes back, that is another contact: the step must end before
                fraction = 1.0 if after.value > ROUNDED else 0.5
            else:
                # The end of a far too long step is arbitrary, whatever its estimated error: only the start
                # shows whether the contact is at the wall
                fraction = 0.5
                if before.value <= ROUNDED - 2.0 * workspace.least * before.rate:
                    contact.rate = before.rate
                    close(row, contacts, start, press.journal if row == PIN_ROW else press.guide)
        first = min(first, fraction)
    height = workspace.distances[:, HEIGHT_ROW]
    return min(first, kink_fraction(height[0], height[1], step, workpiece, work))


@kernel
def switch(row: int, contacts: Any, workspace: Workspace, law: Law) -> bool:
    """End a contact that has opened in an accepted step, or begin one that touches at the step's end.

    Return whether either has happened.
    """
    contact, switched = contacts[row], False
    before, after = workspace.distances[0, row], workspace.distances[1, row]
    # A corner that has just touched may still be open by round-off, but it approaches
    if contact.closed > 0.0 and (after.value > ROUNDED or (after.value >= -ROUNDED and after.rate > 0.0)):
        # In an accepted step a contact separates at one of the ends alone: see `accepted_fraction`
        at = 1 if after.value < -before.value else 0
        separate(row, contacts, workspace.ends[at].time, law)
        switched = True
    contact.rate = after.rate
    if contact.closed == 0.0 and after.value <= ROUNDED and after.rate < 0.0:
        close(row, contacts, workspace.ends[1].time, law)
        switched = True
    return switched


@entry
def judge_step(
    time: float,
    q: Array,
    v: Array,
    number: int,
    press_record: NDArray[Any],
    workpiece: NDArray[Any],
    contacts: NDArray[Any],
    workspace: Workspace,
) -> float:
    """Accept the step to a state and return 1, or return the fraction of it up to its first change.

    See :func:`accepted_fraction`; not a number if the coordinates are not finite. An accepted step fills the
    record ``number`` of ``workspace.steps``, and updates the memory of the contacts and the first of
    ``workspace.ends``.

    Parameters
    ----------
    time : float
        s.
    q, v : ndarray
        Coordinates of the tree and their rates: see ``building``.
    number : int
        Number of the step; -1: this is the initial state, to which no step leads.
    press_record : ndarray, shape (1,)
        Record of a ``motion.Press``.
    workpiece, contacts : ndarray
    workspace : Workspace
    """
    total = 0.0
    for k in range(len(q)):
        total += q[k] + v[k]
    if not np.isfinite(total):
        return np.nan
    press, start, end, values = press_record[0], workspace.ends[0], workspace.ends[1], workspace.values[0]
    angle, rate = end.angle, end.rate
    end.time = time
    if press.has_journal:
        angle[ROCKER], rate[ROCKER] = q[0], v[0]
        for body, coordinate in ((ROD2, 1), (ROD4, 2)):
            angle[body], rate[body] = q[0] + q[coordinate], v[0] + v[coordinate]
        if press.has_guide:
            angle[SLIDER], rate[SLIDER] = angle[ROD4] + q[3], rate[ROD4] + v[3]
    else:
        _, ideal_angle, ideal_rate, _ = driven_rod4(time, press.mechanism)
        angle[ROD4], rate[ROD4] = ideal_angle + q[0], ideal_rate + v[0]
        angle[SLIDER], rate[SLIDER] = q[1], v[1]
    complete(end, press, workpiece, contacts, values, workspace.distances[1])
    switched = False
    if number >= 0:
        fraction = accepted_fraction(press, workpiece, contacts, workspace)
        if fraction < 1.0:
            return fraction
        record = workspace.steps[number]
        record.first, record.last = start, end
        for row in range(CONTACTS):
            contact = contacts[row]
            record.impact_speed[row], record.start[row] = contact.impact_speed, contact.start
            record.name[row] = contact.name
        if press.has_guide:
            for row in range(CORNER_COUNT):
                if switch(row, contacts, workspace, press.guide):
                    switched = True
        if press.has_journal and switch(PIN_ROW, contacts, workspace, press.journal):
            switched = True
        for row in range(CONTACTS):
            contact = contacts[row]
            ended = contact.impact_speed == 0.0 or contact.start != record.start[row]
            record.end[row] = contact.end if ended else np.inf
    if switched:  # the right limit of the state: with the contacts that go on
        complete(end, press, workpiece, contacts, values, workspace.distances[1])
    workspace.ends[0] = end
    for row in range(workspace.distances.shape[1]):
        workspace.distances[0, row] = workspace.distances[1, row]
    return 1.0


@entry
def observe(
    number: NDArray[np.int64],
    fraction: Array,
    press_record: NDArray[Any],
    workpiece: NDArray[Any],
    contacts: NDArray[Any],
    workspace: Workspace,
    values: NDArray[Any],
) -> None:
    """Fill a record of ``values`` for each of n states inside of accepted steps.

    A state lies at a ``fraction`` of the step ``number``, both of shape (n,); ``contacts`` and all of
    ``workspace`` except the steps are overwritten.
    """
    state = workspace.ends[0]
    for k in range(len(number)):
        step = workspace.steps[number[k]]
        for row in range(CONTACTS):
            contacts[row].impact_speed = step.impact_speed[row]
        interpolate(step.first, step.last, fraction[k], state)
        complete(state, press_record[0], workpiece, contacts, values[k], workspace.distances[0])
