"""Rod 4 and slider alone, as a kinematic tree of Exudyn in the accelerating frame of the rocker's tip C.

The drive makes C move as it does whatever the slider meets (``linkage``), so that two coordinates are free:
the angle of rod 4, and the angle of the slider from rod 4. No joint is left as a constraint, which Exudyn's
explicit integrators would ignore. The tree's base stands still at C; the moving frame adds an inertial force,
- mass times the acceleration of C in each centre of mass.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from exudyn_model.assembly import InitialState
from exudyn_model.bodies import ANGLE, ROD4, SLIDER
from exudyn_model.compiled import ForceUserFunction, direct, kernel
from exudyn_model.constants import Constants, scene_constants
from exudyn_model.contact.corners import frozen_slider_force
from exudyn_model.contact.states import contact_states
from exudyn_model.linkage import rocker_tip
from exudyn_model.model import Model
from exudyn_model.parameters import Parameters
from exudyn_model.tree.building import Link, build_tree
from exudyn_model.tree.motion import TreeState, slider_motion


@kernel
def slider_tree_force(
    time: float,
    theta4: float,
    from_rod4: float,
    w4: float,
    from_rod_w4: float,
    linkage: NDArray[np.void],
    law: NDArray[np.void],
    corners: NDArray[np.void],
) -> tuple[float, float]:
    """Return the moments (N m) of inertia and contact on rod 4's angle and on the slider's from rod 4.

    Arguments: time (s), both coordinates (rad), their rates (rad/s).
    """
    constants = linkage[0]
    tip = rocker_tip(time, constants)
    state = TreeState(time, 0.0, 0.0, 0.0, 0.0, theta4, w4, theta4 + from_rod4, w4 + from_rod_w4, tip)
    x, _, vx, vy = slider_motion(state, constants)
    fx, fy, moment = frozen_slider_force(x, state.theta5, vx, vy, state.w5, law, corners)
    first_moment = (
        constants.rod4_mass * constants.rod4_centroid + constants.slider_mass * constants.rod4_length
    )
    length = constants.rod4_length
    across_x = length * fx - first_moment * tip.ax
    across_y = length * fy - first_moment * tip.ay
    return -np.sin(theta4) * across_x + np.cos(theta4) * across_y + moment, moment


def build_slider_tree(parameters: Parameters, state: InitialState) -> Model:
    """Build rod 4 and slider at ``state``.

    Its coordinates are the angle of rod 4 and the angle of the slider from rod 4, rad.
    """
    rod, slider = parameters.mechanism.rod4, parameters.mechanism.slider
    links = [
        Link(ROD4, -1, (0.0, 0.0), rod.centroid, rod.mass, rod.inertia),
        Link(SLIDER, 0, (rod.length, 0.0), 0.0, slider.mass, slider.inertia),
    ]
    constants, contacts = scene_constants(parameters, np.nan), contact_states()
    return build_tree(
        links,
        state.positions[:, ANGLE],
        state.velocities[:, ANGLE],
        parameters.mechanism.gravity,
        force_user_function(constants, contacts),
        constants,
        contacts,
    )


def force_user_function(constants: Constants, corners: NDArray[np.void]) -> ForceUserFunction:
    """Make the ``forceUserFunction`` of the tree; the time that Exudyn passes is that of the stage."""
    linkage, law = constants.linkage, constants.law
    moments = direct(slider_tree_force, 0.0, 0.0, 0.0, 0.0, 0.0, linkage, law, corners)

    def force(mbs: Any, t: float, number: int, q: list[float], v: list[float]) -> tuple[float, ...]:
        del mbs, number
        (theta4, from_rod4), (w4, from_rod_w4) = q, v
        return moments(t, theta4, from_rod4, w4, from_rod_w4, linkage, law, corners)

    return force
