"""The press in Exudyn: five rigid bodies, six revolute joints, drive, gravity, contacts."""

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

from exudyn_model.assembly import InitialState
from exudyn_model.bodies import ANGLE, CRANK, FRAME, PER_BODY, ROD2, SLIDER, X, pins
from exudyn_model.compiled import ForceUserFunction
from exudyn_model.constants import scene_constants
from exudyn_model.contact import journal
from exudyn_model.contact.corners import force_user_function
from exudyn_model.contact.gaps import corner_motion
from exudyn_model.contact.states import CORNERS, contact_states
from exudyn_model.five_bodies.native_contact import add_corner_contacts
from exudyn_model.model import Model
from exudyn_model.parameters import Parameters, Rod, Slider


def build(parameters: Parameters, state: InitialState, step: float) -> Model:
    """Build the mechanism at ``state``, for integration with ``step`` (s) in contacts.

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
    contacts, after_newton = contact_states(), None
    constants = scene_constants(parameters, step)
    law, pin_law = constants.law, constants.pin_law
    for pin in pins(mechanism):
        if pin.name == "A" and parameters.journal is not None:
            _add_contact(mbs, [nodes[CRANK], nodes[ROD2]], journal.force_user_function(pin_law, contacts))
            after_newton = journal.post_newton_user_function(pin_law, contacts)
            continue
        multipliers += [f"reaction_{pin.name}_x", f"reaction_{pin.name}_y"]
        ends = []
        for number, point in ((pin.first, pin.first_point), (pin.second, pin.second_point)):
            body = ground if number == FRAME else bodies[number]
            ends.append(mbs.AddMarker(MarkerBodyPosition(bodyNumber=body, localPosition=[*point, 0.0])))
        mbs.AddObject(ObjectJointRevolute2D(name=pin.name, markerNumbers=ends))

    fixed = mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=ground_node, coordinate=0))
    crank_angle = mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=nodes[CRANK], coordinate=ANGLE))
    mbs.AddObject(
        CoordinateConstraint(
            markerNumbers=[fixed, crank_angle], offset=parameters.drive.omega, velocityLevel=True
        )
    )
    multipliers.append("crank_torque")
    read_corners = None
    if mechanism.ideal_slider:
        multipliers += ["guide_force", "guide_moment"]
        for coordinate, value in ((X, mechanism.reference_offset), (ANGLE, 0.0)):
            marker = mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=nodes[SLIDER], coordinate=coordinate))
            mbs.AddObject(CoordinateConstraint(markerNumbers=[fixed, marker], offset=value))
    elif parameters.integration.formulation == "native":
        x, _, angle = state.positions[SLIDER]
        vx, vy, omega = state.velocities[SLIDER]
        motions = [
            corner_motion(number, x - mechanism.guide_x, angle, vx, vy, omega, law[0])
            for number in range(len(CORNERS))
        ]
        read_corners = add_corner_contacts(mbs, ground, bodies[SLIDER], parameters, motions)
    else:
        _add_contact(mbs, [nodes[SLIDER]], force_user_function(law, contacts))
    mbs.Assemble()
    return Model(mbs, container, constants, contacts, tuple(multipliers), read_corners, after_newton)


def _add_contact(mbs: Any, nodes: list[Any], force: ForceUserFunction) -> None:
    """Add an object without mass on the bodies' nodes, which only adds the contact force."""
    size = PER_BODY * len(nodes)
    mbs.AddObject(
        ObjectGenericODE2(nodeNumbers=nodes, massMatrix=np.zeros((size, size)), forceUserFunction=force)
    )
