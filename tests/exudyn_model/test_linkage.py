"""The driven four-bar in closed form: the rocker's tip."""

import math

import numpy as np
import pytest

from exudyn_model.assembly import place
from exudyn_model.constants import linkage_record
from exudyn_model.linkage import rocker_tip, tip_jerk
from exudyn_model.reading import read_scene


@pytest.mark.parametrize("branch", [1, -1])
@pytest.mark.parametrize("speed_rpm", [150.0, -90.0])
def test_rocker_tip_and_its_derivatives(make_scene, branch, speed_rpm):
    changes = {
        "mechanism.rocker_branch": branch,
        "mechanism.guide_x": -0.55 if branch == 1 else 0.18,
        "drive.speed_rpm": speed_rpm,
    }
    parameters = read_scene(make_scene(changes))
    mechanism, drive = parameters.mechanism, parameters.drive
    linkage = linkage_record(parameters)[0]
    dt = 1e-5
    for time in np.linspace(0, 60 / abs(speed_rpm), 7):
        rocker = place(mechanism, mechanism.crank_angle + drive.omega * time, mechanism.guide_x, 0.0)[2]
        tip = rocker[:2] + mechanism.rocker.to_tip * np.array([math.cos(rocker[2]), math.sin(rocker[2])])
        x, y, vx, vy, ax, ay = rocker_tip(time, linkage)
        np.testing.assert_allclose([x, y], tip, atol=1e-15)
        before, after = (np.array(rocker_tip(time + s * dt, linkage)) for s in (-1, 1))
        # dt^2 / 6 times third derivatives near 1e4; round-off 1e-16 / dt
        np.testing.assert_allclose([vx, vy], (after - before)[:2] / (2 * dt), atol=1e-6)
        np.testing.assert_allclose([ax, ay], (after - before)[2:4] / (2 * dt), atol=1e-5)


def test_the_jerk_of_the_rockers_tip_is_bounded(make_scene):
    parameters = read_scene(make_scene({"drive.speed_rpm": -300.0}))
    linkage = linkage_record(parameters)[0]
    times = np.linspace(0.0, parameters.drive.period, 20_001)
    found = np.diff([rocker_tip(time, linkage).ax for time in times]) / times[1]
    assert np.max(abs(found)) <= tip_jerk(linkage) < 1.1 * np.max(abs(found))
