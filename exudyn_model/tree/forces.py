"""Contact forces in a state of a tree, and the accelerations that follow from them by balance.

For steps that end where a contact begins or ends: inside of one, what is in contact keeps its frozen impact
speed, and what was open stays without force (``contact.corners.frozen_slider_force``).
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from exudyn_model.accelerations import Forces, rod4_acceleration
from exudyn_model.compiled import kernel
from exudyn_model.contact.corners import frozen_slider_force
from exudyn_model.contact.friction import friction_force
from exudyn_model.contact.journal import CrankAndRod2, pin_load, pin_motion
from exudyn_model.contact.point import damped, elastic_force
from exudyn_model.contact.states import PIN
from exudyn_model.free_rocker import FreeAngles, free_angular_accelerations
from exudyn_model.tree.motion import TreeState, crank_and_rod2_at, slider_motion, state_at


@kernel
def frozen_pin_force(bodies: CrankAndRod2, law: Any, state: Any) -> tuple[float, float, float]:
    """Return the force on rod 2 (N) and its moment about rod 2's centre (N m) of a pin in contact.

    As ``contact.journal.journal_force``, but for steps that end at each touch: the impact speed is the one
    frozen in ``state``, and friction that of the slip itself, since nothing is iterated.
    """
    motion = pin_motion(bodies, law)
    if motion.gap >= 0.0:
        return 0.0, 0.0, 0.0
    normal = damped(elastic_force(motion.gap, law), -motion.rate, state.impact_speed, law)
    fx, fy, _, moment = pin_load(normal, friction_force(normal, motion.slip, law), motion, bodies, law)
    return fx, fy, moment


@kernel
def frozen_forces(
    state: TreeState,
    linkage: NDArray[np.void],
    law: NDArray[np.void],
    pin_law: NDArray[np.void],
    contacts: NDArray[np.void],
) -> Forces:
    """Return the forces of the contacts in progress alone: those with a frozen impact speed."""
    constants = linkage[0]
    fx, fy, moment, pin_x, pin_y, pin_moment = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    if not constants.ideal_slider:
        x, _, vx, vy = slider_motion(state, constants)
        fx, fy, moment = frozen_slider_force(x, state.theta5, vx, vy, state.w5, law, contacts)
    if contacts[PIN].impact_speed > 0.0:
        bodies = crank_and_rod2_at(state, constants, pin_law[0])
        pin_x, pin_y, pin_moment = frozen_pin_force(bodies, pin_law[0], contacts[PIN])
    return Forces(fx, fy, moment, pin_x, pin_y, pin_moment)


@kernel
def angular_accelerations(
    state: TreeState, forces: Forces, linkage: Any
) -> tuple[float, float, float, float]:
    """Return those of rod 2, rocker, rod 4 and slider (rad/s^2) by balance of forces; 0 where driven."""
    alpha5 = 0.0 if linkage.ideal_slider else forces.moment / linkage.slider_inertia
    if linkage.ideal_pin:
        tip = state.tip
        alpha4 = rod4_acceleration(state.theta4, tip.ax, tip.ay, forces.fx, forces.fy, linkage)
        return 0.0, 0.0, alpha4, alpha5
    angles = FreeAngles(state.theta2, state.w2, state.theta3, state.w3, state.theta4, state.w4)
    alpha2, alpha3, alpha4, _ = free_angular_accelerations(angles, forces, linkage)
    return alpha2, alpha3, alpha4, alpha5


@kernel
def slider_centre_acceleration(
    state: TreeState, alpha3: float, alpha4: float, linkage: Any
) -> tuple[float, float]:
    """Return the slider's ax and ay (m/s^2) from the angular accelerations of rocker and rod 4."""
    if linkage.ideal_pin:
        tip_ax, tip_ay = state.tip.ax, state.tip.ay
    else:
        arm_x = linkage.rocker_length * np.cos(state.theta3)
        arm_y = linkage.rocker_length * np.sin(state.theta3)
        tip_ax = -alpha3 * arm_y - state.w3 * state.w3 * arm_x
        tip_ay = alpha3 * arm_x - state.w3 * state.w3 * arm_y
    along_x = linkage.rod4_length * np.cos(state.theta4)
    along_y = linkage.rod4_length * np.sin(state.theta4)
    return (
        tip_ax - alpha4 * along_y - state.w4 * state.w4 * along_x,
        tip_ay + alpha4 * along_x - state.w4 * state.w4 * along_y,
    )


@kernel
def complete(
    motion: Any,
    linkage: NDArray[np.void],
    law: NDArray[np.void],
    pin_law: NDArray[np.void],
    contacts: NDArray[np.void],
) -> None:
    """Fill in the angular accelerations of ``motion`` by balance of forces."""
    state = state_at(motion, linkage[0])
    forces = frozen_forces(state, linkage, law, pin_law, contacts)
    motion.a2, motion.a3, motion.a4, motion.a5 = angular_accelerations(state, forces, linkage[0])
