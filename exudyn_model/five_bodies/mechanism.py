"""The press in Exudyn: five rigid bodies, six revolute joints, drive, gravity, contacts."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import exudyn as exu
import numpy as np
from exudyn.itemInterface import (
    CoordinateConstraint,
    LoadMassProportional,
    MarkerBodyMass,
    MarkerBodyPosition,
    MarkerNodeCoordinate,
    NodePointGround,
    NodeRigidBody2D,
    ObjectGenericODE2,
    ObjectGround,
    ObjectJointRevolute2D,
    ObjectRigidBody2D,
)
from numpy.typing import NDArray

from exudyn_model import journal
from exudyn_model.accelerations import linkage_record
from exudyn_model.assembly import CRANK, FRAME, ROD2, SLIDER, InitialState, pins
from exudyn_model.contact import ForceUserFunction, contact_law, corner_motion, force_user_function
from exudyn_model.native_contact import add_corner_contacts
from exudyn_model.parameters import Parameters, Rod, Slider
from exudyn_model.point_contact import contact_states


@dataclass(frozen=True)
class Model:
    """An assembled Exudyn system with the memory that its contact forces read.

    Attributes
    ----------
    mbs : exudyn.MainSystem
    container : exudyn.SystemContainer
        Owner of ``mbs``; held so that it outlives it.
    linkage : ndarray, shape (1,)
        See ``accelerations``.
    law : ndarray, shape (1,)
        See ``contact``.
    pin_law : ndarray, shape (1,)
        See ``journal``.
    contacts : ndarray, shape (5,)
        See ``point_contact``.
    multipliers : tuple of str
        Channel of each Lagrange multiplier. Exudyn writes M a + (dc/dq)^T lambda = f, with c the second
        body's end less the first's: the channel, the constraint's force or moment on the second body (the
        motor's on the crank, the guide's on the slider), is -lambda.
    read_corners : callable or None
        See ``native_contact``; None where the contact is the user function.
    """

    mbs: Any
    container: Any
    linkage: NDArray[np.void]
    law: NDArray[np.void]
    pin_law: NDArray[np.void]
    contacts: NDArray[np.void]
    multipliers: tuple[str, ...]
    read_corners: Callable[[], NDArray[np.float64]] | None = None


def build(parameters: Parameters, state: InitialState, step: float) -> Model:
    """Build the mechanism at ``state``, for integration with a fixed ``step`` (s).

    Its coordinates are x, y, angle of bodies 1 to 5; the slider's x counts from the guide's centre line.
    """
    mechanism = parameters.mechanism
    container = exu.SystemContainer()
    mbs = container.AddSystem()
    ground = mbs.AddObject(ObjectGround())
    ground_node = mbs.AddNode(NodePointGround())

    nodes, bodies = [], []
    masses: list[Rod | Slider] = [
        mechanism.crank,
        mechanism.rod2,
        mechanism.rocker,
        mechanism.rod4,
        mechanism.slider,
    ]
    for number, body in enumerate(masses):
        # The contact's coordinates count from the guide's centre line: full precision in the gaps
        reference = np.array([mechanism.guide_x, 0.0, 0.0]) if number == SLIDER else np.zeros(3)
        node = mbs.AddNode(
            NodeRigidBody2D(
                referenceCoordinates=list(reference),
                initialCoordinates=list(state.positions[number] - reference),
                initialVelocities=list(state.velocities[number]),
            )
        )
        nodes.append(node)
        bodies.append(mbs.AddObject(ObjectRigidBody2D(mass=body.mass, inertia=body.inertia, nodeNumber=node)))
        centre = mbs.AddMarker(MarkerBodyMass(bodyNumber=bodies[-1]))
        mbs.AddLoad(LoadMassProportional(markerNumber=centre, loadVector=[0.0, -mechanism.gravity, 0.0]))

    multipliers = []
    contacts = contact_states()
    pin_law = journal.journal_law(parameters, step)
    for pin in pins(mechanism):
        if pin.name == "A" and parameters.journal is not None:
            _add_contact(mbs, [nodes[CRANK], nodes[ROD2]], journal.force_user_function(pin_law, contacts))
            mbs.SetPostNewtonUserFunction(journal.post_newton_user_function(pin_law, contacts))
            continue
        multipliers += [f"reaction_{pin.name}_x", f"reaction_{pin.name}_y"]
        ends = []
        for number, point in ((pin.first, pin.first_point), (pin.second, pin.second_point)):
            body = ground if number == FRAME else bodies[number]
            ends.append(mbs.AddMarker(MarkerBodyPosition(bodyNumber=body, localPosition=[*point, 0.0])))
        mbs.AddObject(ObjectJointRevolute2D(name=pin.name, markerNumbers=ends))

    fixed = mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=ground_node, coordinate=0))
    crank_angle = mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=nodes[CRANK], coordinate=2))
    mbs.AddObject(
        CoordinateConstraint(
            markerNumbers=[fixed, crank_angle], offset=parameters.drive.omega, velocityLevel=True
        )
    )

    multipliers.append("crank_torque")

    read_corners = None
    law = contact_law(parameters.contact, mechanism.slider, step)
    if mechanism.ideal_slider:
        multipliers += ["guide_force", "guide_moment"]
        for coordinate, value in ((0, mechanism.reference_offset), (2, 0.0)):
            marker = mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=nodes[SLIDER], coordinate=coordinate))
            mbs.AddObject(CoordinateConstraint(markerNumbers=[fixed, marker], offset=value))
    elif parameters.integration.formulation == "native":
        x, _, angle = state.positions[SLIDER]
        place, speeds = (x - mechanism.guide_x, angle), state.velocities[SLIDER]
        gaps, rates = np.array(
            [corner_motion(k, *place, speeds[0], speeds[1], speeds[2], law[0])[:2] for k in range(4)]
        ).T
        read_corners = add_corner_contacts(mbs, ground, bodies[SLIDER], parameters, gaps, rates)
    else:
        _add_contact(mbs, [nodes[SLIDER]], force_user_function(law, contacts))
    mbs.Assemble()
    return Model(
        mbs, container, linkage_record(parameters), law, pin_law, contacts, tuple(multipliers), read_corners
    )


def _add_contact(mbs: Any, nodes: list[Any], force: ForceUserFunction) -> None:
    """Add an object without mass on the bodies' nodes, which only adds the contact force."""
    size = 3 * len(nodes)
    mbs.AddObject(
        ObjectGenericODE2(nodeNumbers=nodes, massMatrix=np.zeros((size, size)), forceUserFunction=force)
    )
