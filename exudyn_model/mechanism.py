"""The press in Exudyn: five rigid bodies, six revolute joints, drive, gravity and the slider's contact."""

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

from exudyn_model.assembly import CRANK, FRAME, SLIDER, InitialState, pins
from exudyn_model.contact import contact_law, corner_states, force_user_function
from exudyn_model.parameters import Parameters, Rod, Slider


@dataclass(frozen=True)
class Model:
    """An assembled Exudyn system with the memory that its contact force reads.

    Attributes
    ----------
    mbs : exudyn.MainSystem
        Coordinates: x, y, angle of bodies 1 to 5; the slider's x counts from the guide's centre line.
    container : exudyn.SystemContainer
        Owner of ``mbs``; held so that it outlives it.
    law, corners : ndarray
        See ``contact``.
    """

    mbs: Any
    container: Any
    law: NDArray[np.void]
    corners: NDArray[np.void]


def build(parameters: Parameters, state: InitialState, step: float) -> Model:
    """Build the mechanism at ``state``, for integration with a fixed ``step`` (s)."""
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

    for pin in pins(mechanism):
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

    law = contact_law(parameters.contact, mechanism.slider, step)
    corners = corner_states()
    if mechanism.ideal_slider:
        for coordinate, value in ((0, mechanism.reference_offset), (2, 0.0)):
            marker = mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=nodes[SLIDER], coordinate=coordinate))
            mbs.AddObject(CoordinateConstraint(markerNumbers=[fixed, marker], offset=value))
    else:
        # No mass of its own: a second object on the slider's node that only adds the contact force
        mbs.AddObject(
            ObjectGenericODE2(
                nodeNumbers=[nodes[SLIDER]],
                massMatrix=np.zeros((3, 3)),
                forceUserFunction=force_user_function(law, corners),
            )
        )
    mbs.Assemble()
    return Model(mbs, container, law, corners)
