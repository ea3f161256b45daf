"""Where in a step of a tree a contact touches or leaves: located, so that a step ends there.

The gap is that of the interpolated state (``tree_motion``), not a polynomial of its own. That no gap changes
its sign inside an accepted step, however often it turns round there, follows from a bound of its second
derivative (``gap_acceleration``): between two points a gap is nowhere smaller than the parabola through both
with that second derivative. Most steps are settled by their ends alone; else the step is searched from its
start on, in parts short enough for the parabola to settle each.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from exudyn_model.compiled import kernel
from exudyn_model.contact import corner_motion
from exudyn_model.gap_acceleration import (
    corner_acceleration_bounds,
    pin_acceleration_bounds,
    rotation,
    slider_acceleration_bounds,
)
from exudyn_model.journal import pin_motion
from exudyn_model.point_contact import CORNERS, PIN
from exudyn_model.rocker_tip import rocker_tip
from exudyn_model.tree_motion import contact_motion, driven_and_hung, interpolate, slider_motion

_CORNERS = len(CORNERS)

# A gap (m) that counts as none: some roundings of the sums of lengths near 0.6 m that it comes from. The
# second corner of a side rests at 1e-11 m under the "strip" law, and far less where it bears little
GAP_TOLERANCE = 2e-15

# Gaps evaluated in the search of one step, after which a shorter step is asked for. A gap of 1e-13 m at rest
# over a step of free flight takes some 100
_SEARCH_LIMIT = 1000

# Crossings of one step located one before the other, after which a shorter step is asked for: a gap turns
# round two or three times in a step
_CROSSINGS_LIMIT = 10


@kernel
def gap_within(
    number: int, start: Any, end: Any, share: float, linkage: Any, law: Any, pin_law: Any
) -> tuple[float, float]:
    """Gap (m) of one of ``CONTACTS`` and its rate (m/s) at a share of the step."""
    return contact_motion(number, interpolate(start, end, share), linkage, law, pin_law)


@kernel
def crossing_within(
    number: int, start: Any, end: Any, low: float, high: float, linkage: Any, law: Any, pin_law: Any
) -> float:
    """Share of the step at which the gap is zero; its signs at ``low`` and ``high`` must differ.

    Newton's method, safeguarded by bisection.
    """
    step = end.time - start.time
    open_at_low = gap_within(number, start, end, low, linkage, law, pin_law)[0] > 0.0
    share = 0.5 * (low + high)
    for _ in range(100):
        gap, rate = gap_within(number, start, end, share, linkage, law, pin_law)
        if (gap > 0.0) == open_at_low:
            low = share
        else:
            high = share
        change = -gap / (step * rate) if rate != 0.0 else 2.0
        if not low < share + change < high:
            change = 0.5 * (low + high) - share
        share += change
        if abs(change) < 1e-14 or abs(gap) < 1e-16:
            break
    return share


@kernel
def smooth_distance(number: int, gap: float, pin_law: Any) -> float:
    """Gap (m) of a corner; of the pin (c^2 - e^2) / (2 c), which is as much near 0 and smooth at e = 0."""
    return gap - 0.5 * gap * gap / pin_law.clearance if number == PIN else gap


@kernel
def least_between(first: float, last: float, bend: float) -> float:
    """Bound a function on an interval from below, by its values at both ends.

    ``bend`` is the greatest value of its second derivative times the square of the interval's length: the
    function lies above the parabola through both ends with that second derivative; its least value is found.
    """
    rise = last - first
    if abs(rise) >= 0.5 * bend:
        return min(first, last)
    return 0.5 * (first + last) - 0.125 * bend - 0.5 * rise * rise / bend


@kernel
def passed_within(
    number: int,
    sign: float,
    first: float,
    last: float,
    limit: float,
    bend: float,
    start: Any,
    end: Any,
    linkage: Any,
    law: Any,
    pin_law: Any,
) -> float:
    """Share of the step at which the distance has passed through zero; 2 if it never does, nan if unsure.

    The distance is :func:`smooth_distance` times ``sign``: -1 for a contact that leaves.

    Parameters
    ----------
    number : int
        One of ``CONTACTS``.
    sign, first, last : float
        The distances (m) at the step's start and at the share ``limit`` of it.
    limit : float
        Where the search ends.
    bend : float
        Greatest second derivative of the distance, times the square of the step, m.
    start, end, linkage, law, pin_law : record
    """
    if last < -GAP_TOLERANCE:
        return limit
    low, width, at_low, at_high = 0.0, limit, first, last
    for _ in range(_SEARCH_LIMIT):
        if least_between(at_low, at_high, bend * width * width) >= -GAP_TOLERANCE:
            if low + width >= limit:
                return 2.0
            low, at_low = low + width, at_high
            width = min(2.0 * width, limit - low)
        else:
            width *= 0.5
        at_high = last
        if low + width < limit:
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
    """Share of the step at which a contact first touches or, where it is closed, leaves; 2 if it does not.

    0 if it was at the wall all the time from the start on until it passed; nan if a shorter step is needed
    to be sure.

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
    sign, bend = 1.0, greatest_acceleration * step * step
    if contact.impact_speed > 0.0:
        sign, bend = -1.0, -least_acceleration * step * step
    first = sign * smooth_distance(number, contact.gap, pin_law)
    if first < -GAP_TOLERANCE:
        if sign > 0.0:
            return 0.0
        first = 0.0  # what touches within `least` is frozen before it does
    last, limit, found = sign * smooth_distance(number, gap, pin_law), 1.0, 2.0
    for _ in range(_CROSSINGS_LIMIT):
        passed = passed_within(number, sign, first, last, limit, bend, start, end, linkage, law, pin_law)
        if passed == 2.0 or np.isnan(passed):
            return found if passed == 2.0 else passed
        low = 0.0
        if first <= GAP_TOLERANCE:
            # At the wall at the start. It has to part from there before it can cross
            low, apart = passed, 0.0
            while apart <= GAP_TOLERANCE:
                low *= 0.5
                if low == 0.0:
                    return 0.0
                apart = sign * gap_within(number, start, end, low, linkage, law, pin_law)[0]
        # Between both a crossing, perhaps not the first
        limit = found = crossing_within(number, start, end, low, passed, linkage, law, pin_law)
        last = 0.0
    return np.nan


@kernel
def locate(
    start: Any,
    end: Any,
    linkage: NDArray[np.void],
    law: NDArray[np.void],
    pin_law: NDArray[np.void],
    contacts: NDArray[np.void],
    least: float,
) -> float:
    """Share of the step up to the first contact that touches or leaves; 1 if the step can be accepted.

    A contact that touches sooner than ``least`` (s) after the start touches *at* the start: its impact speed
    is frozen here, and the step is to be tried again with it. Leaving, its force is 0 already but has a kink,
    across which no interpolation is accurate.
    """
    constants, step = linkage[0], end.time - start.time
    laws = constants, law[0], pin_law[0]
    state = interpolate(start, end, 1.0)
    turn3 = rotation(start.theta3, start.w3, start.a3, end.theta3, end.w3, end.a3, step)
    first = 1.0
    if not constants.ideal_slider:
        turn4 = rotation(start.theta4, start.w4, start.a4, end.theta4, end.w4, end.a4, step)
        turn5 = rotation(start.theta5, start.w5, start.a5, end.theta5, end.w5, end.a5, step)
        tip_ax = rocker_tip(state.time, constants)[4] if constants.ideal_pin else 0.0
        x_least, x_greatest = slider_acceleration_bounds(tip_ax, step, state, turn3, turn4, constants)
        x, _, vx, vy = slider_motion(state, constants)
        for number in range(_CORNERS):
            gap = corner_motion(number, x, state.theta5, vx, vy, state.w5, law[0])[0]
            bounds = corner_acceleration_bounds(number, x_least, x_greatest, state.theta5, turn5, law[0])
            share = change_within(number, contacts[number], gap, *bounds, start, end, *laws)
            first = min(first, accepted_share(contacts[number], gap, share, start, step, least, law[0]))
    if not constants.ideal_pin:
        turn2 = rotation(start.theta2, start.w2, start.a2, end.theta2, end.w2, end.a2, step)
        gap, rate, slip, _, _ = pin_motion(driven_and_hung(state, constants, pin_law[0]), pin_law[0])
        bounds = pin_acceleration_bounds(gap, rate, slip, step, turn2, turn3, state.w2, constants, pin_law[0])
        share = change_within(PIN, contacts[PIN], gap, *bounds, start, end, *laws)
        first = min(first, accepted_share(contacts[PIN], gap, share, start, step, least, pin_law[0]))
    return first


@kernel
def accepted_share(
    contact: Any, gap: float, share: float, start: Any, step: float, least: float, law: Any
) -> float:
    """Share of the step up to which one contact lets it be accepted: see :func:`locate`.

    ``share`` is from :func:`change_within`, ``gap`` (m) that at the step's end.
    """
    if np.isnan(share):
        return 0.5
    if share * step >= least:
        return min(share, 1.0)
    if contact.impact_speed > 0.0:
        # It leaves at once. What comes back is another contact: the step must end before
        return 1.0 if gap > GAP_TOLERANCE else 0.5
    # Exudyn calls back before it judges a step's error: the end of one far too long may be any, and only the
    # start says what is at the wall
    if contact.gap <= GAP_TOLERANCE - 2.0 * least * contact.rate:
        freeze(contact, start.time, law)
    return 0.5


@kernel
def freeze(contact: Any, time: float, law: Any) -> None:
    """Begin a contact: its impact speed is that of now, floored; both laws have the same floor."""
    contact.impact_speed = max(-contact.rate, law.impact_speed_floor)
    contact.start = time
    contact.impulse, contact.peak, contact.depth = 0.0, 0.0, 0.0
