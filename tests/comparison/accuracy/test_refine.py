"""Runs keep a required error where their estimate says so; the cheapest setting keeps it too."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np
import pandas as pd
import pytest

from comparison.accuracy.refine import FLOOR, Limit, accurate_run, chosen_settings
from comparison.accuracy.work_precision import TimedRun, candidates, evaluate_runs
from comparison.execution.run import Outcome
from comparison.scene import load_scene
from comparison.tables.table import Table
from comparison.words.accuracy import accuracy_line, settings_basis

PRESS = load_scene("150rpm-0.2mm", {"clearance.slider": 2.1e-4})  # no measured scene
PHASE = np.linspace(0.0, 1.0, 1001)
EXACT = -0.55 + 2e-4 * np.sin(2.0 * np.pi * PHASE)
STEADY = np.ones_like(PHASE)
GROWING = np.where(PHASE < 0.5, 1.0, 1e8)  # in the second half nothing can be known


@dataclass
class KnownError:
    """A model of a known error: it is in proportion to the tolerance, plus the growth of a moved start."""

    magnification: np.ndarray = field(default_factory=lambda: STEADY)
    error: float = 10.0  # of slider_x at a magnification of one, over the tolerance
    limit: float = np.inf  # tolerance above which a run parts from its neighbours in the second half
    fails: Callable[[float], str] = lambda _: ""
    tolerances: list[float] = field(default_factory=list)  # in the order of the runs

    def __call__(self, scenes):
        return [self._one(scene) for scene in scenes]

    def _one(self, scene):
        tolerance = scene.data["solver"]["reference"]["tolerance"]
        self.tolerances.append(tolerance)
        if status := self.fails(tolerance):
            return Outcome(status, "as told")
        growth = self.magnification * np.where((tolerance > self.limit) & (PHASE > 0.5), 1e8, 1.0)
        shift = scene.data["initial"]["slider_offset"] - PRESS.data["initial"]["slider_offset"]
        deviation = (self.error * tolerance * (1.0 + np.sin(7.0 * PHASE) ** 2) + shift) * growth
        columns = {"time": PHASE * scene.duration, "slider_x": EXACT + deviation}
        return Outcome("success", table=Table(pd.DataFrame(columns), provenance={"model": "reference"}))


def refine(target, *arguments, **options):
    return accurate_run(PRESS, "reference", target, run=KnownError(*arguments, **options))


def error(result):
    return np.abs(result.table.values("slider_x") - EXACT)


def tolerance(level):
    return level.scene.data["solver"]["reference"]["tolerance"]


@pytest.mark.parametrize("share", [1.0, 0.5])
@pytest.mark.parametrize(("proportion", "target"), [(300.0, 1e-6), (0.3, 1e-9), (300.0, 1e-9)])
def test_the_error_is_as_small_as_wanted_on_the_predictable_part(share, proportion, target):
    result = refine(target, STEADY if share == 1.0 else GROWING, proportion)
    assert result.kept
    predictable = result.estimate.u <= target
    assert predictable.mean() == result.coverage
    assert error(result)[predictable].max() <= target
    # Where the magnification jumps by orders of magnitude, only the window of u at the jump is unknown.
    assert share - 0.02 <= result.coverage <= share
    assert (result.estimate.until(target) == np.inf) == (share == 1.0)
    line = accuracy_line(result)
    assert ("without a gap up to" in line) == ("trajectories from starts" in line) == (share < 1.0)


def test_the_setting_is_refined_until_the_estimate_is_small_enough_and_no_further():
    run = KnownError(error=1e4)
    result = accurate_run(PRESS, "reference", "1e-7", run=run)
    settings = [tolerance(level) for level in result.tried]
    np.testing.assert_allclose(np.divide(settings[:-1], settings[1:]), [10.0] * 3)
    assert result.level is result.tried[-1]
    assert all(level.estimate.coverage(1e-7) < 1.0 for level in result.tried[:-1])
    # No run twice: two settings beside the levels themselves, and two perturbed runs of each coarser one.
    assert result.runs == len(run.tolerances) == len(settings) + 2 + 2 * len(settings)
    np.testing.assert_array_equal(result.with_uncertainty().values("slider_x_u"), result.estimate.u)


def test_where_the_coarse_runs_diverge_but_not_the_motion_strict_is_tried_at_once():
    result = refine(1e-7, limit=2e-12)
    assert len(result.tried) == 3  # the first, the next, the last
    assert tolerance(result.tried[-1]) == 1e-12
    # The perturbed runs of its coarser one diverge too, and count.
    assert result.coverage == max(level.estimate.coverage(1e-7) for level in result.tried) < 0.5
    assert refine(1e-7, limit=2e-11).coverage == 1.0


def test_a_comparison_runs_at_the_settings_that_are_refined_to_or_at_strict():
    def settings(accuracy, **options):
        run = KnownError(**options)
        return chosen_settings("reference", accuracy, PRESS, lambda jobs: run([job.scene for job in jobs]))

    best, strict = tolerance(refine(1e-7, error=1e3).level), {"solver.reference.tolerance": 1e-12}
    assert 1e-12 < best < 1e-9
    assert settings(1e-7, error=1e3) == {"solver.reference.tolerance": best}
    assert settings("1e-7", fails=lambda _: "chatter") == settings("strict") == strict


@pytest.mark.parametrize(
    ("target", "fails", "limit", "setting"),
    [
        # Where finer settings stop the best of the others is taken, here with 1e-10 as its finer run
        (1e-9, lambda t: "chatter" if t < 0.9e-10 else "", Limit.FAILURE, 1e-9),
        # A setting too coarse for the scene is passed over
        (1e-6, lambda t: "bad input" if t > 0.9e-9 else "", None, 1e-10),
    ],
)
def test_where_a_setting_fails_another_is_taken(target, fails, limit, setting):
    result = refine(target, error=1e4 if limit else 1.0, fails=fails)
    assert (result.kept, result.limit) == (limit is None, limit)
    assert tolerance(result.level) == pytest.approx(setting)
    assert error(result).max() <= result.estimate.error_on(1.0)
    assert ("it holds nowhere" in accuracy_line(result)) == (limit is not None)
    assert ("Finer settings have no result: chatter, as told" in accuracy_line(result)) == (limit is not None)


SCENE = load_scene("150rpm-0.2mm", {"drive.cycles": 1.0, "clearance.slider": 2e-4})
TRUTH = -0.55 + 2e-4 * np.sin(np.linspace(0.0, 6.0, 1001))


def evaluate(share=0.5):
    """Runs at all settings, each with an error of its tolerance; after a share the models diverge."""
    rows = []
    for candidate in candidates(SCENE):
        full, setting = candidate.formulation == "full", candidate.setting
        x = TRUTH + (1e7 * setting**2 if full else setting)
        x[round(share * 1000) :] += 1e-5 * (candidate.model == "exudyn")
        seconds = 0.1 / setting**0.1 * (1.0 if candidate.model == "reference" else 10.0)
        rows.append(TimedRun(candidate, "success", seconds, x))
    return evaluate_runs(SCENE, rows)


@pytest.mark.parametrize("error", [1e-5, 1e-6, 1e-9])
def test_the_cheapest_setting_keeps_the_error_where_the_motion_is_known(error):
    result = evaluate()
    row = result.cheapest(error)
    predictable = result.u <= error
    assert predictable.mean() == result.coverage(error) == pytest.approx(0.5, abs=0.02)
    assert np.abs(row.x - TRUTH)[predictable].max() <= error
    cheaper = [other for other in result.rows if other.seconds < row.seconds]
    assert all(np.abs(other.x - TRUTH)[predictable].max() > 0.99 * error for other in cheaper)


def test_what_neither_model_knows_is_not_promised():
    result = evaluate(share=FLOOR / 2)
    assert [result.cheapest(error) for error in (1e-6, 1e-9)] == [None, None]
    assert result.cheapest(1e-4).candidate.setting == 1e-6  # 3e-5 m is known everywhere
    assert evaluate().cheapest(1e-13) is None


def test_runs_that_are_close_by_chance_do_not_hide_how_far_neighbouring_trajectories_diverge():
    evaluation = evaluate(share=1.1)
    rows, first = evaluation.rows, evaluation.rows[0]
    neighbours = [replace(first, x=first.x + 1e-7 * sign * (TRUTH > -0.55)) for sign in (1, -1)]
    result = evaluate_runs(SCENE, rows, [*neighbours, replace(first, status="chatter", x=None)])
    assert (evaluation.coverage(1e-9), evaluation.neighbours, result.neighbours) == (1.0, 0, 2)
    assert FLOOR < result.coverage(1e-9) < 0.5
    assert result.coverage(3.1e-7) == 1.0
    # They say nothing of another run's start.
    timeouts = [replace(first, status="time limit", x=None), *rows[1:]]
    assert evaluate_runs(SCENE, timeouts, neighbours).coverage(1e-9) == 1.0
    failure = evaluate_runs(SCENE, [replace(row, status="chatter", x=None) for row in rows])
    assert (failure.exact, failure.front, failure.cheapest(1e-5)) == (None, (), None)


def test_one_model_alone_is_unconfirmed():
    failure = {"status": "chatter", "x": None}
    rows = [replace(row, **failure) if row.candidate.model == "exudyn" else row for row in evaluate().rows]
    assert settings_basis(evaluate_runs(SCENE, rows)).endswith("no run of the other model confirms it")


def test_the_front_has_only_settings_that_are_better_beyond_the_error_of_their_errors():
    front = evaluate().front
    doubt = 3e-13  # 1e-12 of the other model from 1e-13 of the first: 1e-12 is as good as anything beyond
    assert [row.candidate.setting for row in front][:3] == [1e-6, 1e-7, 1e-8]
    errors = [evaluate().error(row) for row in front]
    assert all(before - after > doubt for before, after in pairwise(errors))
    assert [row.seconds for row in front] == sorted(row.seconds for row in front)
