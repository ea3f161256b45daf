"""The reliability of tables is that of `validate`, whose runs have ten times the samples."""

import numpy as np
import pytest

import sixbar
from comparison.execution.run import Job, run_all
from comparison.models import MODELS
from comparison.reliability.assessment import dense_scene
from comparison.tables.table import TableError

SCENE = sixbar.load_scene(
    "150rpm-0.2mm",
    {"solver.exudyn.formulation": "tree", "solver.exudyn.tolerance": 1e-8, "drive.cycles": 1},
)


@pytest.fixture(scope="module")
def validated():
    (result,) = sixbar.validate([SCENE], n_jobs=0, tiers=["standard"])
    return result.comparison.reliability.quantities


def tables(scene):
    """The runs of both models, and the reference's of the ideal mechanism."""
    ideal = scene.with_values({"joints.slider": "ideal"})
    jobs = [*(Job(scene, model) for model in MODELS), Job(ideal, "reference")]
    return [outcome.table for outcome in run_all(jobs, 0)]


def test_at_the_samples_of_validate_the_numbers_are_its_own(validated):
    a, b, ideal = tables(dense_scene(SCENE))
    result = sixbar.reliability(a, b, ideal=ideal)
    assert list(validated) == list(result.comparison.quantities)
    for name, both in validated.items():
        own, difference = result.a[name], result.comparison.quantities[name]
        for part in ("reliability", "low", "high", "mean", "deviation", "within"):
            assert np.array_equal(getattr(own, part), getattr(both.a, part))
        assert (own.minimum, own.worst, own.interval) == (both.a.minimum, both.a.worst, both.a.interval)
        # There Exudyn's run has the ideal motion of Exudyn, whose error is in what is stated.
        assert abs(difference.minimum - both.minimum) <= both.half_width
        assert difference.verdict == "undecided"  # without finer runs


def test_too_few_samples_are_warned_of(validated):
    a, b, ideal = tables(SCENE)
    for given, period in (((a, b, ideal), None), ((a.frame, b.frame, ideal.frame), SCENE.period)):
        result = sixbar.reliability(*given[:2], ideal=given[2], period=period)
        assert [line.partition(":")[0] for line in result.warnings] == ["table a", "table b"]
        for name, both in validated.items():
            # Whatever the samples miss, they miss in both.
            assert abs(result.comparison.quantities[name].minimum - both.minimum) <= both.half_width
            # Every second sample changes R by 2e-3, which the warning tells.
            assert np.abs(result.a[name].reliability - both.a.reliability).max() < 2e-3


def test_a_table_that_was_recorded_with_clearance_is_no_ideal_one():
    a, b, _ = tables(SCENE)
    with pytest.raises(TableError, match=r"^table ideal: .*clearance \(slider\)"):
        sixbar.reliability(a, ideal=b)
