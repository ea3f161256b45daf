"""Both models on the paper's cases: their reliabilities agree, and a wrong number in one of them is seen."""

from __future__ import annotations

import pytest

from comparison.accuracy.tiers import tight
from comparison.execution.job import MODELS, Job
from comparison.execution.run import run_all
from comparison.reliability.difference import compare_reliability
from comparison.reliability.ideal import dense_scene, ideal_scenes
from comparison.scene import load_scene
from comparison.studies.reliability.study import STUDY
from comparison.verdict.compare import Runs
from comparison.verdict.validate import validate

pytestmark = pytest.mark.slow


def test_the_difference_of_the_two_models_is_within_its_interval_in_every_case(tmp_path, monkeypatch):
    monkeypatch.setenv("SIXBAR_CACHE_DIR", str(tmp_path))
    closest = [tight(load_scene(name), MODELS) for name in STUDY.full.cases]
    for result in validate(closest, n_jobs=2, tiers=("standard",)):
        found = result.comparison.reliability
        assert list(found.quantities) == ["displacement", "velocity", "acceleration"], found.missing
        for name, difference in found.quantities.items():
            sizes = f"{result.comparison.name}, {name}: {difference.minimum} within {difference.half_width}"
            assert abs(difference.minimum) <= difference.half_width, sizes


def test_a_restitution_one_percent_lower_in_one_model_is_a_difference(tmp_path, monkeypatch):
    monkeypatch.setenv("SIXBAR_CACHE_DIR", str(tmp_path))
    usual = dense_scene(tight(load_scene("90rpm-0.5mm"), MODELS))
    lower = usual.with_values({"contact.restitution": 0.891})
    ideal = ideal_scenes(usual, "reference")["base"]
    levels = [
        scene.with_values({"solver.reference.tolerance": tolerance})
        for scene in (usual, lower)
        for tolerance in (1e-12, 1e-13)
    ]
    *tables, still = (o.table for o in run_all([Job(of, "reference") for of in (*levels, ideal)], 2))
    sides = (Runs(*tables[:2]), Runs(*tables[2:]))
    found = compare_reliability(sides, (Runs(still, still),) * 2, usual.period, usual.reliability, 2.0)
    # Which of them shows it depends on the limits; that none does would mean that the interval takes in all.
    assert "differ" in {difference.verdict for difference in found.values()}, found
