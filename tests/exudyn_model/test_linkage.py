"""The closed form of the linkage: start, branches, motion of the rocker's tip, refusals."""

import math

import numpy as np
import pytest

from exudyn_model.linkage import assemble, carried_tip, driven_tip, linkage_array
from exudyn_model.parameters import read_scene

# B lies to the left of the line from A to the pivot, or to the right: then the tip is on the other side
BRANCHES = [(1, -1), (1, 1), (-1, -1), (-1, 1)]


def start(make_scene, time, rocker, slider, rpm=150.0):
    """Parameters and initial state of a press that starts where one at 37 degrees is at ``time`` (s)."""
    right = {} if rocker > 0 else {"mechanism.guide_x": 0.18, "mechanism.reference_offset": 0.0}
    moved = {
        "mechanism.rocker_branch": rocker, "mechanism.slider_branch": slider, "drive.speed_rpm": rpm,
        "mechanism.crank_angle_deg": 37.0 + 6.0 * rpm * time,
        "initial.slider_offset": 5e-5 + 0.03 * time, "initial.slider_vx": 0.03,
        "initial.slider_angle": 0.002 - 0.8 * time, "initial.slider_omega": -0.8,
    }  # fmt: skip
    parameters = read_scene(make_scene(right, moved))
    return parameters, assemble(parameters)


@pytest.mark.parametrize("branches", BRANCHES)
@pytest.mark.parametrize("rpm", [150.0, -90.0])
def test_velocities_are_the_derivative_of_positions_on_the_branches_asked_for(make_scene, branches, rpm):
    dt = 1e-6
    states = {t: start(make_scene, t, *branches, rpm)[1] for t in (-dt, 0.0, dt)}
    difference = (states[dt].positions - states[-dt].positions) / (2 * dt)
    # Round-off of the positions (1e-16 m) over the interval (2e-6 s); dt^2 times third derivatives near 1e4
    np.testing.assert_allclose(states[0.0].velocities, difference, atol=1e-8)
    bodies = states[0.0].positions
    tip = 2 * bodies[0, :2]
    pivot, b = np.array([0.2568, 0.2]) - tip, bodies[2, :2] - tip
    assert math.copysign(1, pivot[0] * b[1] - pivot[1] * b[0]) == branches[0]
    assert math.copysign(1, bodies[4, 1] - bodies[3, 1]) == branches[1]


@pytest.mark.parametrize("rocker", [1, -1])
def test_the_rocker_s_tip_moves_as_the_assembled_linkage(make_scene, rocker):
    parameters, _ = start(make_scene, 0.0, rocker, -1)
    linkage, dt, at = linkage_array(parameters.mechanism), 1e-5, 0.017
    # In plain Python: these kernels are compiled into others alone
    driven = driven_tip.py_func.__globals__ | {"carried_tip": carried_tip.py_func}
    tip = type(driven_tip.py_func)(driven_tip.py_func.__code__, driven)(at, linkage)
    places = []
    for time in (at - dt, at, at + dt):
        bodies = start(make_scene, time, rocker, -1)[1].positions
        u3 = np.array([math.cos(bodies[2, 2]), math.sin(bodies[2, 2])])
        places.append(bodies[2, :2] + parameters.mechanism.rocker.to_tip * u3)
    before, here, after = places
    np.testing.assert_allclose(tip[:2], here, atol=1e-14)
    # Third and fourth derivatives of up to 1e4 and 1e6 times dt^2; places round at 1e-16 m
    np.testing.assert_allclose(tip[2:4], (after - before) / (2 * dt), atol=1e-6)
    np.testing.assert_allclose(tip[4:], (after - 2 * here + before) / dt**2, atol=1e-4)


def test_identified_geometry_meets_the_published_kinematics(make_scene):
    degrees = np.arange(0, 360, 0.5)
    ideal = {"joints.slider": "ideal"}
    scenes = [make_scene(ideal | {"mechanism.crank_angle_deg": float(angle)}) for angle in degrees]
    y = np.array([assemble(read_scene(scene)).positions[4, 1] for scene in scenes])
    # Published figures with their printed digits: top dead centre 111.36 deg, stroke 0.224 m
    top = int(np.argmax(y))
    bend = np.polyfit(degrees[top - 1 : top + 2], y[top - 1 : top + 2], 2)
    assert -bend[1] / (2 * bend[0]) == pytest.approx(111.355, abs=0.006)
    assert np.ptp(y) == pytest.approx(0.2239, abs=5e-5)


CANNOT = [
    # Closes at the start, but not where the crank points away from the pivot; rod 4 always reaches
    ({"mechanism.crank.length": 0.25, "mechanism.rod4.length": 2.0}, "crank, rod 2 and rocker"),
    ({"mechanism.rod2.length": 0.05}, "crank, rod 2 and rocker"),  # closes nowhere
    ({"mechanism.rod4.length": 0.04}, "rod 4 and slider"),  # reaches the guide only in part of the cycle
    ({"mechanism.guide_x": -2.0}, "rod 4 and slider"),
]


@pytest.mark.parametrize(("changes", "parts"), CANNOT)
def test_what_cannot_be_assembled_is_refused_in_one_line(make_scene, changes, parts):
    with pytest.raises(ValueError, match=f"{parts} cannot be assembled at a crank angle of") as caught:
        assemble(read_scene(make_scene(changes)))
    assert "\n" not in str(caught.value)
