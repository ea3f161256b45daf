"""All bodies but the crank, as a kinematic tree of Exudyn from the rocker's pivot H, for a loose crank pin.

Nothing but the contact holds rod 2 to the driven crank, so that the linkage is open: rod 2 and rod 4 hang on
the rocker, a loose slider on rod 4. No joint is left as a constraint, which Exudyn's explicit integrators
would ignore. An ideal slider closes a loop, though: it does not turn, which makes it a point mass at the end
of rod 4, and the guide gives it the force that leaves its x without acceleration (``loose_pin``). How far it
strays from its line is the integration's error: measured 2e-10 m in two turns of the crank at a tolerance of
1e-7, 5e-14 m at 1e-10.
"""

from collections.abc import Callable
from typing import Any

import exudyn as exu
import numpy as np
from exudyn.itemInterface import NodeGenericODE2, ObjectKinematicTree
from numpy.typing import NDArray

from exudyn_model.accelerations import linkage_record
from exudyn_model.assembly import ROCKER, ROD2, ROD4, SLIDER, InitialState
from exudyn_model.compiled import direct, kernel
from exudyn_model.contact import contact_law
from exudyn_model.journal import journal_law
from exudyn_model.loose_pin import loose_pin_angles
from exudyn_model.mechanism import Model
from exudyn_model.parameters import Parameters
from exudyn_model.point_contact import contact_states
from exudyn_model.tree import matrices, vectors
from exudyn_model.tree_forces import frozen_forces
from exudyn_model.tree_motion import TreeState


@kernel
def _across(angle: float, fx: float, fy: float) -> float:
    """Part of a force across a direction, its moment per arm."""
    part: float = fy * np.cos(angle) - fx * np.sin(angle)
    return part


@kernel
def rocker_tree_force(
    time: float,
    theta3: float,
    relative2: float,
    relative4: float,
    relative5: float,
    w3: float,
    relative_w2: float,
    relative_w4: float,
    relative_w5: float,
    linkage: NDArray[np.void],
    law: NDArray[np.void],
    pin_law: NDArray[np.void],
    contacts: NDArray[np.void],
) -> tuple[float, float, float, float]:
    """Moments (N m) of contact and guide on the tree's coordinates: see :func:`build_rocker_tree`."""
    constants = linkage[0]
    theta4, w4 = theta3 + relative4, w3 + relative_w4
    state = TreeState(
        time,
        theta3 + relative2,
        w3 + relative_w2,
        theta3,
        w3,
        theta4,
        w4,
        theta4 + relative5,
        w4 + relative_w5,
    )
    forces = frozen_forces(state, linkage, law, pin_law, contacts)
    fx = forces.fx
    if constants.ideal_slider:
        _, _, _, fx = loose_pin_angles(
            state.theta2,
            state.w2,
            theta3,
            w3,
            theta4,
            w4,
            forces.pin_x,
            forces.pin_y,
            forces.pin_moment,
            0.0,
            0.0,
            constants,
        )
    # About the ends that carry: rod 2 by B, rod 4 by C
    arm2 = constants.rod2_length - constants.rod2_centroid
    on_rod2 = forces.pin_moment - arm2 * _across(state.theta2, forces.pin_x, forces.pin_y)
    on_rod4 = forces.moment + constants.rod4_length * _across(theta4, fx, forces.fy)
    on_rocker = constants.rocker_to_b * _across(theta3, forces.pin_x, forces.pin_y)
    on_rocker += constants.rocker_length * _across(theta3, fx, forces.fy)
    # The rocker's coordinate turns all of them, rod 4's turns the slider too
    return on_rocker + on_rod2 + on_rod4, on_rod2, on_rod4, forces.moment


def build_rocker_tree(parameters: Parameters, state: InitialState) -> Model:
    """Build rocker, both rods and slider at ``state``.

    Its coordinates are the angle of the rocker, the angles of rod 2 and rod 4 from the rocker, and, where the
    slider is loose, the angle of the slider from rod 4, rad.
    """
    mechanism = parameters.mechanism
    rod2, rocker, rod4, slider = mechanism.rod2, mechanism.rocker, mechanism.rod4, mechanism.slider
    linkage = linkage_record(parameters)
    # No fixed step: the laws' `step` is read by touches inside a step alone, which do not occur here
    law, pin_law = contact_law(parameters.contact, slider, np.nan), journal_law(parameters, np.nan)
    contacts = contact_states()
    parents = [-1, 0, 0]
    offsets = [[*mechanism.rocker_pivot, 0.0], [rocker.centroid, 0.0, 0.0], [rocker.length, 0.0, 0.0]]
    # Rod 2's frame sits at its end B and looks along it, away from A
    centres = [[rocker.centroid, 0.0, 0.0], [-rod2.to_tip, 0.0, 0.0], [rod4.centroid, 0.0, 0.0]]
    masses, inertias = [rocker.mass, rod2.mass, rod4.mass], [rocker.inertia, rod2.inertia, rod4.inertia]
    bodies = [ROCKER, ROD2, ROD4]
    if mechanism.ideal_slider:
        mass = rod4.mass + slider.mass
        centre = (rod4.mass * rod4.centroid + slider.mass * rod4.length) / mass
        inertias[2] += rod4.mass * (centre - rod4.centroid) ** 2 + slider.mass * (centre - rod4.length) ** 2
        masses[2], centres[2][0] = mass, centre
    else:
        parents.append(2)
        offsets.append([rod4.length, 0.0, 0.0])
        centres.append([0.0, 0.0, 0.0])
        masses.append(slider.mass)
        inertias.append(slider.inertia)
        bodies.append(SLIDER)

    container = exu.SystemContainer()
    mbs = container.AddSystem()
    count = len(bodies)
    angles = np.stack([state.positions[bodies, 2], state.velocities[bodies, 2]])
    angles[:, 1:] -= angles[:, parents[1:]]
    node = mbs.AddNode(
        NodeGenericODE2(
            numberOfODE2Coordinates=count,
            referenceCoordinates=[0.0] * count,
            initialCoordinates=list(angles[0]),
            initialCoordinates_t=list(angles[1]),
        )
    )
    mbs.AddObject(
        ObjectKinematicTree(
            nodeNumber=node,
            jointTypes=[exu.JointType.RevoluteZ] * count,
            linkParents=parents,
            jointTransformations=matrices(*[np.eye(3)] * count),
            jointOffsets=vectors(*offsets),
            linkInertiasCOM=matrices(*(np.diag([0.0, 0.0, inertia]) for inertia in inertias)),
            linkCOMs=vectors(*centres),
            linkMasses=masses,
            gravity=[0.0, -mechanism.gravity, 0.0],
            forceUserFunction=force_user_function(linkage, law, pin_law, contacts),
        )
    )
    mbs.Assemble()
    return Model(mbs, container, linkage, law, pin_law, contacts, ())


def force_user_function(
    linkage: NDArray[np.void],
    law: NDArray[np.void],
    pin_law: NDArray[np.void],
    contacts: NDArray[np.void],
) -> Callable[[Any, float, int, list[float], list[float]], tuple[float, ...]]:
    """``forceUserFunction`` of the tree; the time that Exudyn passes is that of the stage."""
    ideal_slider = bool(linkage[0]["ideal_slider"])
    found = direct(rocker_tree_force, *[0.0] * 9, linkage, law, pin_law, contacts)

    def force(mbs: Any, t: float, number: int, q: list[float], v: list[float]) -> tuple[float, ...]:
        del mbs, number
        q5, w5 = (0.0, 0.0) if ideal_slider else (q[3], v[3])
        moments = found(t, q[0], q[1], q[2], q5, v[0], v[1], v[2], w5, linkage, law, pin_law, contacts)
        return moments[:3] if ideal_slider else moments

    return force
