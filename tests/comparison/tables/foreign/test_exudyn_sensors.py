"""Sensor files that Exudyn itself writes, of a body that turns about a pin."""

import json

import exudyn as exu
import numpy as np
import pytest
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
from foreign_tables import put

from comparison.cli import main

RADIUS, OMEGA = 0.1, 2 * np.pi


def simulate(radius):
    """Run one revolution of 1 s; Exudyn writes ``Position.txt`` and ``Velocity.txt`` of the centre."""
    container = exu.SystemContainer()
    mbs = container.AddSystem()
    turning = {"referenceCoordinates": [radius, 0, 0], "initialVelocities": [0, radius * OMEGA, OMEGA]}
    node = mbs.AddNode(NodeRigidBody2D(**turning))
    body = mbs.AddObject(ObjectRigidBody2D(mass=1.0, inertia=1e-3, nodeNumber=node))
    pin = [
        mbs.AddMarker(MarkerBodyPosition(bodyNumber=mbs.AddObject(ObjectGround()))),
        mbs.AddMarker(MarkerBodyPosition(bodyNumber=body, localPosition=[-radius, 0, 0])),
    ]
    mbs.AddObject(ObjectJointRevolute2D(markerNumbers=pin))
    ground = mbs.AddNode(NodePointGround())
    angles = [
        mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=of, coordinate=coordinate))
        for of, coordinate in ((ground, 0), (node, 2))
    ]
    mbs.AddObject(CoordinateConstraint(markerNumbers=angles, offset=OMEGA, velocityLevel=True))
    for name in ("Position", "Velocity"):
        variable = getattr(exu.OutputVariableType, name)
        mbs.AddSensor(SensorNode(nodeNumber=node, fileName=f"{name}.txt", outputVariableType=variable))
    mbs.Assemble()
    settings = exu.SimulationSettings()
    settings.timeIntegration.endTime = 1.0
    settings.timeIntegration.numberOfSteps = 1000
    settings.timeIntegration.verboseMode = 0
    settings.solution.sensors.writePeriod = 1 / 200
    settings.solution.file.write = False
    settings.solution.precision = 16
    assert mbs.SolveDynamic(settings)


@pytest.mark.parametrize(("longer", "verdict"), [(0.0, "agree"), (1e-4, "differ")])
def test_sensors_agree_with_the_closed_form_and_a_longer_body_differs(longer, verdict, capsys):
    simulate(RADIUS + longer)
    time = np.loadtxt("Position.txt", delimiter=",")[:, 0]
    exact = RADIUS * np.cos(OMEGA * time), -RADIUS * OMEGA * np.sin(OMEGA * time)
    head = {"header": "time,Position,Velocity", "comments": ""}
    np.savetxt("exact.csv", np.column_stack([time, *exact]), "%.17g", ",", **head)
    # Every step fulfils the constraints of positions: 5e-15 m of 0.2 m measured, round-off.
    # Velocities follow at second order: 2.1e-6 of 1.3 m/s measured.
    for quantity, tolerance in (("Position", "1e-12"), ("Velocity", "1e-5")):
        rules = (f'[{side}]\nchannel = "centre"\n' for side in ('a."#2"', f"b.{quantity}"))
        put("map.toml", 'compare = ["centre"]\n[channels.centre]\n' + "".join(rules))
        command = ["compare", f"{quantity}.txt", "exact.csv", "--mapping", "map.toml", "--json"]
        assert main([*command, "--tolerance", tolerance]) == (verdict == "differ")
        assert json.loads(capsys.readouterr().out)["channels"]["centre"]["verdict"] == verdict
