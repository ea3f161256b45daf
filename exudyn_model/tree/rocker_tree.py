"""All bodies but the crank, as a kinematic tree of Exudyn from the rocker's pivot H.

Where the crank pin has clearance, nothing but the contact holds rod 2 to the driven crank, so that the
linkage is open: rod 2 and rod 4 hang on the rocker, a slider with clearance on rod 4. No joint is left as a
constraint, which Exudyn's explicit integrators would ignore. An ideal slider closes a loop, though: it does
not rotate, which makes it a point mass at the end of rod 4, and the guide gives it the force that leaves its
x without acceleration (``free_rocker``). How far it drifts from its line is the integration's error: measured
2e-10 m in two cycles at a tolerance of 1e-7, 5e-14 m at 1e-10.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from exudyn_model.accelerations import Forces
from exudyn_model.assembly import InitialState
from exudyn_model.bodies import ANGLE, ROCKER, ROD2, ROD4, SLIDER
from exudyn_model.compiled import ForceUserFunction, direct, kernel
from exudyn_model.constants import Constants, scene_constants
from exudyn_model.contact.states import contact_states
from exudyn_model.free_rocker import FreeAngles, free_angular_accelerations
from exudyn_model.model import Model
from exudyn_model.parameters import Mechanism, Parameters
from exudyn_model.tree.building import Link, build_tree
from exudyn_model.tree.forces import frozen_forces
from exudyn_model.tree.motion import TreeState, tip_motion

# Coordinates of the tree, or their rates; that of an ideal slider, which the tree has not got, is 0
_FourAngles = tuple[float, float, float, float]


@kernel
def _across(angle: float, fx: float, fy: float) -> float:
    """Part of a force across a direction, its moment per arm."""
    part: float = fy * np.cos(angle) - fx * np.sin(angle)
    return part


@kernel
def rocker_tree_force(
    time: float,
    q: _FourAngles,
    v: _FourAngles,
    linkage: NDArray[np.void],
    law: NDArray[np.void],
    pin_law: NDArray[np.void],
    contacts: NDArray[np.void],
) -> tuple[float, float, float, float]:
    """Return the moments (N m) of contact and guide on the coordinates of :func:`build_rocker_tree`."""
    constants = linkage[0]
    theta3, from_rocker2, from_rocker4, from_rod4 = q
    w3, from_rocker_w2, from_rocker_w4, from_rod_w4 = v
    theta4, w4 = theta3 + from_rocker4, w3 + from_rocker_w4
    state = TreeState(
        time,
        theta3 + from_rocker2,
        w3 + from_rocker_w2,
        theta3,
        w3,
        theta4,
        w4,
        theta4 + from_rod4,
        w4 + from_rod_w4,
        tip_motion(time, theta3, w3, constants),
    )
    forces = frozen_forces(state, linkage, law, pin_law, contacts)
    fx = forces.fx
    if constants.ideal_slider:
        angles = FreeAngles(state.theta2, state.w2, theta3, w3, theta4, w4)
        pin_alone = Forces(0.0, 0.0, 0.0, forces.pin_x, forces.pin_y, forces.pin_moment)
        _, _, _, fx = free_angular_accelerations(angles, pin_alone, constants)
    # About the ends that carry: rod 2 by B, rod 4 by C
    arm2 = constants.rod2_length - constants.rod2_centroid
    on_rod2 = forces.pin_moment - arm2 * _across(state.theta2, forces.pin_x, forces.pin_y)
    on_rod4 = forces.moment + constants.rod4_length * _across(theta4, fx, forces.fy)
    on_rocker = constants.rocker_to_b * _across(theta3, forces.pin_x, forces.pin_y)
    on_rocker += constants.rocker_length * _across(theta3, fx, forces.fy)
    # The rocker's coordinate rotates all of them, rod 4's rotates the slider too
    return on_rocker + on_rod2 + on_rod4, on_rod2, on_rod4, forces.moment


def build_rocker_tree(parameters: Parameters, state: InitialState) -> Model:
    """Build rocker, both rods and slider at ``state``.

    Its coordinates are the angle of the rocker, the angles of rod 2 and rod 4 from the rocker, and, where the
    slider has clearance, the angle of the slider from rod 4, rad.
    """
    constants, contacts = scene_constants(parameters, np.nan), contact_states()
    return build_tree(
        _links(parameters.mechanism),
        state.positions[:, ANGLE],
        state.velocities[:, ANGLE],
        parameters.mechanism.gravity,
        force_user_function(constants, contacts),
        constants,
        contacts,
    )


def _links(mechanism: Mechanism) -> list[Link]:
    rod2, rocker, rod4, slider = mechanism.rod2, mechanism.rocker, mechanism.rod4, mechanism.slider
    carried = [
        Link(ROCKER, -1, mechanism.rocker_pivot, rocker.centroid, rocker.mass, rocker.inertia),
        # Rod 2's frame sits at its end B and looks along it, away from A
        Link(ROD2, 0, (rocker.centroid, 0.0), -rod2.to_tip, rod2.mass, rod2.inertia),
    ]
    tip = (rocker.length, 0.0)
    if mechanism.ideal_slider:
        mass = rod4.mass + slider.mass
        centre = (rod4.mass * rod4.centroid + slider.mass * rod4.length) / mass
        inertia = rod4.inertia
        inertia += rod4.mass * (centre - rod4.centroid) ** 2 + slider.mass * (centre - rod4.length) ** 2
        return [*carried, Link(ROD4, 0, tip, centre, mass, inertia)]
    return [
        *carried,
        Link(ROD4, 0, tip, rod4.centroid, rod4.mass, rod4.inertia),
        Link(SLIDER, 2, (rod4.length, 0.0), 0.0, slider.mass, slider.inertia),
    ]


def force_user_function(constants: Constants, contacts: NDArray[np.void]) -> ForceUserFunction:
    """Make the ``forceUserFunction`` of the tree; the time that Exudyn passes is that of the stage."""
    ideal_slider = bool(constants.linkage[0]["ideal_slider"])
    four = (0.0,) * 4
    moments = direct(rocker_tree_force, 0.0, four, four, *constants, contacts)

    def force(mbs: Any, t: float, number: int, q: list[float], v: list[float]) -> tuple[float, ...]:
        del mbs, number
        if ideal_slider:
            return moments(t, (*q, 0.0), (*v, 0.0), *constants, contacts)[:3]
        return moments(t, tuple(q), tuple(v), *constants, contacts)

    return force
