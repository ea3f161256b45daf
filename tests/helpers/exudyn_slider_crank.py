"""A slider-crank as Exudyn's own examples build and observe one, and its closed form."""

from __future__ import annotations

from pathlib import Path

import exudyn as exu
import numpy as np
from exudyn.itemInterface import (
    CoordinateConstraint,
    MarkerBodyPosition,
    MarkerNodeCoordinate,
    NodePointGround,
    NodeRigidBody2D,
    ObjectGround,
    ObjectJointRevolute2D,
    ObjectRigidBody2D,
    SensorNode,
)

CRANK, ROD, OMEGA = 0.1, 0.4, 2 * np.pi
"""Lengths in m, rad/s: a revolution takes 1 s. The crank starts along the guide, the x axis."""
SAMPLES = 200


def closed_form(time: np.ndarray) -> np.ndarray:
    """Return position and velocity of the slider along the guide, shape (n, 2)."""
    sine, cosine = np.sin(OMEGA * time), np.cos(OMEGA * time)
    along = np.sqrt(ROD**2 - (CRANK * sine) ** 2)
    return np.column_stack([CRANK * cosine + along, -CRANK * OMEGA * sine * (1 + CRANK * cosine / along)])


def simulate(step: float, folder: Path, rod: float = ROD) -> None:
    """Run one revolution; Exudyn writes ``position.txt`` and ``velocity.txt`` of the slider."""
    container = exu.SystemContainer()
    mbs = container.AddSystem()
    turning, reach = CRANK * OMEGA, CRANK + rod
    # Position and velocity of the centre of crank, rod and slider, length of each to either side of it.
    bodies = [
        ([CRANK / 2, 0, 0], [0, turning / 2, OMEGA], CRANK / 2),
        ([CRANK + rod / 2, 0, 0], [0, turning / 2, -turning / rod], rod / 2),
        ([reach, 0, 0], [0, 0, 0], 0.0),
    ]
    nodes, ends = [], [mbs.AddMarker(MarkerBodyPosition(bodyNumber=mbs.AddObject(ObjectGround())))]
    for place, velocity, half in bodies:
        nodes.append(mbs.AddNode(NodeRigidBody2D(referenceCoordinates=place, initialVelocities=velocity)))
        body = mbs.AddObject(ObjectRigidBody2D(mass=1.0, inertia=1e-3, nodeNumber=nodes[-1]))
        ends += [
            mbs.AddMarker(MarkerBodyPosition(bodyNumber=body, localPosition=[x, 0, 0])) for x in (-half, half)
        ]
    for joint in range(3):
        mbs.AddObject(ObjectJointRevolute2D(markerNumbers=ends[2 * joint : 2 * joint + 2]))
    ground = mbs.AddNode(NodePointGround())
    fixed = mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=ground, coordinate=0))
    for node, coordinate, speed in ((nodes[0], 2, OMEGA), (nodes[2], 1, 0.0), (nodes[2], 2, 0.0)):
        marker = mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=node, coordinate=coordinate))
        mbs.AddObject(CoordinateConstraint(markerNumbers=[fixed, marker], offset=speed, velocityLevel=True))
    for name, variable in (
        ("position", exu.OutputVariableType.Position),
        ("velocity", exu.OutputVariableType.Velocity),
    ):
        mbs.AddSensor(
            SensorNode(nodeNumber=nodes[2], fileName=str(folder / f"{name}.txt"), outputVariableType=variable)
        )
    mbs.Assemble()
    settings = exu.SimulationSettings()
    settings.timeIntegration.endTime = 1.0
    settings.timeIntegration.numberOfSteps = round(1.0 / step)
    settings.timeIntegration.verboseMode = 0
    settings.timeIntegration.generalizedAlpha.spectralRadius = 0.9
    settings.solution.sensors.writePeriod = 1.0 / SAMPLES
    settings.solution.file.write = False
    settings.solution.precision = 16
    assert mbs.SolveDynamic(settings)
