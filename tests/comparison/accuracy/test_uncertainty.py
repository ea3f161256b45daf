"""Windows of time, moved starts and observed orders of an uncertainty; tests/judge has every number of it."""

import numpy as np
import pandas as pd
import pytest

from comparison.accuracy.uncertainty import (
    SAFETY_FACTOR,
    Runs,
    model_uncertainty,
    observed_order,
    perturbed_scenes,
)
from comparison.scene import load_scene
from comparison.tables.table import Table
from comparison.verdict.compare import compare


def test_samples_may_be_dense_in_part_and_runs_from_moved_starts_count():
    time = np.concatenate([np.arange(0, 0.1, 1e-3), np.arange(0.1, 1.01, 1e-2)])
    base, finer = (Table(pd.DataFrame({"time": time, "slider_x": np.zeros(time.size)})) for _ in range(2))
    finer.frame.loc[50, "slider_x"] = 1.0
    outside = time[model_uncertainty(Runs(base, finer), "slider_x", 1.0) >= SAFETY_FACTOR]
    # The window is a hundredth of a cycle.
    assert outside[[0, -1]] == pytest.approx([time[50] - 0.01, time[50] + 0.01])
    assert model_uncertainty(Runs(base), "slider_x", 1.0) is None
    far = Table(base.frame.assign(slider_x=5.0))
    assert model_uncertainty(Runs(base, finer), "slider_x", 1.0, [far]).min() > 5.0


@pytest.mark.parametrize("clearance", [5e-4, 1e-9])
def test_the_perturbed_runs_start_a_billionth_of_the_clearance_away(clearance):
    small = {"clearance.slider": clearance, "initial.slider_offset": 0.1 * clearance}
    scene = load_scene("90rpm-0.5mm", small)
    start, length = scene.data["initial"], scene.data["mechanism"]["slider"]["length"]
    # A run's x is that of the guide and the offset: of nanometres a billionth would be lost in it.
    away = max(1e-15, 1e-9 * clearance)
    scenes = perturbed_scenes(scene)
    assert list(scenes) == ["perturbed", "other_perturbed"]
    for perturbed, sign in zip(scenes.values(), (1, -1), strict=True):
        moved = perturbed.data["initial"]
        # The offset is 5e-5 m: its last digit is 7e-21 m.
        assert moved["slider_offset"] - start["slider_offset"] == pytest.approx(away, rel=1e-6)
        assert moved["slider_angle"] == pytest.approx(sign * away / length, rel=1e-12)
        assert {key for key in moved if moved[key] != start[key]} == {"slider_offset", "slider_angle"}
        guide = scene.data["mechanism"]["guide_x"]
        assert guide + moved["slider_offset"] != guide + start["slider_offset"]
    assert perturbed_scenes(load_scene("ideal")) == {}


def test_where_only_the_pin_has_clearance_its_perturbed_run_rotates_the_crank_by_a_billionth_of_it():
    scene = load_scene("150rpm-0.2mm", {"joints.slider": "ideal", "joints.crank_pin": "clearance"})
    (moved,) = perturbed_scenes(scene).values()
    turned = np.radians(moved.data["mechanism"]["crank_angle_deg"] - 111.36)
    # 0.2 mm over the crank's 45 mm; 111.36 degrees have a last digit of 1.4e-14: 6e-5 of 2.5e-10 degrees.
    assert turned == pytest.approx(1e-9 * 0.2e-3 / 0.045, rel=1e-4)
    both = perturbed_scenes(load_scene("150rpm-0.2mm", {"joints.crank_pin": "clearance"}))["perturbed"]
    assert both.data["mechanism"] == scene.data["mechanism"]
    assert both.data["initial"]["slider_angle"] > 0


@pytest.mark.parametrize(("power", "factor"), [(1.0, 10.0), (2.0, 2.0), (4.0, 2.0)])
def test_the_power_of_the_error_is_observed(make_table, scene, power, factor):
    coarser, base, finer = (make_table(error=1e-6 * factor ** (-power * n)) for n in range(3))
    runs = Runs(base=base, finer=finer, coarser=coarser, refinement=(factor, 2.0))
    result = compare(runs, runs, scene=scene, labels=("reference", "exudyn"))
    for refinement in result.attribution.refinements:
        # Differences of 1e-14 of channels of size 1 are known to a hundredth; errors are exact multiples.
        assert (refinement.observed, refinement.order) == pytest.approx((power, 2.0), abs=0.02)
    judged = {"slider_x": (np.arange(base.time.size) > 5, 2e-4)}
    for unknown in (Runs(base, finer), Runs(base, base, None, coarser), Runs(base, finer, None, base)):
        assert np.isnan(observed_order(unknown, judged))
