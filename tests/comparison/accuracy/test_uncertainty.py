"""Levels, the tight tier, windows, moved starts and observed orders (tests/judge has every number of u)."""

import numpy as np
import pandas as pd
import pytest

from comparison.accuracy.levels import coarser, finer, refinement, tight
from comparison.accuracy.uncertainty import (
    SAFETY_FACTOR,
    Runs,
    model_uncertainty,
    observed_order,
    perturbed_scenes,
)
from comparison.scene import load_scene, shipped_scenes
from comparison.tables.table import Table
from comparison.verdict.compare import compare

TREE = {"solver.exudyn.formulation": "tree"}
MODELS = ("reference", "exudyn")


@pytest.mark.parametrize(
    ("name", "changes", "model", "fine", "coarse", "factor_and_order"),
    [
        ("ideal", {}, "reference", {"tolerance": 1e-11}, {"tolerance": 1e-9}, (10.0, 1.0)),
        # Five bodies change their step, a finer level Newton's tolerance too; the tree its tolerance alone.
        ("ideal", {}, "exudyn", {"step": 4e-6, "tolerance": 1e-8}, {"step": 1.6e-5}, (2.0, 2.0)),
        ("wedge", TREE, "exudyn", {"tolerance": 1e-11}, {"tolerance": 1e-9}, (10.0, 1.0)),
    ],
)
def test_a_level_changes_what_controls_the_error_of_its_own_model(
    name, changes, model, fine, coarse, factor_and_order
):
    scene = load_scene(name, changes)
    solver = scene.data["solver"]
    for level, values in ((finer(model, scene), fine), (coarser(model, scene), coarse)):
        assert level.data["solver"] == solver | {model: solver[model] | values}
    assert refinement(model, scene) == factor_and_order


@pytest.mark.parametrize("name", shipped_scenes())
def test_at_the_tight_tier_every_joint_with_clearance_is_integrated_without_joints(name):
    scene = load_scene(name)
    solver = tight(scene, MODELS).data["solver"]
    assert solver["reference"]["tolerance"] == 1e-12
    # The tree's largest step, also where the scene gives one for five bodies
    tree = {"formulation": "tree", "step": 1e-4, "tolerance": 1e-11}
    assert solver["exudyn"] == scene.data["solver"]["exudyn"] | (tree if name != "ideal" else {})
    # Forces of joints need five bodies, and models of others have no tight settings.
    for group in ("joints", "energy"):
        forces = scene.with_values({"output.groups": [group]})
        assert tight(forces, MODELS).data["solver"]["exudyn"] == forces.data["solver"]["exudyn"]
    assert tight(scene, ("reference", "other")) is None


def test_samples_may_be_dense_in_part():
    time = np.concatenate([np.arange(0, 0.1, 1e-3), np.arange(0.1, 1.01, 1e-2)])
    base, finer = (Table(pd.DataFrame({"time": time, "slider_x": np.zeros(time.size)})) for _ in range(2))
    finer.frame.loc[50, "slider_x"] = 1.0
    times = time[model_uncertainty(Runs(base, finer), "slider_x", 1.0) >= SAFETY_FACTOR]
    # The window is a hundredth of a cycle.
    assert times[[0, -1]] == pytest.approx([time[50] - 0.01, time[50] + 0.01])


@pytest.mark.parametrize("clearance", [5e-4, 1e-9])
def test_the_perturbed_runs_start_a_billionth_of_the_clearance_away(clearance):
    changes = {"clearance.slider": clearance, "initial.slider_offset": 0.1 * clearance}
    scene = load_scene("90rpm-0.5mm", changes)
    start, length = scene.data["initial"], scene.data["mechanism"]["slider"]["length"]
    # A run's x is the guide's plus the offset: in it a billionth of nanometres would be lost.
    shift = max(1e-15, 1e-9 * clearance)
    for neighbour, sign in zip(perturbed_scenes(scene).values(), (1, -1), strict=True):
        position = {"slider_offset": start["slider_offset"] + shift, "slider_angle": sign * shift / length}
        assert neighbour.data["initial"] == pytest.approx(start | position, rel=1e-12, abs=0.0)
        guide = scene.data["mechanism"]["guide_x"]
        assert guide + position["slider_offset"] != guide + start["slider_offset"]
    assert perturbed_scenes(load_scene("ideal")) == {}


def test_where_only_the_pin_has_clearance_its_perturbed_run_rotates_the_crank_by_a_billionth_of_it():
    scene = load_scene("150rpm-0.2mm", {"joints.slider": "ideal", "joints.crank_pin": "clearance"})
    (neighbour,) = perturbed_scenes(scene).values()
    angle = np.radians(neighbour.data["mechanism"]["crank_angle_deg"] - 111.36)
    # 0.2 mm over the crank's 45 mm; 111.36 degrees have a last digit of 1.4e-14: 6e-5 of 2.5e-10 degrees.
    assert angle == pytest.approx(1e-9 * 0.2e-3 / 0.045, rel=1e-4)
    both = perturbed_scenes(load_scene("150rpm-0.2mm", {"joints.crank_pin": "clearance"}))["perturbed"]
    assert both.data["mechanism"] == scene.data["mechanism"]
    assert both.data["initial"]["slider_angle"] > 0


@pytest.mark.parametrize(("power", "factor"), [(1.0, 10.0), (2.0, 2.0), (4.0, 2.0)])
def test_the_power_of_the_error_is_observed(make_table, scene, power, factor):
    coarser, base, finer = (make_table(error=1e-6 * factor ** (-power * n)) for n in range(3))
    runs = Runs(base=base, finer=finer, coarser=coarser, refinement=(factor, 2.0))
    result = compare(runs, runs, scene=scene, labels=("reference", "exudyn"))
    for each in result.attribution.refinements:
        # Differences of 1e-14 of channels of size 1 are known to a hundredth; errors are exact multiples.
        assert (each.observed, each.order) == pytest.approx((power, 2.0), abs=0.02)
    samples = {"slider_x": (np.arange(base.time.size) > 5, 2e-4)}
    for family in (Runs(base, finer), Runs(base, base, None, coarser), Runs(base, finer, None, base)):
        assert np.isnan(observed_order(family, samples))
