"""The slider's accelerations by balance of forces, against all 15 equations of motion."""

import math

import numpy as np
import pytest

from exudyn_model import simulate
from exudyn_model.accelerations import Forces
from exudyn_model.assembly import assemble
from exudyn_model.constants import linkage_record
from exudyn_model.free_rocker import slider_acceleration_with_pin_clearance
from exudyn_model.reading import read_scene

CRANK_PIN = {"joints.crank_pin": "clearance", "joints.slider": "ideal"}
BOTH = {"joints.crank_pin": "clearance"}


@pytest.mark.parametrize("crank_angle_deg", [111.36, 20.0, 250.0])
@pytest.mark.parametrize(
    "initial",
    [
        {"initial.slider_offset": 0.0},
        {
            "initial.slider_offset": 2.02e-4,
            "initial.slider_omega": -2.0,
            "initial.slider_angle": 5e-5,
            "initial.slider_vx": 0.02,
        },
        {"initial.slider_offset": 2e-5, "initial.slider_angle": 6e-3, "initial.slider_vx": -0.1},
    ],
)
def test_recorded_accelerations_satisfy_the_full_equations_of_motion(
    make_scene, slider_accelerations, crank_angle_deg, initial
):
    scene = make_scene(initial | {"mechanism.crank_angle_deg": crank_angle_deg, "drive.cycles": 0.001})
    columns = {name: values[0] for name, values in simulate(scene).columns.items()}
    force = np.zeros(3)
    angle = scene["initial"]["slider_angle"]
    for corner in ("ll", "lr", "ul", "ur"):
        sx, sy = (0.025 if corner[1] == "r" else -0.025), (0.035 if corner[0] == "u" else -0.035)
        rx, ry = (
            math.cos(angle) * sx - math.sin(angle) * sy,
            math.sin(angle) * sx + math.cos(angle) * sy,
        )
        fx = columns[f"corner_{corner}_normal"] * (-1 if corner[1] == "r" else 1)
        fy = columns[f"corner_{corner}_friction"]
        force += [fx, fy, rx * fy - ry * fx]
    parameters = read_scene(scene)
    start = assemble(parameters)
    q, v = start.positions.ravel(), start.velocities.ravel()
    expected = slider_accelerations(parameters, q, v, force)
    actual = [columns[name] for name in ("slider_ax", "slider_ay", "slider_alpha")]
    # Round-off of a 28 x 28 system with masses down to 1e-5 kg m^2
    np.testing.assert_allclose(actual, expected, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("joints", [CRANK_PIN, BOTH])
def test_accelerations_with_pin_clearance_satisfy_the_full_equations_of_motion(
    make_scene, slider_accelerations, joints
):
    parameters = read_scene(make_scene(joints))
    linkage, random = linkage_record(parameters)[0], np.random.default_rng(11)
    for _ in range(20):
        # Angles and their rates alone enter
        q, v = random.uniform(0, 6, 15), random.normal(0, 10, 15)
        pin_force, force = random.normal(0, 100, 3), random.normal(0, 30, 3)
        if parameters.mechanism.ideal_slider:
            force[:] = 0.0
        found = slider_acceleration_with_pin_clearance(q, v, Forces(*force, *pin_force), linkage)
        expected = slider_accelerations(parameters, q, v, force, pin_force)
        # Round-off of two systems with masses down to 1e-5 kg m^2
        np.testing.assert_allclose(found, expected, rtol=1e-8, atol=1e-8 * np.max(np.abs(expected)))
