"""Rod 4 and slider alone, as a kinematic tree of Exudyn in the accelerating frame of the rocker's tip C.

The drive makes C move as it does whatever the slider meets (``rocker_tip``), so that two coordinates are
free: the angle of rod 4, and the angle of the slider from rod 4. No joint is left as a constraint, which
Exudyn's explicit integrators would ignore. The tree's base stands still at C; what the moving frame adds is
a force of inertia, - mass times the acceleration of C in each centre of mass.
"""

from collections.abc import Callable
from typing import Any

import exudyn as exu
import numpy as np
from exudyn.itemInterface import NodeGenericODE2, ObjectKinematicTree
from numpy.typing import NDArray

from exudyn_model.accelerations import linkage_record
from exudyn_model.assembly import ROD4, SLIDER, InitialState
from exudyn_model.compiled import direct, kernel
from exudyn_model.contact import contact_law, frozen_slider_force
from exudyn_model.journal import journal_law
from exudyn_model.mechanism import Model
from exudyn_model.parameters import Parameters
from exudyn_model.point_contact import contact_states
from exudyn_model.rocker_tip import rocker_tip
from exudyn_model.tree_motion import TreeState, slider_motion


@kernel
def tree_force(
    time: float,
    theta4: float,
    relative: float,
    w4: float,
    relative_w: float,
    linkage: NDArray[np.void],
    law: NDArray[np.void],
    corners: NDArray[np.void],
) -> tuple[float, float]:
    """Moments (N m) of inertia and contact on rod 4's angle and on the slider's angle from rod 4."""
    constants = linkage[0]
    state = TreeState(time, 0.0, 0.0, 0.0, 0.0, theta4, w4, theta4 + relative, w4 + relative_w)
    _, _, _, _, tip_ax, tip_ay = rocker_tip(time, constants)
    x, _, vx, vy = slider_motion(state, constants)
    fx, fy, moment = frozen_slider_force(x, state.theta5, vx, vy, state.w5, law, corners)
    first_moment = (
        constants.rod4_mass * constants.rod4_centroid + constants.slider_mass * constants.rod4_length
    )
    length = constants.rod4_length
    across_x = length * fx - first_moment * tip_ax
    across_y = length * fy - first_moment * tip_ay
    return -np.sin(theta4) * across_x + np.cos(theta4) * across_y + moment, moment


def build_tree(parameters: Parameters, state: InitialState) -> Model:
    """Build rod 4 and slider at ``state``.

    Its coordinates are the angle of rod 4 and the angle of the slider from rod 4, rad.
    """
    rod, slider = parameters.mechanism.rod4, parameters.mechanism.slider
    linkage = linkage_record(parameters)
    # No fixed step: the law's `step` is read by touches inside a step alone, which do not occur here
    law, contacts = contact_law(parameters.contact, slider, np.nan), contact_states()

    container = exu.SystemContainer()
    mbs = container.AddSystem()
    theta4, theta5 = state.positions[[ROD4, SLIDER], 2]
    w4, w5 = state.velocities[[ROD4, SLIDER], 2]
    node = mbs.AddNode(
        NodeGenericODE2(
            numberOfODE2Coordinates=2,
            referenceCoordinates=[0.0, 0.0],
            initialCoordinates=[theta4, theta5 - theta4],
            initialCoordinates_t=[w4, w5 - w4],
        )
    )
    mbs.AddObject(
        ObjectKinematicTree(
            nodeNumber=node,
            jointTypes=[exu.JointType.RevoluteZ, exu.JointType.RevoluteZ],
            linkParents=[-1, 0],
            jointTransformations=matrices(np.eye(3), np.eye(3)),
            jointOffsets=vectors([0.0, 0.0, 0.0], [rod.length, 0.0, 0.0]),
            linkInertiasCOM=matrices(np.diag([0.0, 0.0, rod.inertia]), np.diag([0.0, 0.0, slider.inertia])),
            linkCOMs=vectors([rod.centroid, 0.0, 0.0], [0.0, 0.0, 0.0]),
            linkMasses=[rod.mass, slider.mass],
            gravity=[0.0, -parameters.mechanism.gravity, 0.0],
            forceUserFunction=force_user_function(linkage, law, contacts),
        )
    )
    mbs.Assemble()
    return Model(mbs, container, linkage, law, journal_law(parameters, np.nan), contacts, ())


def matrices(*items: NDArray[np.float64]) -> Any:
    """Exudyn's list of 3 x 3 matrices."""
    found = exu.Matrix3DList()
    for item in items:
        found.Append(item)
    return found


def vectors(*items: list[float]) -> Any:
    """Exudyn's list of vectors in space."""
    found = exu.Vector3DList()
    for item in items:
        found.Append(item)
    return found


def force_user_function(
    linkage: NDArray[np.void], law: NDArray[np.void], corners: NDArray[np.void]
) -> Callable[[Any, float, int, list[float], list[float]], tuple[float, float]]:
    """``forceUserFunction`` of the tree; the time that Exudyn passes is that of the stage."""
    moments = direct(tree_force, 0.0, 0.0, 0.0, 0.0, 0.0, linkage, law, corners)

    def force(mbs: Any, t: float, number: int, q: list[float], v: list[float]) -> tuple[float, float]:
        del mbs, number
        return moments(t, q[0], q[1], v[0], v[1], linkage, law, corners)

    return force
