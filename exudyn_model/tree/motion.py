"""State of a tree within a step, and the motion of slider, crank pin and contacts that follows from it.

Both trees, that of rod 4 and slider and that of all but the crank, share these kernels. What drives a tree
is a function of time: joint C where the crank pin is ideal (``linkage``), else the journal.
Each angle is interpolated by its quintic Hermite polynomial: angle, angular velocity and acceleration.
"""

from typing import Any, NamedTuple

import numpy as np

from exudyn_model.compiled import kernel
from exudyn_model.contact.gaps import corner_motion
from exudyn_model.contact.journal import CrankAndRod2, pin_motion
from exudyn_model.contact.states import PIN
from exudyn_model.linkage import TipMotion, carried_tip, rocker_tip

# End of a step: s, rad, rad/s, rad/s^2. Rod 2 and rocker stay 0 where the crank pin is ideal, the slider's
# angle where the slider is
MOTION = np.dtype(
    [("time", np.float64)]
    + [(f"{part}{body}", np.float64) for body in "2345" for part in ("theta", "w", "a")]
)

# rad: some roundings of angles up to 2 pi
_ROUNDING = 4e-15


class TreeState(NamedTuple):
    """Angles (rad) of rod 2, rocker, rod 4 and slider and their rates (rad/s) at a time (s).

    ``tip`` is the motion of joint C, from :func:`tip_motion`: all that follows from a state needs it, and the
    closed form of the driven linkage costs more than the rest.
    """

    time: float
    theta2: float
    w2: float
    theta3: float
    w3: float
    theta4: float
    w4: float
    theta5: float
    w5: float
    tip: TipMotion


@kernel
def tip_motion(time: float, theta3: float, w3: float, linkage: Any) -> TipMotion:
    """Return the motion of joint C; its acceleration, where the crank pin has clearance, as 0: not known yet.

    Arguments: time (s), the rocker's angle and its rate (rad, rad/s).
    """
    if linkage.ideal_pin:
        return rocker_tip(time, linkage)
    x, y, vx, vy = carried_tip(theta3, w3, linkage)
    return TipMotion(x, y, vx, vy, 0.0, 0.0)


@kernel
def state_at(motion: Any, linkage: Any) -> TreeState:
    """Return the state at the end of a step."""
    return TreeState(
        motion.time,
        motion.theta2,
        motion.w2,
        motion.theta3,
        motion.w3,
        motion.theta4,
        motion.w4,
        motion.theta5,
        motion.w5,
        tip_motion(motion.time, motion.theta3, motion.w3, linkage),
    )


@kernel
def slider_motion(state: TreeState, linkage: Any) -> tuple[float, float, float, float]:
    """Return the slider's x from the guide's centre line, y, vx and vy (m, s)."""
    tip = state.tip
    along_x = linkage.rod4_length * np.cos(state.theta4)
    along_y = linkage.rod4_length * np.sin(state.theta4)
    return (
        tip.x + along_x - linkage.guide_x,
        tip.y + along_y,
        tip.vx - state.w4 * along_y,
        tip.vy + state.w4 * along_x,
    )


@kernel
def crank_and_rod2_at(state: TreeState, linkage: Any, pin_law: Any) -> CrankAndRod2:
    """Return the motion of the driven crank and of rod 2, which hangs on the rocker."""
    angle1, w1 = linkage.crank_angle + linkage.omega * state.time, linkage.omega
    radius1 = linkage.crank_length - pin_law.crank_to_tip
    x1, y1 = radius1 * np.cos(angle1), radius1 * np.sin(angle1)
    arm3, arm2 = linkage.rocker_to_b, linkage.rod2_length - linkage.rod2_centroid
    bx, by = arm3 * np.cos(state.theta3), arm3 * np.sin(state.theta3)
    cx, cy = arm2 * np.cos(state.theta2), arm2 * np.sin(state.theta2)
    return CrankAndRod2(
        x1,
        y1,
        angle1,
        linkage.pivot_x + bx - cx,
        linkage.pivot_y + by - cy,
        state.theta2,
        -w1 * y1,
        w1 * x1,
        w1,
        -state.w3 * by + state.w2 * cy,
        state.w3 * bx - state.w2 * cx,
        state.w2,
    )


@kernel
def contact_motion(
    number: int, state: TreeState, linkage: Any, law: Any, pin_law: Any
) -> tuple[float, float]:
    """Return the gap (m) of one of ``CONTACTS`` and its rate (m/s)."""
    if number == PIN:
        journal = pin_motion(crank_and_rod2_at(state, linkage, pin_law), pin_law)
        return journal.gap, journal.rate
    x, _, vx, vy = slider_motion(state, linkage)
    corner = corner_motion(number, x, state.theta5, vx, vy, state.w5, law)
    return corner.gap, corner.rate


@kernel
def has_clearance(number: int, linkage: Any) -> bool:
    """Return whether one of ``CONTACTS`` has a clearance at all."""
    ideal: bool = linkage.ideal_pin if number == PIN else linkage.ideal_slider
    return not ideal


@kernel
def quintic(
    x0: float, v0: float, a0: float, x1: float, v1: float, a1: float, step: float, fraction: float
) -> tuple[float, float]:
    """Return value and rate, at a fraction of the step, of the polynomial given by both ends.

    Each end is given by value, rate and second derivative.
    """
    # Cubic polynomial of the rate, by rates and second derivatives; what its integral leaves of the rise
    slope0, slope1 = step * a0, step * a1
    c2, c3 = 3.0 * (v1 - v0) - 2.0 * slope0 - slope1, 2.0 * (v0 - v1) + slope0 + slope1
    missing = x1 - x0 - step * (0.5 * (v0 + v1) + (slope0 - slope1) / 12.0)
    square, rest = fraction * fraction, 1.0 - fraction
    integral = fraction * (v0 + fraction * (0.5 * slope0 + fraction * (c2 / 3.0 + 0.25 * fraction * c3)))
    value = x0 + step * integral + missing * square * fraction * (10.0 + fraction * (6.0 * fraction - 15.0))
    rate = v0 + fraction * (slope0 + fraction * (c2 + fraction * c3))
    # Round-off of the angles is no rate: in a step of 1e-7 s it would be one of 1e-8 rad/s
    if abs(missing) > _ROUNDING:
        rate += 30.0 * square * rest * rest * missing / step
    return value, rate


@kernel
def interpolate(start: Any, end: Any, fraction: float, linkage: Any) -> TreeState:
    """Return the state at a fraction of the step between two ``MOTION`` records."""
    step = end.time - start.time
    theta2, w2 = quintic(start.theta2, start.w2, start.a2, end.theta2, end.w2, end.a2, step, fraction)
    theta3, w3 = quintic(start.theta3, start.w3, start.a3, end.theta3, end.w3, end.a3, step, fraction)
    theta4, w4 = quintic(start.theta4, start.w4, start.a4, end.theta4, end.w4, end.a4, step, fraction)
    theta5, w5 = quintic(start.theta5, start.w5, start.a5, end.theta5, end.w5, end.a5, step, fraction)
    time = start.time + fraction * step
    tip = tip_motion(time, theta3, w3, linkage)
    return TreeState(time, theta2, w2, theta3, w3, theta4, w4, theta5, w5, tip)
