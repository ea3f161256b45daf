"""Contact of the slider's corners with the walls of its guide: a user function of Exudyn, its core compiled.

Each of the four corners is a sharp point and sees the infinite wall on its own side, at the guide's
centre line +- (half width + clearance). Normal force: Eqs. 9-11, clipped at 0. Friction: Eqs. 13-14.

The damping term needs the normal speed at the instant when the corner first touched. Exudyn advances in
fixed steps and calls the force at trial states of a step's end, so the instant lies inside a step:

- ``corners`` holds, for each corner, the state at the *start* of the current step. ``recording`` renews
  it there from the accepted state; nothing that a trial state does is ever kept.
- A corner that was in contact at the start keeps its frozen speed.
- A corner that was open and is closed in the trial state gets the speed at the instant of touch between
  the two, by :func:`touch`. The next renewal applies the same function to the accepted state, so the
  speed that is frozen is the one that the step itself was solved with: no jump, and second order is kept.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exudyn_model.compiled import kernel
from exudyn_model.parameters import Contact, Slider

# Order of the corners everywhere: lower/upper along the guide (y), left/right across it (x)
CORNERS = ("ll", "lr", "ul", "ur")

_LAW = np.dtype(
    [
        (name, np.float64)
        for name in (
            "half_width",
            "half_length",
            "half_opening",
            "stiffness",
            "exponent",
            "damping",
            "impact_speed_floor",
            "friction",
            "static_speed",
            "transition_speed",
            "step",
        )
    ]
)

# (mbs, t, object number, coordinates, velocities) -> generalized forces
ForceUserFunction = Callable[[Any, float, int, list[float], list[float]], tuple[float, float, float]]

# State of one corner at the start of the current step; impact_speed 0 means open. The fields from
# "start" on accumulate the contact that is going on (times in s from t = 0).
_CORNER = np.dtype(
    [
        (name, np.float64)
        for name in ("gap", "rate", "impact_speed", "normal", "friction", "start", "impulse", "peak", "depth")
    ]
)


def contact_law(contact: Contact, slider: Slider, step: float) -> NDArray[np.void]:
    """Collect the constants of the kernels in one record, shape (1,); lengths in m, the step in s."""
    law = np.zeros(1, _LAW)
    law["half_width"] = slider.width / 2
    law["half_length"] = slider.length / 2
    law["half_opening"] = slider.width / 2 + contact.clearance
    law["step"] = step
    for name in ("stiffness", "exponent", "damping", "impact_speed_floor"):
        law[name] = getattr(contact, name)
    for name in ("friction", "static_speed", "transition_speed"):
        law[name] = getattr(contact, name)
    return law


def corner_states() -> NDArray[np.void]:
    """Memory of the four corners, shape (4,), all zero: to be renewed before the first step."""
    return np.zeros(4, _CORNER)


@kernel
def corner_motion(
    number: int, x: float, angle: float, vx: float, vy: float, omega: float, law: Any
) -> tuple[float, float, float, float, float]:
    """Gap (m, positive open), its rate, slip speed along +y (m/s), and arm (m) of one corner.

    ``x`` counts from the guide's centre line.
    """
    sx = -law.half_width if number % 2 == 0 else law.half_width
    sy = -law.half_length if number < 2 else law.half_length
    cosine, sine = np.cos(angle), np.sin(angle)
    rx, ry = cosine * sx - sine * sy, sine * sx + cosine * sy
    outward = -1.0 if number % 2 == 0 else 1.0
    gap = law.half_opening - outward * (x + rx)
    rate = -outward * (vx - omega * ry)
    return gap, rate, vy + omega * rx, rx, ry


@kernel
def normal_force(depth: float, depth_rate: float, impact_speed: float, law: Any) -> float:
    """Eqs. 9-11: K depth^n (1 + C depth_rate / impact_speed) in N, at least 0: a wall cannot pull."""
    force: float = law.stiffness * depth**law.exponent * (1.0 + law.damping * depth_rate / impact_speed)
    return max(force, 0.0)


@kernel
def friction_force(normal: float, slip: float, law: Any) -> float:
    """Eqs. 13-14: modified Coulomb friction along +y in N; zero below ``static_speed``."""
    share: float = (abs(slip) - law.static_speed) / (law.transition_speed - law.static_speed)
    force: float = -law.friction * min(max(share, 0.0), 1.0) * normal * np.sign(slip)
    return force


@kernel
def crossing(gap0: float, rate0: float, gap1: float, rate1: float, step: float) -> float:
    """Fraction of a step at which the gap changes its sign: root of its cubic Hermite interpolant.

    Newton's method, safeguarded by bisection; gap0 and gap1 must differ in sign.
    """
    slope0, slope1 = step * rate0, step * rate1
    quadratic = 3.0 * (gap1 - gap0) - 2.0 * slope0 - slope1
    cubic = 2.0 * (gap0 - gap1) + slope0 + slope1
    low, high = 0.0, 1.0
    fraction = gap0 / (gap0 - gap1)
    for _ in range(60):
        value = gap0 + fraction * (slope0 + fraction * (quadratic + fraction * cubic))
        if (value > 0.0) == (gap0 > 0.0):
            low = fraction
        else:
            high = fraction
        slope = slope0 + fraction * (2.0 * quadratic + 3.0 * fraction * cubic)
        change = -value / slope if slope != 0.0 else 2.0
        if not low <= fraction + change <= high:
            change = 0.5 * (low + high) - fraction
        fraction += change
        if abs(change) < 1e-14:
            break
    return fraction


@kernel
def touch(gap0: float, rate0: float, gap1: float, rate1: float, law: Any) -> tuple[float, float]:
    """Fraction of the step at which an open corner touches, and its impact speed (m/s, floored).

    The speed is interpolated linearly between the ends of the step. The derivative of the Hermite
    interpolant would be of a higher order, but magnifies the Newton iteration's error in the positions by
    1/step.
    """
    fraction = crossing(gap0, rate0, gap1, rate1, law.step)
    speed = -(rate0 + fraction * (rate1 - rate0))
    return fraction, max(speed, law.impact_speed_floor)


@kernel
def impact_speed_in_force(corner: Any, gap: float, rate: float, law: Any) -> float:
    """Impact speed (m/s) that the damping of a penetrating corner refers to in the current step."""
    frozen: float = corner.impact_speed
    return frozen if frozen > 0.0 else touch(corner.gap, corner.rate, gap, rate, law)[1]


@kernel
def corner_load(
    number: int, normal: float, slip: float, rx: float, ry: float, law: Any
) -> tuple[float, float, float]:
    """Fx, fy (N) and the moment about the slider's centre (N m) of one corner's normal force and friction."""
    inward = normal if number % 2 == 0 else -normal
    friction = friction_force(normal, slip, law)
    return inward, friction, rx * friction - ry * inward


@kernel
def slider_force(
    x: float,
    angle: float,
    vx: float,
    vy: float,
    omega: float,
    law: NDArray[np.void],
    corners: NDArray[np.void],
) -> tuple[float, float, float]:
    """Resultant of all corners on the slider: fx, fy (N) and the moment about its centre (N m).

    Parameters
    ----------
    x, angle, vx, vy, omega : float
        Slider's x from the guide's centre line (m), angle (rad) and velocities, at the end of the step.
    law : ndarray, shape (1,)
        From :func:`contact_law`.
    corners : ndarray, shape (4,)
        State of the corners at the start of the step.
    """
    constants = law[0]
    fx, fy, moment = 0.0, 0.0, 0.0
    for number in range(4):
        gap, rate, slip, rx, ry = corner_motion(number, x, angle, vx, vy, omega, constants)
        if gap < 0.0:
            speed = impact_speed_in_force(corners[number], gap, rate, constants)
            normal = normal_force(-gap, -rate, speed, constants)
            load = corner_load(number, normal, slip, rx, ry, constants)
            fx, fy, moment = fx + load[0], fy + load[1], moment + load[2]
    return fx, fy, moment


@kernel
def frozen_slider_force(
    x: float,
    angle: float,
    vx: float,
    vy: float,
    omega: float,
    law: NDArray[np.void],
    corners: NDArray[np.void],
) -> tuple[float, float, float]:
    """:func:`slider_force` of the corners alone that are in contact: those with a frozen impact speed.

    For steps that end at each touch. Inside such a step a corner that was open stays without force, even
    where a trial state lies behind the wall: the motion of a trial step is smooth up to the touch that it
    is to locate.
    """
    constants = law[0]
    fx, fy, moment = 0.0, 0.0, 0.0
    for number in range(4):
        if corners[number].impact_speed > 0.0:
            gap, rate, slip, rx, ry = corner_motion(number, x, angle, vx, vy, omega, constants)
            if gap < 0.0:
                normal = normal_force(-gap, -rate, corners[number].impact_speed, constants)
                load = corner_load(number, normal, slip, rx, ry, constants)
                fx, fy, moment = fx + load[0], fy + load[1], moment + load[2]
    return fx, fy, moment


def force_user_function(law: NDArray[np.void], corners: NDArray[np.void]) -> ForceUserFunction:
    """``forceUserFunction`` of an ``ObjectGenericODE2`` on the slider's node.

    The node's reference x must be the guide's centre line and its other references zero, so that the
    coordinates that Exudyn passes are those of :func:`slider_force`.
    """

    def force(mbs: Any, t: float, number: int, q: list[float], v: list[float]) -> tuple[float, float, float]:
        del mbs, t, number
        # Exudyn passes lists, which numba would copy element by element: scalars are 7 us faster a call
        return slider_force(q[0], q[2], v[0], v[1], v[2], law, corners)

    return force
