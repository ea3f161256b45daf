"""Settings on one scene: what is called known, what an error is, which setting is the cheapest; the front."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from comparison.accuracy.refine import FLOOR
from comparison.accuracy.work_precision import TimedRun, candidates, evaluate_runs
from comparison.scene import load_scene
from comparison.words.accuracy import settings_basis

SCENE = load_scene("150rpm-0.2mm", {"drive.cycles": 1.0, "clearance.slider": 2e-4})
CANDIDATES = candidates(SCENE)
RIGHT = -0.55 + 2e-4 * np.sin(np.linspace(0.0, 6.0, 1001))


def measured(unknown=0.5):
    """All settings, each with an error of its tolerance; from a share of the run on the models diverge."""
    rows = []
    for candidate in CANDIDATES:
        full, setting = candidate.formulation == "full", candidate.setting
        x = RIGHT + (1e7 * setting**2 if full else setting)
        x[round(unknown * 1000) :] += 1e-5 * (candidate.model == "exudyn")
        seconds = 0.1 / setting**0.1 * (1.0 if candidate.model == "reference" else 10.0)
        rows.append(TimedRun(candidate, "success", seconds, x))
    return evaluate_runs(SCENE, rows)


@pytest.mark.parametrize("error", [1e-5, 1e-6, 1e-9])
def test_the_cheapest_setting_keeps_the_error_where_the_motion_is_known(error):
    result = measured()
    row = result.cheapest(error)
    known = result.u <= error
    assert known.mean() == result.coverage(error) == pytest.approx(0.5, abs=0.02)
    assert np.abs(row.x - RIGHT)[known].max() <= error
    cheaper = [other for other in result.rows if other.seconds < row.seconds]
    assert all(np.abs(other.x - RIGHT)[known].max() > 0.99 * error for other in cheaper)


def test_what_neither_model_knows_is_not_promised():
    result = measured(unknown=FLOOR / 2)
    assert [result.cheapest(error) for error in (1e-6, 1e-9)] == [None, None]
    assert result.cheapest(1e-4).candidate.setting == 1e-6  # 3e-5 m is known everywhere
    assert measured().cheapest(1e-13) is None


def test_runs_that_are_close_by_chance_do_not_hide_how_far_neighbouring_trajectories_diverge():
    close = measured(unknown=1.1)
    rows, first = close.rows, close.rows[0]
    moved = [replace(first, x=first.x + 1e-7 * sign * (RIGHT > -0.55)) for sign in (1, -1)]
    result = evaluate_runs(SCENE, rows, [*moved, replace(first, status="chatter", x=None)])
    assert (close.coverage(1e-9), close.neighbours, result.neighbours) == (1.0, 0, 2)
    assert FLOOR < result.coverage(1e-9) < 0.5
    assert result.coverage(3.1e-7) == 1.0
    # Of another run's start they say nothing.
    lost = [replace(first, status="time limit", x=None), *rows[1:]]
    assert evaluate_runs(SCENE, lost, moved).coverage(1e-9) == 1.0
    nothing = evaluate_runs(SCENE, [replace(row, status="chatter", x=None) for row in rows])
    assert (nothing.exact, nothing.front, nothing.cheapest(1e-5)) == (None, (), None)


def test_one_model_alone_is_unconfirmed():
    lost = {"status": "chatter", "x": None}
    rows = [replace(row, **lost) if row.candidate.model == "exudyn" else row for row in measured().rows]
    assert settings_basis(evaluate_runs(SCENE, rows)).endswith("no run of the other model confirms it")


def test_the_front_has_only_settings_that_are_better_beyond_the_error_of_their_errors():
    front = measured().front
    doubt = 3e-13  # 1e-12 of the other model from 1e-13 of the first: 1e-12 is as good as anything beyond
    assert [row.candidate.setting for row in front][:3] == [1e-6, 1e-7, 1e-8]
    errors = [measured().error(row) for row in front]
    assert all(before - after > doubt for before, after in pairwise(errors))
    assert [row.seconds for row in front] == sorted(row.seconds for row in front)
