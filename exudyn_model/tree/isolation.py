"""Where in a step of a tree a gap passes through zero: found for certain, however often it reverses.

The gap is that of the interpolated state (``motion``), not a polynomial of its own. That it does not
change its sign follows from a bound of its second derivative (``step_bounds``): between two points a gap
is nowhere smaller than the parabola through both with that second derivative. Most steps are settled by their
ends alone; else the step is searched from its start on, in parts short enough to be settled each.
"""

from typing import Any

import numpy as np

from exudyn_model.compiled import kernel
from exudyn_model.contact.states import PIN
from exudyn_model.tree.motion import contact_motion, interpolate

# A gap (m) that counts as none: some roundings of the sums of lengths near 0.6 m that it comes from. The
# second corner of a side rests at 1e-11 m under the "strip" law, and far less where it bears little
GAP_TOLERANCE = 2e-15

# A fraction of the step that is none
NEVER = 2.0

# Gaps evaluated in the search of one step, after which a shorter step is asked for. A gap of 1e-13 m at rest
# over a step of free flight takes some 100
_SEARCH_LIMIT = 1000


@kernel
def gap_within(
    number: int, start: Any, end: Any, fraction: float, linkage: Any, law: Any, pin_law: Any
) -> tuple[float, float]:
    """Return the gap (m) of one of ``CONTACTS`` and its rate (m/s) at a fraction of the step."""
    return contact_motion(number, interpolate(start, end, fraction, linkage), linkage, law, pin_law)


@kernel
def crossing_within(
    number: int, start: Any, end: Any, low: float, high: float, linkage: Any, law: Any, pin_law: Any
) -> float:
    """Return the fraction of the step at which the gap is zero.

    Newton's method, safeguarded by bisection; the gap's signs at ``low`` and ``high`` must differ.
    """
    step = end.time - start.time
    open_at_low = gap_within(number, start, end, low, linkage, law, pin_law)[0] > 0.0
    fraction = 0.5 * (low + high)
    for _ in range(100):
        gap, rate = gap_within(number, start, end, fraction, linkage, law, pin_law)
        if (gap > 0.0) == open_at_low:
            low = fraction
        else:
            high = fraction
        change = -gap / (step * rate) if rate != 0.0 else 2.0
        if not low < fraction + change < high:
            change = 0.5 * (low + high) - fraction
        fraction += change
        if abs(change) < 1e-14 or abs(gap) < 1e-16:
            break
    return fraction


@kernel
def smooth_distance(number: int, gap: float, pin_law: Any) -> float:
    """Return a corner's gap (m); of the pin (c^2 - e^2) / (2 c), equal to it near 0 and smooth at e = 0."""
    return gap - 0.5 * gap * gap / pin_law.clearance if number == PIN else gap


@kernel
def lower_bound(first: float, last: float, curvature: float) -> float:
    """Bound a function on an interval from below, by its values at both ends.

    The function lies above the parabola through both ends with its greatest second derivative. ``curvature``
    is that derivative times the square of the interval's length.
    """
    rise = last - first
    if abs(rise) >= 0.5 * curvature:
        return min(first, last)
    return 0.5 * (first + last) - 0.125 * curvature - 0.5 * rise * rise / curvature


@kernel
def passed_within(
    number: int,
    sign: float,
    first: float,
    last: float,
    curvature: float,
    start: Any,
    end: Any,
    linkage: Any,
    law: Any,
    pin_law: Any,
) -> float:
    """Return the fraction of the step at which the distance is below zero, or ``NEVER``; nan if unsure.

    The distance is :func:`smooth_distance` times ``sign``: -1 for a contact that is closed.

    Parameters
    ----------
    number : int
        One of ``CONTACTS``.
    sign : float
    first, last : float
        The distances at the step's start and end, m.
    curvature : float
        Greatest second derivative of the distance, times the square of the step, m.
    start, end, linkage, law, pin_law : record
    """
    if last < -GAP_TOLERANCE:
        return 1.0
    low, width, at_low, at_high = 0.0, 1.0, first, last
    for _ in range(_SEARCH_LIMIT):
        if lower_bound(at_low, at_high, curvature * width * width) >= -GAP_TOLERANCE:
            if low + width >= 1.0:
                return NEVER
            low, at_low = low + width, at_high
            width = min(2.0 * width, 1.0 - low)
        else:
            width *= 0.5
        at_high = last
        if low + width < 1.0:
            gap, _ = gap_within(number, start, end, low + width, linkage, law, pin_law)
            at_high = sign * smooth_distance(number, gap, pin_law)
            if at_high < -GAP_TOLERANCE:
                return low + width
    return np.nan


@kernel
def change_within(
    number: int,
    contact: Any,
    gap: float,
    least_acceleration: float,
    greatest_acceleration: float,
    start: Any,
    end: Any,
    linkage: Any,
    law: Any,
    pin_law: Any,
) -> float:
    """Return the fraction of the step at which a contact begins or, where it is closed, ends, or ``NEVER``.

    Not necessarily the first one in the step: the step up to there is tried again, and searched again. 0 if
    the gap was zero from the start on until it passed; nan if a shorter step is needed to be sure.

    Parameters
    ----------
    number : int
        One of ``CONTACTS``.
    contact : record
        Its state at the step's start.
    gap : float
        At the step's end, m.
    least_acceleration, greatest_acceleration : float
        Bounds of the second derivative of :func:`smooth_distance` over the step, m/s^2.
    start, end, linkage, law, pin_law : record
    """
    step = end.time - start.time
    sign, curvature = 1.0, greatest_acceleration * step * step
    if contact.closed > 0.0:
        sign, curvature = -1.0, -least_acceleration * step * step
    first = sign * smooth_distance(number, contact.gap, pin_law)
    if first < -GAP_TOLERANCE:
        if sign > 0.0:
            return 0.0
        first = 0.0  # what touches within `least` is frozen before it does
    last = sign * smooth_distance(number, gap, pin_law)
    passed = passed_within(number, sign, first, last, curvature, start, end, linkage, law, pin_law)
    if passed == NEVER or np.isnan(passed):
        return passed
    low = 0.0
    if first <= GAP_TOLERANCE:
        # At the wall at the start. It has to separate before it can cross
        low, apart = passed, 0.0
        while apart <= GAP_TOLERANCE:
            low *= 0.5
            if low < 1e-16:
                return 0.0
            apart = sign * gap_within(number, start, end, low, linkage, law, pin_law)[0]
    return crossing_within(number, start, end, low, passed, linkage, law, pin_law)
