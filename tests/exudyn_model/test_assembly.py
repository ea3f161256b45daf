"""Loop closure and initial velocities, against geometry and differences of positions."""

import math

import numpy as np
import pytest

from exudyn_model.assembly import assemble, place
from exudyn_model.reading import read_scene

BRANCHES = [(rocker, slider) for rocker in (1, -1) for slider in (1, -1)]


def with_branches(rocker, slider):
    # With joint B on the other side the rocker's tip swings between x = 0.07 and 0.29 m: the guide goes there
    return {
        "mechanism.rocker_branch": rocker,
        "mechanism.slider_branch": slider,
        "mechanism.guide_x": -0.55 if rocker == 1 else 0.18,
    }


@pytest.mark.parametrize(("rocker", "slider"), BRANCHES)
def test_branches_select_the_side_of_joint_b_and_the_direction_of_rod_4(make_scene, rocker, slider):
    mechanism = read_scene(make_scene(with_branches(rocker, slider))).mechanism
    bodies = place(mechanism, mechanism.crank_angle, mechanism.guide_x, 0.0)
    crank_tip = 2 * bodies[0, :2]
    towards_pivot = np.subtract(mechanism.rocker_pivot, crank_tip)
    towards_b = bodies[2, :2] - crank_tip
    side = towards_pivot[0] * towards_b[1] - towards_pivot[1] * towards_b[0]
    assert math.copysign(1, side) == rocker
    assert math.copysign(1, bodies[4, 1] - bodies[3, 1]) == slider


@pytest.mark.parametrize(("rocker", "slider"), BRANCHES)
@pytest.mark.parametrize("speed_rpm", [150.0, -90.0])
def test_velocities_are_the_derivative_of_the_positions(make_scene, rocker, slider, speed_rpm):
    changes = with_branches(rocker, slider) | {
        "drive.speed_rpm": speed_rpm,
        "mechanism.crank_angle_deg": 37.0,
        "initial.slider_vx": 0.03,
        "initial.slider_omega": -0.8,
        "initial.slider_angle": 0.002,
    }
    parameters = read_scene(make_scene(changes))
    mechanism, drive = parameters.mechanism, parameters.drive
    state = assemble(parameters)
    dt = 1e-6

    def positions(t):
        return place(
            mechanism,
            mechanism.crank_angle + drive.omega * t,
            mechanism.guide_x + parameters.initial.offset + 0.03 * t,
            0.002 - 0.8 * t,
        )

    difference = (positions(dt) - positions(-dt)) / (2 * dt)
    # Round-off of the positions (1e-16 m) over the interval (2e-6 s); dt^2 times third derivatives near 1e4
    np.testing.assert_allclose(state.velocities, difference, atol=1e-8)


def test_identified_geometry_meets_the_published_kinematics(make_scene):
    mechanism = read_scene(make_scene({})).mechanism
    degrees = np.arange(0, 360, 0.005)
    line = mechanism.guide_x + mechanism.reference_offset
    y = np.array([place(mechanism, math.radians(a), line, 0.0)[4, 1] for a in degrees])
    # Published figures with their printed digits: top dead centre 111.36 deg, stroke 0.224 m
    assert degrees[np.argmax(y)] == pytest.approx(111.355, abs=0.006)
    assert np.ptp(y) == pytest.approx(0.2239, abs=5e-5)


@pytest.mark.parametrize(
    ("changes", "parts"),
    [
        # Closes at the start, but not where the crank points away from the pivot; rod 4 always reaches
        ({"mechanism.crank.length": 0.25, "mechanism.rod4.length": 2.0}, "crank, rod 2 and rocker"),
        ({"mechanism.rod2.length": 0.05}, "crank, rod 2 and rocker"),  # closes nowhere
        ({"mechanism.rod4.length": 0.04}, "rod 4 and slider"),  # reaches the guide only in part of the cycle
        ({"mechanism.guide_x": -2.0}, "rod 4 and slider"),
    ],
)
def test_what_cannot_be_assembled_is_refused_in_one_line(make_scene, changes, parts):
    with pytest.raises(ValueError, match=f"{parts} cannot be assembled at a crank angle of") as caught:
        assemble(read_scene(make_scene(changes)))
    assert "\n" not in str(caught.value)
