"""The ideal mechanism of a scene, by both models."""

from __future__ import annotations

import numpy as np
import pytest

from comparison.execution.run import run_key, run_one
from comparison.reliability.assessment import assess
from comparison.reliability.errors import QUANTITIES, slider_errors
from comparison.reliability.ideal import dense_scene, ideal_scenes
from comparison.scene import load_scene


@pytest.mark.parametrize("model", ["reference", "exudyn"])
def test_scenes_that_differ_in_their_clearance_only_share_one_ideal_mechanism(model):
    keys = {
        name: run_key(ideal_scenes(load_scene(name), model)["base"], model, "")
        for name in ("150rpm-0.2mm", "69GPa", "poisson-0.33", "90rpm-0.1mm", "90rpm-0.5mm", "300rpm-0.2mm")
    }
    assert len(set(keys.values())) == 3  # one a speed
    longer = load_scene("150rpm-0.2mm", {"mechanism.rod4.length": 0.25})
    assert run_key(ideal_scenes(longer, model)["base"], model, "") not in keys.values()


def test_its_time_and_samples_are_the_scenes():
    scene = load_scene("crank-pin", {"output.samples_per_cycle": 300})
    levels = ideal_scenes(scene, "exudyn")
    ideal = levels["base"]
    assert ideal.duration == pytest.approx(scene.duration, rel=1e-14)
    assert ideal.period == scene.period
    # The coarser run's step would not fit between dense samples
    samples = {kind: of.data["output"]["samples_per_cycle"] for kind, of in levels.items()}
    assert samples == {"base": 10_200, "coarser": 300}
    assert ideal.data["joints"] == {"slider": "ideal", "crank_pin": "ideal"}
    assert ideal.data["mechanism"] == scene.data["mechanism"]


def test_both_models_have_the_same_ideal_mechanism_and_the_ideal_scene_no_error():
    scene = load_scene("ideal", {"drive.cycles": 0.5})
    levels = ideal_scenes(scene, "exudyn")
    exact = run_one(ideal_scenes(scene, "reference")["base"], "reference")
    fine, coarse = (run_one(levels[kind], "exudyn") for kind in ("base", "coarser"))
    # As `STEPS` says, with room for round-off and other machines.
    bounds = {"slider_y": 1e-11, "slider_vy": 1.5e-7, "slider_ay": 1e-6}
    for channel, most in bounds.items():
        assert np.abs(fine.values(channel) - exact.values(channel)).max() < most
    # Of second order: a quarter of the coarser run's error is the finer one's.
    every = (exact.time.size - 1) // (coarse.time.size - 1)
    right = exact.values("slider_vy")[::every]
    size = [np.abs(v - right).max() for v in (coarse.values("slider_vy"), fine.values("slider_vy")[::every])]
    assert size[0] / size[1] == pytest.approx(4.0, rel=0.05)
    found = assess(slider_errors(fine, exact, scene.period), scene.reliability)
    assert list(found) == list(QUANTITIES)
    for quantity in found.values():
        # 1e-7 m/s of 0.02 m/s are 3e-5 of beta, 1.3e-7 of R = Phi(beta) there.
        assert quantity.reliability == pytest.approx(np.full(5, 0.9986501020), abs=2e-7)
        assert quantity.capped.all()


def test_a_dense_scene_has_a_whole_multiple_of_samples_and_no_forces_at_corners():
    scene = load_scene("150rpm-0.2mm")
    for own, most in ((1000, 10_000), (300, 10_200), (333, 10_323), (30_000, 30_000), (10_000, 10_000)):
        dense = dense_scene(scene.with_values({"output.samples_per_cycle": own}))
        assert dense.data["output"] == {"samples_per_cycle": most, "groups": ["accelerations"]}
    # Joints and energies decide which of Exudyn's integrators runs.
    asked = scene.with_values({"output.groups": ["corners", "energy"]})
    assert dense_scene(asked).data["output"]["groups"] == ["accelerations", "energy"]
    # A long run does not become too large to be stored.
    long = dense_scene(scene.with_values({"drive.cycles": 100.0}))
    assert long.data["output"]["samples_per_cycle"] == 4000
    assert dense_scene(dense_scene(scene)).hash == dense_scene(scene).hash
