"""The ideal mechanism: published facts, and the press whose rocker turns with its crank, a slider-crank."""

import numpy as np
import pytest
from slider_crank import CHANGES, closed_form

import exudyn_model
import reference_model
from comparison.scene import load_scene

EXACT = {"slider_y": 1e-14, "slider_vy": 1e-13, "slider_ay": 1e-11, "crank_torque": 1e-12}
"""Round-off of a formula, some hundred times 1e-16 of 0.2 m, 7 m/s, 400 m/s^2 and 14 N m."""
STEPPED = {"slider_y": 1e-9, "slider_vy": 1e-8, "slider_ay": 1e-6, "crank_torque": 4e-7}
"""Two to ten times the largest errors of Exudyn's steps of 4e-6 s and Newton's tolerance of 1e-7, measured at
300 rpm over a cycle: 4.6e-10 m, 3.7e-9 m/s, 2.3e-7 m/s^2, 3.5e-8 N m."""


def test_published_stroke_top_dead_centre_and_speeds():
    scene = load_scene("ideal", {"drive.cycles": 1.0, "output.samples_per_cycle": 40_000}).data
    y, vy, ay = (reference_model.simulate(scene).columns[f"slider_{name}"] for name in ("y", "vy", "ay"))
    # The published figures with the precision of their last digit and of the identified geometry.
    assert np.ptp(y) == pytest.approx(0.2239, abs=1e-4)
    assert vy.min() == pytest.approx(-1.598, abs=1e-3)
    assert vy.max() == pytest.approx(2.002, abs=1e-3)
    turned = np.degrees(scene["drive"]["speed_rpm"] * np.pi / 30 * vy[0] / ay[0])
    assert scene["mechanism"]["crank_angle_deg"] - turned == pytest.approx(111.355, abs=5e-3)


@pytest.mark.parametrize(
    ("model", "bounds"),
    [(reference_model, EXACT), (exudyn_model, STEPPED)],
    ids=["reference", "exudyn"],
)
@pytest.mark.parametrize("speed", [150.0, -300.0])
def test_slider_crank_follows_its_closed_form(model, bounds, speed):
    own = {"drive.speed_rpm": speed, "drive.cycles": 0.3, "output.samples_per_cycle": 100}
    scene = load_scene("ideal", CHANGES | own | {"solver.exudyn.step": 4e-6}).data
    result = model.simulate(scene)
    assert result.status == "success", result.remedy
    for name, exact in closed_form(scene, result.columns["time"]).items():
        assert np.abs(result.columns[name] - exact).max() < bounds[name], name
