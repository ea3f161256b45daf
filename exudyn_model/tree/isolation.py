"""Where in a step of a tree a contact begins or ends: isolated for certain, so that the step ends there.

Likewise where the force of a workpiece has a kink, which may be too short-lived for the error control to see.

Over a step the distance of a contact (``motion``) is the quintic Hermite polynomial through both
ends. A polynomial lies between the least and the greatest of its Bernstein coefficients [1]_: if none is
negative, neither is the polynomial, however often it turns. Most steps are settled by that; else the step is
searched from its start on, in parts short enough to be settled each.

References
----------
.. [1] Farouki, The Bernstein polynomial basis: a centennial retrospective, Comput. Aided Geom. Des. 29 (2012)
   379-419, sections 5 and 6.
"""

import numpy as np
from numpy.typing import NDArray

from exudyn_model.columns import CLOSED, END, IMPACT_SPEED, NAME, RATE, SHARED, SPEED_FLOOR, START
from exudyn_model.corners import CORNER_COUNT, UPPER
from exudyn_model.kernels import kernel
from exudyn_model.memory import ROUNDED
from exudyn_model.tree.motion import ACCELERATION, DISTANCE, HEIGHT_ROW, PIN_ROW, ROWS, SPEED
from exudyn_model.workpiece import DEPTH, EXPONENT, SURFACE

Array = NDArray[np.float64]

# A fraction of the step that is none
NEVER = 2.0
# Parts of one step that are looked at, after which a shorter step is asked for. A gap of 1e-13 m at rest over
# a step of free flight takes some 100
_SEARCH_LIMIT = 1000
_DEGREE = 5
# Beyond a kink of a workpiece's force, m, where a step ends: no slope makes a force of it that counts
_BEYOND = 1e-9


@kernel
def bernstein(first: Array, last: Array, sign: float, step: float, coefficients: Array) -> float:
    """Fill the six coefficients of ``sign`` times a distance over a step (s) from its values at both ends.

    Return the least of them.
    """
    rate0, rate1 = step * first[SPEED] / 5.0, step * last[SPEED] / 5.0
    bend0, bend1 = step * step * first[ACCELERATION] / 20.0, step * step * last[ACCELERATION] / 20.0
    coefficients[0], coefficients[5] = sign * first[DISTANCE], sign * last[DISTANCE]
    coefficients[1], coefficients[4] = sign * (first[DISTANCE] + rate0), sign * (last[DISTANCE] - rate1)
    coefficients[2] = sign * (first[DISTANCE] + 2.0 * rate0 + bend0)
    coefficients[3] = sign * (last[DISTANCE] - 2.0 * rate1 + bend1)
    least = np.inf
    for k in range(_DEGREE + 1):
        least = min(least, coefficients[k])
    return least


@kernel
def part(coefficients: Array, low: float, high: float, inner: Array) -> float:
    """Fill the coefficients of the part from ``low`` to ``high`` of a step; return the least of them.

    By de Casteljau's algorithm: of the part up to ``high``, then of that from ``low`` on.
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

    Not necessarily the first one in the step: the step up to there is tried again, and searched again. 0 if
    the distance was zero from the start on until it passed; nan if a shorter step is needed to be sure.
    ``coefficients``, shape (6,), are of the distance, ``inner`` is room for those of a part.
    """
    low, width, high = 0.0, 1.0, 1.0
    passed = coefficients[_DEGREE] < -ROUNDED
    count = 0
    while not passed:
        count += 1
        if count > _SEARCH_LIMIT:
            return np.nan
        high = min(low + width, 1.0)
        if part(coefficients, low, high, inner) >= -ROUNDED:
            if high >= 1.0:
                return NEVER
            low, width = high, 2.0 * width
        elif inner[_DEGREE] < -ROUNDED:
            passed = True
        else:
            width *= 0.5
    # Newton's method, safeguarded by bisection; what is at the wall at the start has to separate before
    low, separated, fraction = 0.0, coefficients[0] > ROUNDED, 0.5 * high
    for _ in range(200):
        part(coefficients, fraction, 1.0, inner)
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
def close(row: int, contacts: Array, time: float, law: Array) -> None:
    """Close a contact at its wall at ``time`` (s); begin it, if it is not yet that of its side.

    The present speed, floored, is frozen as impact speed.
    """
    contacts[row, CLOSED] = 1.0
    # A side that remembers does so in the row of its lower corner
    own = contacts[row % UPPER if law[SHARED] > 0.0 else row]
    if own[IMPACT_SPEED] == 0.0:
        own[IMPACT_SPEED] = max(-contacts[row, RATE], law[SPEED_FLOOR])
        own[START], own[NAME] = time, row


@kernel
def separate(row: int, contacts: Array, time: float, law: Array) -> None:
    """Open a contact at ``time`` (s) and end it, unless it goes on in the other corner."""
    contacts[row, CLOSED], contacts[row, END] = 0.0, time
    if law[SHARED] > 0.0:
        other = contacts[(row + UPPER) % CORNER_COUNT]
        if other[CLOSED] > 0.0:
            return
        row, time = row % UPPER, max(time, other[END])
    contacts[row, IMPACT_SPEED], contacts[row, END] = 0.0, time


@kernel
def accepted_fraction(
    start: float,
    step: float,
    before: Array,
    after: Array,
    guide: Array | None,
    journal: Array | None,
    workpiece: Array | None,
    contacts: Array,
    least: float,
    work: Array,
) -> float:
    """Return the fraction of a step up to the first contact that begins or ends; 1: it can be accepted.

    Or up to the first kink of a workpiece's force.

    Where a side remembers also up to where a corner goes into its wall, or out of it, while the other one of
    its side is inside.

    A contact that touches sooner than ``least`` after the start touches *at* the start: its impact speed is
    frozen here, and the step is to be tried again with it. At separation the force is 0 already but has a
    kink, across which no interpolation is accurate. ``before`` and ``after`` are the distances at both ends
    of the step, ``work``, shape (2, 6), is room.
    """
    first = 1.0
    for row in range(0 if guide is not None else CORNER_COUNT, ROWS if journal is not None else CORNER_COUNT):
        contact = contacts[row]
        closed = contact[CLOSED] > 0.0
        if bernstein(before[row], after[row], -1.0 if closed else 1.0, step, work[0]) >= ROUNDED:
            continue
        if work[0, 0] < -ROUNDED and closed:
            work[0, 0] = 0.0  # what touches within `least` is frozen before it does
        fraction = 0.0 if work[0, 0] < -ROUNDED else first_change(work[0], work[1])
        if np.isnan(fraction):
            fraction = 0.5
        elif fraction != NEVER and fraction * step < least:
            if closed:
                # It separates at once. What comes back is another contact: the step must end before
                fraction = 1.0 if after[row, DISTANCE] > ROUNDED else 0.5
            else:
                # Exudyn calls back before it judges a step's error: the end of one far too long is arbitrary,
                # and only the start shows what is at the wall
                fraction = 0.5
                if before[row, DISTANCE] <= ROUNDED - 2.0 * least * before[row, SPEED]:
                    contact[RATE] = before[row, SPEED]
                    if journal is not None and row == PIN_ROW:
                        close(row, contacts, start, journal)
                    elif guide is not None:
                        close(row, contacts, start, guide)
        first = min(first, fraction)
    if workpiece is not None:
        first = min(first, kink_fraction(before[HEIGHT_ROW], after[HEIGHT_ROW], step, workpiece, work))
    return first


@kernel
def kink_fraction(before: Array, after: Array, step: float, workpiece: Array, work: Array) -> float:
    """Return the fraction of a step up to where it has passed a kink of a workpiece's force; 1: none.

    Passed by twice ``_BEYOND``, located at ``_BEYOND``: the step that ends there has not passed it, and the
    next one starts on its other side. ``before`` and ``after`` are the height at both ends.
    """
    first = 1.0
    for row in range(1, len(workpiece)):
        # A power law has its only kink at the surface
        depth = 0.0 if workpiece[0, EXPONENT] > 0.0 else workpiece[row, DEPTH]
        height = workpiece[0, SURFACE] - depth
        sign = 1.0 if before[DISTANCE] >= height else -1.0
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
def switch(
    row: int, start: float, end: float, before: Array, after: Array, law: Array, contacts: Array
) -> bool:
    """End the contact of a row that has opened in an accepted step, or begin one that touches at its end.

    Return whether there is one. ``before`` and ``after`` are the distances at both ends of the step.
    """
    gap, rate, switched = after[row, DISTANCE], after[row, SPEED], False
    contact = contacts[row]
    # What has just touched may still be open by round-off, but it approaches
    if contact[CLOSED] > 0.0 and (gap > ROUNDED or (gap >= -ROUNDED and rate > 0.0)):
        # In an accepted step a contact separates at one of the ends alone: see `accepted_fraction`
        separate(row, contacts, end if gap < -before[row, DISTANCE] else start, law)
        switched = True
    contact[RATE] = rate
    if contact[CLOSED] == 0.0 and gap <= ROUNDED and rate < 0.0:
        close(row, contacts, end, law)
        switched = True
    return switched
