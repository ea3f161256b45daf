"""Force of the guide on the slider: that of all corners, as a user function of Exudyn.

``laws`` gives the normal forces of the two corners of a side from the depths of both, ``friction`` what goes
with them, ``impact_speed`` the speeds that the damping refers to; ``foundation`` all three of a side that is
one contact.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from exudyn_model.bodies import ANGLE, X, Y
from exudyn_model.compiled import ForceUserFunction, direct, kernel
from exudyn_model.contact.foundation import SideForces, foundation_forces, side_speed_in_force
from exudyn_model.contact.friction import friction_force
from exudyn_model.contact.gaps import CornerMotion, corner_motion
from exudyn_model.contact.impact_speed import impact_speed_in_force
from exudyn_model.contact.laws import FOUNDATION, side_normals
from exudyn_model.contact.states import ACROSS, UPPER


@kernel
def side_forces(
    lower: CornerMotion, upper: CornerMotion, lower_speed: float, upper_speed: float, law: Any
) -> SideForces:
    """Return the forces of the corners of one side; an impact speed (m/s) of 0 means open."""
    if law.kind == FOUNDATION:
        speed = max(lower_speed, upper_speed)
        if speed > 0.0:
            return foundation_forces(lower, upper, speed, law)
        return SideForces(0.0, 0.0, 0.0, 0.0, 0.0)
    first, second = side_normals(
        -lower.gap, -lower.rate, lower_speed, -upper.gap, -upper.rate, upper_speed, law
    )
    first_friction = friction_force(first, lower.slip, law)
    return SideForces(first, second, first_friction, friction_force(second, upper.slip, law), 0.0)


@kernel
def corner_load(
    number: int, normal: float, friction: float, motion: CornerMotion
) -> tuple[float, float, float]:
    """Return fx, fy (N) and the moment about the slider's centre (N m) of a corner's force and friction."""
    inward = -ACROSS[number] * normal
    return inward, friction, motion.arm_x * friction - motion.arm_y * inward


@kernel
def _side_load(
    side: int, lower: CornerMotion, upper: CornerMotion, lower_speed: float, upper_speed: float, law: Any
) -> tuple[float, float, float]:
    """Return fx, fy (N) and moment (N m) of the corners of one side; an impact speed of 0 means open."""
    forces = side_forces(lower, upper, lower_speed, upper_speed, law)
    first = corner_load(side, forces.lower, forces.lower_friction, lower)
    second = corner_load(side + UPPER, forces.upper, forces.upper_friction, upper)
    return first[0] + second[0], first[1] + second[1], first[2] + second[2]


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
    """Return the resultant of all corners on the slider: fx, fy (N) and the moment about its centre (N m).

    Parameters
    ----------
    x, angle, vx, vy, omega : float
        Slider's x from the guide's centre line (m), angle (rad) and velocities, at the end of the step.
    law : ndarray, shape (1,)
        From ``gaps.contact_law``.
    corners : ndarray, shape (5,)
        States of the contacts at the start of the step.
    """
    constants = law[0]
    fx, fy, moment = 0.0, 0.0, 0.0
    for side in range(2):
        lower = corner_motion(side, x, angle, vx, vy, omega, constants)
        upper = corner_motion(side + UPPER, x, angle, vx, vy, omega, constants)
        if lower.gap < 0.0 or upper.gap < 0.0:
            low, up = corners[side], corners[side + UPPER]
            if constants.kind == FOUNDATION:
                lower_speed = upper_speed = side_speed_in_force(low, up, lower, upper, constants)
            else:
                lower_speed = impact_speed_in_force(low, lower.gap, lower.rate, constants)
                upper_speed = impact_speed_in_force(up, upper.gap, upper.rate, constants)
            load = _side_load(side, lower, upper, lower_speed, upper_speed, constants)
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
    """Return :func:`slider_force` of the corners alone that are in contact: with a frozen impact speed.

    For steps that end at each touch. Inside such a step a corner that was open stays without force, even
    where a trial state lies behind the wall: the motion of a trial step is smooth up to the touch that it
    is to locate.
    """
    constants = law[0]
    fx, fy, moment = 0.0, 0.0, 0.0
    for side in range(2):
        lower_speed, upper_speed = corners[side].impact_speed, corners[side + UPPER].impact_speed
        if lower_speed > 0.0 or upper_speed > 0.0:
            lower = corner_motion(side, x, angle, vx, vy, omega, constants)
            upper = corner_motion(side + UPPER, x, angle, vx, vy, omega, constants)
            load = _side_load(side, lower, upper, lower_speed, upper_speed, constants)
            fx, fy, moment = fx + load[0], fy + load[1], moment + load[2]
    return fx, fy, moment


def force_user_function(law: NDArray[np.void], corners: NDArray[np.void]) -> ForceUserFunction:
    """Make the ``forceUserFunction`` of an ``ObjectGenericODE2`` on the slider's node.

    The node's reference x must be the guide's centre line and its other references zero, so that the
    coordinates that Exudyn passes are those of :func:`slider_force`.
    """
    found = direct(slider_force, 0.0, 0.0, 0.0, 0.0, 0.0, law, corners)

    def force(mbs: Any, t: float, number: int, q: list[float], v: list[float]) -> tuple[float, ...]:
        del mbs, t, number
        # Exudyn passes lists, which numba would copy element by element: scalars are 7 us faster a call
        return found(q[X], q[ANGLE], v[X], v[Y], v[ANGLE], law, corners)

    return force
