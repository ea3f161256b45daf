"""Where in a step of rod 4 and slider a corner touches or leaves: located, so that a step ends there.

Between the ends of a step both angles are interpolated by their quintic Hermite polynomials (angle, angular
velocity and acceleration); the gap is that of the interpolated state, not a polynomial of its own.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from exudyn_model.accelerations import rod4_acceleration
from exudyn_model.compiled import kernel
from exudyn_model.contact import corner_motion, frozen_slider_force
from exudyn_model.tree import slider_motion

# State of rod 4 and slider: s, rad, rad/s, rad/s^2
MOTION = np.dtype([(name, np.float64) for name in ("time", "theta4", "w4", "a4", "theta5", "w5", "a5")])

# A gap (m) that counts as none: some roundings of the sums of lengths near 0.6 m that it comes from. The
# second corner of a side rests at 1e-11 m under the "strip" law, and far less where it bears little
GAP_TOLERANCE = 2e-15


@kernel
def complete(
    motion: Any, linkage: NDArray[np.void], law: NDArray[np.void], corners: NDArray[np.void]
) -> None:
    """Fill in the angular accelerations of ``motion`` by balance of forces."""
    constants = linkage[0]
    x, _, vx, vy, tip_ax, tip_ay = slider_motion(motion.time, motion.theta4, motion.w4, constants)
    fx, fy, moment = frozen_slider_force(x, motion.theta5, vx, vy, motion.w5, law, corners)
    motion.a4 = rod4_acceleration(motion.theta4, tip_ax, tip_ay, fx, fy, constants)
    motion.a5 = moment / constants.slider_inertia


@kernel
def quintic(
    x0: float, v0: float, a0: float, x1: float, v1: float, a1: float, step: float, share: float
) -> tuple[float, float]:
    """Value and rate, at a share of the step, of the polynomial given by both ends.

    Ends are given by value, rate and second derivative.
    """
    rise = x1 - x0 - step * (v0 + 0.5 * step * a0)
    slope = step * (v1 - v0 - step * a0)
    bend = step * step * (a1 - a0)
    c3 = 10.0 * rise - 4.0 * slope + 0.5 * bend
    c4 = -15.0 * rise + 7.0 * slope - bend
    c5 = 6.0 * rise - 3.0 * slope + 0.5 * bend
    t = share * step
    value = x0 + t * (v0 + 0.5 * t * a0) + share**3 * (c3 + share * (c4 + share * c5))
    rate = v0 + t * a0 + share**2 * (3.0 * c3 + share * (4.0 * c4 + share * 5.0 * c5)) / step
    return value, rate


@kernel
def interpolate(start: Any, end: Any, share: float) -> tuple[float, float, float, float, float]:
    """Time, angle of rod 4, its rate, angle of the slider, its rate, at a share of the step."""
    step = end.time - start.time
    theta4, w4 = quintic(start.theta4, start.w4, start.a4, end.theta4, end.w4, end.a4, step, share)
    theta5, w5 = quintic(start.theta5, start.w5, start.a5, end.theta5, end.w5, end.a5, step, share)
    return start.time + share * step, theta4, w4, theta5, w5


@kernel
def gap_within(
    number: int, start: Any, end: Any, share: float, linkage: Any, law: Any
) -> tuple[float, float]:
    """Gap (m) of a corner and its rate (m/s) at a share of the step."""
    time, theta4, w4, theta5, w5 = interpolate(start, end, share)
    x, _, vx, vy, _, _ = slider_motion(time, theta4, w4, linkage)
    gap, rate, _, _, _ = corner_motion(number, x, theta5, vx, vy, w5, law)
    return gap, rate


@kernel
def crossing_within(
    number: int, start: Any, end: Any, low: float, high: float, linkage: Any, law: Any
) -> float:
    """Share of the step at which the gap is zero; its signs at ``low`` and ``high`` must differ.

    Newton's method, safeguarded by bisection.
    """
    step = end.time - start.time
    open_at_low = gap_within(number, start, end, low, linkage, law)[0] > 0.0
    share = 0.5 * (low + high)
    for _ in range(100):
        gap, rate = gap_within(number, start, end, share, linkage, law)
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
def touch_within(number: int, corner: Any, start: Any, end: Any, linkage: Any, law: Any) -> float:
    """Share of the step at which an open corner touches, 2 if it does not.

    Also where it comes and goes inside the step: then the gap has a minimum between.
    """
    gap, rate = gap_within(number, start, end, 1.0, linkage, law)
    high = 1.0
    if gap >= -GAP_TOLERANCE:
        if not corner.rate < 0.0 < rate:
            return 2.0
        low = 0.0
        for _ in range(50):
            middle = 0.5 * (low + high)
            if gap_within(number, start, end, middle, linkage, law)[1] < 0.0:
                low = middle
            else:
                high = middle
        if gap_within(number, start, end, high, linkage, law)[0] >= -GAP_TOLERANCE:
            return 2.0
    if corner.gap <= GAP_TOLERANCE:
        return 0.0  # at the wall already
    return crossing_within(number, start, end, 0.0, high, linkage, law)


@kernel
def locate(
    start: Any,
    end: Any,
    linkage: NDArray[np.void],
    law: NDArray[np.void],
    corners: NDArray[np.void],
    least: float,
) -> float:
    """Share of the step up to the first corner that touches or leaves; 1 if the step can be accepted.

    A corner that touches sooner than ``least`` (s) after the start touches *at* the start: its impact speed
    is frozen here, and the step is to be tried again with it. Leaving, its force is 0 already but has a kink,
    across which no interpolation is accurate.
    """
    first, step = 2.0, end.time - start.time
    constants = law[0]
    for number in range(4):
        corner = corners[number]
        if corner.impact_speed > 0.0:
            gap = gap_within(number, start, end, 1.0, linkage[0], constants)[0]
            if corner.gap < -GAP_TOLERANCE and gap > GAP_TOLERANCE:
                share = crossing_within(number, start, end, 0.0, 1.0, linkage[0], constants)
                if share * step >= least:
                    first = min(first, share)
        else:
            share = touch_within(number, corner, start, end, linkage[0], constants)
            if share * step < least:
                freeze(corner, start.time, constants)
                first = min(first, 0.5)
            else:
                first = min(first, share)
    return min(first, 1.0)


@kernel
def freeze(corner: Any, time: float, law: Any) -> None:
    """Begin a contact: its impact speed is that of the corner's state now, floored."""
    corner.impact_speed = max(-corner.rate, law.impact_speed_floor)
    corner.start = time
    corner.impulse, corner.peak, corner.depth = 0.0, 0.0, 0.0
