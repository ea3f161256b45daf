"""Settings on one scene: what is called known, what an error is, and which setting is the cheapest."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from comparison.agreement.refinement.candidates import Timed, candidates
from comparison.agreement.refinement.estimate import FLOOR
from comparison.agreement.refinement.settings_words import basis, commands, table
from comparison.agreement.refinement.work_precision import held_against_each_other
from comparison.scene import load_scene

SCENE = load_scene("150rpm-0.2mm", {"drive.cycles": 1.0, "clearance.slider": 2e-4})
EACH = candidates(SCENE)
RIGHT = -0.55 + 2e-4 * np.sin(np.linspace(0.0, 6.0, 1001))


def measured(unknown=0.5, lost=(), cost=0.1):
    """All settings, each with an error of its tolerance, or ten million times the square of its step.

    From a share of the run on the two models part by 1e-5 m.
    """
    rows = []
    for each in EACH:
        error = 1e7 * each.setting**2 if each.formulation == "full" else each.setting
        x = RIGHT + error
        x[round(unknown * 1000) :] += 1e-5 * (each.model == "exudyn")
        seconds = cost / each.setting**0.1 * (1.0 if each.model == "reference" else 10.0)
        gone = each.formulation in lost or each.setting in lost
        rows.append(Timed(each, "chatter", np.nan) if gone else Timed(each, "success", seconds, x))
    return held_against_each_other(SCENE, rows)


def test_the_two_models_most_accurate_settings_come_first_and_the_rest_by_cost():
    first, second, *rest = EACH
    assert (first.formulation, first.setting, second.formulation, second.setting) == (
        "minimal", 1e-13, "tree", 1e-11,
    )  # fmt: skip
    costs = [each.cost for each in rest]
    assert costs == sorted(costs)
    assert {each.formulation for each in EACH} == {"minimal", "tree", "full"}
    named = SCENE.with_values({"solver.reference.formulation": "multiplier", "output.groups": ["joints"]})
    assert {each.formulation for each in candidates(named)} == {"minimal", "multiplier", "full"}


@pytest.mark.parametrize("error", [1e-5, 1e-6, 1e-9])
def test_the_cheapest_setting_keeps_the_error_where_the_motion_is_known(error):
    found = measured()
    row = found.cheapest(error)
    known = found.known <= error
    assert known.mean() == found.coverage(error) == pytest.approx(0.5, abs=0.02)
    assert np.abs(row.x - RIGHT)[known].max() <= error
    cheaper = [other for other in found.rows if other.seconds < row.seconds]
    assert all(np.abs(other.x - RIGHT)[known].max() > 0.99 * error for other in cheaper)


def test_what_neither_model_knows_is_not_promised():
    found = measured(unknown=FLOOR / 2)
    assert [found.cheapest(error) for error in (1e-6, 1e-9)] == [None, None]
    assert found.cheapest(1e-4).candidate.setting == 1e-6  # 3e-5 m is known everywhere
    assert measured().cheapest(1e-13) is None


def test_runs_that_are_close_by_chance_do_not_hide_how_far_neighbouring_starts_part():
    close = measured(unknown=1.1)
    rows, first = close.rows, close.rows[0]
    parted = [replace(first, x=first.x + 1e-7 * sign * (RIGHT > -0.55)) for sign in (1, -1)]
    found = held_against_each_other(SCENE, rows, [*parted, replace(first, status="chatter", x=None)])
    assert (close.coverage(1e-9), close.neighbours, found.neighbours) == (1.0, 0, 2)
    assert FLOOR < found.coverage(1e-9) < 0.5
    assert found.coverage(3.1e-7) == 1.0
    assert "tolerance 1e-11 and neighbouring starts are within" in basis(found)
    # Of another run's start they say nothing.
    lost = [replace(first, status="time limit", x=None), *rows[1:]]
    assert held_against_each_other(SCENE, lost, parted).coverage(1e-9) == 1.0


def test_nothing_beats_a_setting_on_the_front():
    found = measured()
    front = found.front
    assert {row.candidate.model for row in front} == {"reference"}  # ten times as fast here
    errors, costs = [found.error(row) for row in front], [row.seconds for row in front]
    assert costs == sorted(costs)
    assert errors == sorted(errors, reverse=True)


def test_one_model_alone_is_said_to_be_unconfirmed():
    found = measured(lost=("tree", "full"))
    assert not found.confirmed
    assert [row.candidate.setting for row in (found.exact, found.confirming)] == [1e-13, 1e-12]
    assert basis(found).endswith("no run of the other model confirms it")
    nothing = measured(lost=("minimal", "tree", "full"))
    assert (nothing.exact, nothing.front, nothing.cheapest(1e-5)) == (None, (), None)
    assert basis(nothing) == "no two runs have a result: errors are unknown"
    assert {row[3] for row in table(nothing)[1:]} == {"chatter"}


def test_a_row_a_setting_and_a_command_for_each_error():
    found = measured(lost=(1e-7,))
    rows = table(found)
    assert len(rows) == 1 + len(EACH)
    assert [row[0] for row in rows[1:3]] == [
        "reference minimal, tolerance 1e-06", "reference minimal, tolerance 1e-07",
    ]  # fmt: skip
    asked = [(row.candidate.formulation, row.candidate.setting) for row in found.rows]
    coarsest = found.rows[asked.index(("minimal", 1e-6))]
    assert rows[1] == ("reference minimal, tolerance 1e-06", "1.0e-06", f"{coarsest.seconds:.3g}", "*")
    said = commands(found)
    assert said[0][0].startswith("1e-05 m on 49% of the run, ")  # a window less than half
    assert said[0][1] == (
        f"{SCENE.command('run')} --set solver.reference.formulation=minimal --set "
        f"solver.reference.tolerance=1e-06 --model reference --out {SCENE.name}.csv"
    )
    # Without 1e-7 one setting is the cheapest for two errors.
    assert said[1][0].startswith("1e-06 to 1e-07 m on ")
