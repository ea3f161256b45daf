"""Scales of the channels: what a difference is measured by."""

from __future__ import annotations

import numpy as np
import pytest

from comparison.execution.run import run_one
from comparison.scene import Scene, load_scene
from comparison.tables.channels import channels

PIN_CLEARANCE = {"joints.slider": "ideal", "joints.crank_pin": "clearance"}
C_SLIDER, C_PIN = 3e-4, 2e-4  # m
SIZES = {"clearance.slider": C_SLIDER, "clearance.crank_pin": C_PIN}


def scale(name: str, scene: Scene) -> float:
    return channels()[name].scale_value(scene.data, extent=7.0)


@pytest.mark.parametrize(
    ("joints", "x", "y"),
    [
        ({}, C_SLIDER, 0.2093 * C_SLIDER),
        (PIN_CLEARANCE, C_PIN, C_PIN),
        ({"joints.crank_pin": "clearance"}, C_SLIDER, 0.2093 * C_SLIDER),
    ],
)
def test_a_position_is_measured_by_the_clearance_that_moves_it(joints, x, y):
    scene = load_scene("paper", SIZES | joints)
    hundredth = 0.004  # s, of a cycle at 150 rpm
    # Products and quotients of a few numbers: some units of the last place.
    exact = {"rel": 1e-14, "abs": 0.0}
    assert scale("slider_x", scene) == pytest.approx(x, **exact)
    assert scale("slider_y", scene) == pytest.approx(y, **exact)
    assert scale("slider_angle", scene) == pytest.approx(x / 0.07, **exact)
    assert scale("slider_vy", scene) == pytest.approx(y / hundredth, **exact)
    assert scale("slider_ay", scene) == 7.0  # accelerations by their range
    assert scale("journal_x", scene) == scale("journal_y", scene) == C_PIN


def test_without_the_clearance_in_question_the_scale_is_the_range():
    scene = load_scene("paper", PIN_CLEARANCE).data
    scene["clearance"]["slider"] = 0.0
    assert channels()["slider_y"].scale_value(scene, 7.0) == scene["clearance"]["crank_pin"]
    scene["clearance"]["crank_pin"] = 0.0
    assert channels()["slider_y"].scale_value(scene, 7.0) == 7.0


def test_a_shift_of_the_crank_pin_moves_the_slider_by_up_to_three_times_as_much():
    """The reach behind the scale: a shift along the crank lengthens it, one across turns it."""

    def y(changes: dict[str, object]) -> np.ndarray:
        values = {"drive.cycles": 1.0, "output.groups": []} | changes
        return run_one(load_scene("ideal", values), "reference").values("slider_y")

    crank = load_scene("ideal").data["mechanism"]
    length, angle = crank["crank"]["length"], crank["crank_angle_deg"]
    shift = 1e-6  # m: curvature adds shift / length = 2e-5 of the result
    along = (y({"mechanism.crank.length": length + shift}) - y({})) / shift
    across = (y({"mechanism.crank_angle_deg": angle + np.degrees(shift / length)}) - y({})) / shift
    reach = np.hypot(along, across)
    # 5.67e-4 m of 2e-4 m with three digits; samples every 0.36 degrees miss the top by less than 1e-5 of it.
    assert reach.max() == pytest.approx(2.83, abs=0.01)
    scene = load_scene("paper", PIN_CLEARANCE)
    assert 1 < reach.max() * scene.data["clearance"]["crank_pin"] / scale("slider_y", scene) < 3
