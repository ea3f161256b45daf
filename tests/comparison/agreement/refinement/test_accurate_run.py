"""A wanted error is kept where it is said to be, and what cannot be kept is said."""

from __future__ import annotations

import numpy as np
import pytest

from comparison.accuracy.levels import AccuracyError
from comparison.agreement.refinement.accurate_run import Limit, accurate_run
from comparison.agreement.refinement.estimate import FLOOR
from comparison.execution.run import RunError
from comparison.scene import SceneError, load_scene
from tests.helpers.known_error import USUAL, KnownError, exact, growing, steady

OWN = USUAL.with_values({"clearance.slider": 2.1e-4})
"""No measured scene."""


def error(found):
    return np.abs(found.table.values("slider_x") - exact())


@pytest.mark.parametrize("magnification", [steady, growing])
@pytest.mark.parametrize("proportion", [0.3, 10.0, 300.0])
@pytest.mark.parametrize("wanted", [1e-6, 1e-8, 1e-9])
def test_the_error_is_as_small_as_wanted_on_the_predictable_part(magnification, proportion, wanted):
    found = accurate_run(OWN, "reference", wanted, run=KnownError(magnification, proportion))
    assert found.kept
    predictable = found.estimate.u <= wanted
    assert predictable.mean() == found.coverage
    assert error(found)[predictable].max() <= wanted
    # Of what changes by orders of magnitude all is found, but for the window of u at the change.
    half = 1.0 if magnification is steady else 0.5
    assert half - 0.02 <= found.coverage <= half
    assert (found.estimate.until(wanted) == np.inf) == (magnification is steady)


def test_the_setting_is_refined_until_the_estimate_is_small_enough_and_no_further():
    run = KnownError(error=1e4)
    found = accurate_run(OWN, "reference", 1e-7, run=run)
    settings = [level.scene.data["solver"]["reference"]["tolerance"] for level in found.tried]
    assert len(settings) > 1
    np.testing.assert_allclose(np.divide(settings[:-1], settings[1:]), 10.0)
    assert found.level is found.tried[-1]
    assert all(level.estimate.coverage(1e-7) < 1.0 for level in found.tried[:-1])
    # No run twice: two settings beside the levels themselves, and two perturbed runs of each coarser one.
    assert found.runs == len(run.asked) == len(settings) + 2 + 2 * len(settings)


def test_where_the_coarse_runs_part_but_not_the_motion_strict_is_asked():
    run = KnownError(rough=2e-12)
    found = accurate_run(OWN, "reference", 1e-7, run=run)
    settings = [level.scene.data["solver"]["reference"]["tolerance"] for level in found.tried]
    assert len(settings) == 3  # the guess, the next, the last
    assert settings[-1] == 1e-12
    # The perturbed runs of its coarser one part too, and count.
    assert found.coverage == max(level.estimate.coverage(1e-7) for level in found.tried) < 0.5
    assert accurate_run(OWN, "reference", 1e-7, run=KnownError(rough=2e-11)).coverage == 1.0


def test_the_same_accuracy_as_text_and_a_named_setting():
    as_text = accurate_run(OWN, "reference", "1e-7", run=KnownError())
    assert as_text.wanted == 1e-7
    named = accurate_run(OWN, "reference", "draft", run=KnownError())
    assert named.level.scene.data["solver"]["reference"]["tolerance"] == 1e-7
    assert (named.kept, named.wanted, len(named.tried)) == (True, None, 1)
    assert np.all(error(named) <= named.estimate.u)
    own = accurate_run(OWN, "reference", run=KnownError())
    assert own.level.scene == OWN


def test_where_neighbouring_starts_part_at_once_nothing_is_reached():
    early = KnownError(lambda phase: np.where(phase < 0.1, 1.0, 1e9))
    found = accurate_run(OWN, "reference", 1e-8, run=early)
    assert (found.kept, found.limit) == (False, Limit.STARTS)
    assert 0.08 < found.coverage <= 0.1 < FLOOR
    assert found.estimate.until(1e-8) == pytest.approx(0.1 * OWN.duration, rel=0.11)  # the window of u
    assert len(found.tried) > 1  # finer settings were tried first


def test_a_setting_that_is_never_good_enough():
    found = accurate_run(OWN, "reference", 1e-11, run=KnownError(error=1e4))
    assert (found.kept, found.limit, found.coverage) == (False, Limit.FINEST, 0.0)
    assert found.level.scene.data["solver"]["reference"]["tolerance"] == 1e-12
    assert error(found).max() <= found.estimate.held(1.0)


def test_where_finer_settings_stop_the_best_of_the_others_is_taken():
    run = KnownError(error=1e4, fails=lambda tolerance: "step-too-small" if tolerance < 0.9e-10 else "")
    found = accurate_run(OWN, "reference", 1e-9, run=run)
    assert (found.kept, found.limit) == (False, Limit.STOPPED)
    assert found.stopped.status == "step-too-small"
    assert found.level.scene.data["solver"]["reference"]["tolerance"] == 1e-9  # with 1e-10 as its finer run
    assert error(found).max() <= found.estimate.held(1.0)


def test_a_setting_too_coarse_for_the_scene_is_passed_over():
    refuses = KnownError(fails=lambda tolerance: "bad input" if tolerance > 0.9e-9 else "")
    found = accurate_run(OWN, "reference", 1e-6, run=refuses)
    assert found.kept
    assert found.level.scene.data["solver"]["reference"]["tolerance"] < 1e-9
    assert error(found).max() <= 1e-6


def test_without_a_coarser_run_neighbouring_starts_are_those_of_the_setting_itself():
    refuses = KnownError(growing, fails=lambda tolerance: "bad input" if tolerance > 0.9e-8 else "")
    coarsest = accurate_run(OWN, "reference", 1e-6, run=refuses).tried[1]
    assert coarsest.outcomes.keys() == {"base", "finer", "perturbed", "other_perturbed"}
    # A billionth of the clearance, magnified by 1e8, with the safety factor.
    assert coarsest.estimate.spread.max() == pytest.approx(3 * 2.1e-13 * 1e8, rel=0.01)
    assert coarsest.estimate.coverage(1e-6) <= 0.5


def test_without_a_finer_run_the_error_is_unknown_and_the_table_is_there():
    only = KnownError(fails=lambda tolerance: "" if tolerance == 1e-8 else "chatter")
    found = accurate_run(OWN, "reference", 1e-6, run=only)
    assert (found.kept, found.limit, found.estimate) == (False, Limit.UNKNOWN, None)
    assert error(found).max() < 1e-6
    assert np.isnan(found.with_uncertainty().values("slider_x_u")).all()


@pytest.mark.parametrize(("status", "kind"), [("chatter", RunError), ("bad input", SceneError)])
def test_no_run_at_all_is_an_error(status, kind):
    with pytest.raises(kind, match="as told"):
        accurate_run(OWN, "reference", 1e-6, run=KnownError(fails=lambda _: status))


@pytest.mark.parametrize("accuracy", ["precise", "-1", 0.0, "nan"])
def test_nonsense_is_refused(accuracy):
    with pytest.raises(AccuracyError, match="must be draft, standard, strict or a positive number"):
        accurate_run(OWN, "reference", accuracy, run=KnownError())


def test_what_was_wanted_and_reached_is_recorded():
    found = accurate_run(OWN, "reference", 1e-8, run=KnownError(growing))
    record = found.table.provenance["accuracy"]
    assert (record["wanted_m"], record["kept"], record["limit"]) == (1e-8, True, None)
    assert record["coverage"] == found.coverage
    assert record["until_s"] == found.estimate.until(1e-8)
    assert record["estimated_m"]["1"] == found.estimate.u.max()
    table = found.with_uncertainty()
    assert list(table.frame) == ["time", "slider_x", "slider_x_u"]
    np.testing.assert_array_equal(table.values("slider_x_u"), found.estimate.u)
    assert table.channels == ["slider_x"]


def test_the_reference_keeps_an_accuracy_on_a_scene_that_nobody_measured():
    """Against its own run at 1e-14, whose error is decades below the wanted one where predictable."""
    changes = {"clearance.slider": 3e-4, "drive.speed_rpm": 90, "output.groups": [], "drive.cycles": 1.0}
    scene = load_scene("150rpm-0.2mm", changes)
    found = accurate_run(scene, "reference", 1e-8)
    right = accurate_run(scene.with_values({"solver.reference.tolerance": 1e-14}), "reference").table
    off = np.abs(found.table.values("slider_x") - right.values("slider_x"))
    assert found.kept
    assert off[found.estimate.u <= 1e-8].max() <= 1e-8
    assert off.max() <= 3 * found.estimate.held(1.0)
