"""Cells, classes and reasons of the study extremes; a handful of its cells run for real."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from comparison.execution.store import cache_folder
from comparison.scene import load_scene
from comparison.studies.extremes import tables
from comparison.studies.extremes.campaign import CellOutcome, run_campaign
from comparison.studies.extremes.causes import kind
from comparison.studies.extremes.cells import BASE_LABEL, HYPERCUBE, LAWS, SEED, Cell, cells, hypercube
from comparison.studies.extremes.figures import draw
from comparison.studies.extremes.formulations import FULL, MINIMAL, STRICT, TREE
from comparison.studies.extremes.reasons import Base, reasons
from comparison.studies.extremes.refinement import rerun
from comparison.studies.extremes.runs import CellRun, out_of_time, run_cell, run_tasks
from comparison.studies.extremes.study import STUDY
from comparison.studies.extremes.verdicts import Class, Refined, Verdict, apart, judge

UNEXPLAINED = "not explained"
EVERY_CELL = cells(STUDY.full.axes, STUDY.full.points)


pytestmark = pytest.mark.usefixtures("own_cache")


def row(x, status="success", **more):
    return {"status": status, "message": "", "x": list(x), **more}


def test_the_ranges_that_are_asked_for_are_reached():
    by_key: dict[str, list[float]] = {}
    for cell in EVERY_CELL:
        for key, value in {**cell.changes, **cell.settings}.items():
            if isinstance(value, float):
                by_key.setdefault(key, []).append(value)
    for key, low, high in (
        ("clearance.slider", 1e-9, 5e-3),
        ("drive.speed_rpm", 1.0, 6000.0),
        ("contact.youngs_modulus", 1e6, 1e13),
        ("contact.restitution", 0.0, 1.0),
        ("friction.coefficient", 0.0, 2.0),
        ("contact.corner_radius", 1e-6, 1.0),
        ("environment.gravity", -9.81, 98.1),
        ("drive.cycles", 10.0, 10_000.0),
        ("solver.reference.tolerance", 1e-16, 1.0),
        ("solver.exudyn.step", 1e-7, 1e-2),
    ):
        of_one_key = [value for value in by_key[key] if key != "drive.speed_rpm" or value > 0]
        assert (min(of_one_key), max(of_one_key)) == pytest.approx((low, high), rel=0.05), key
    names = Counter((cell.axis, cell.label, cell.law) for cell in EVERY_CELL)
    assert max(names.values()) == 1


def test_the_hypercube_has_a_point_in_each_of_200_parts_of_each_range():
    points = hypercube(STUDY.full.points, SEED)
    assert len(points) == 200
    assert {cell.law for cell in points} == set(LAWS)
    for key, low, high in (("drive.speed_rpm", 1.0, 6000.0), ("contact.youngs_modulus", 1e6, 1e13)):
        share = np.log(np.array([cell.changes[key] for cell in points]) / low) / np.log(high / low)
        # Values are written with six digits: a point on a border may change its part.
        assert len(set(np.floor(200 * share))) >= 198
    assert points[3].changes == hypercube(STUDY.full.points, SEED)[3].changes


BOUND = 1e-9
EXACT = np.linspace(-2e-4, 2e-4, 11)
TIGHT = {"minimal, strict": row(EXACT), "tree, strict": row(EXACT + 1e-12)}


def test_a_run_converged_only_if_it_is_close_to_both_runs_that_count_as_exact():
    off = np.zeros(11)
    off[7] = 0.9e-9
    assert judge(row(EXACT + off), TIGHT, BOUND).kind is Class.CONVERGED
    off[7] = 1.1e-9
    verdict = judge(row(EXACT + off), TIGHT, BOUND)
    assert (verdict.kind, verdict.lasted) == (Class.DEGRADED, 0.7)
    assert verdict.error == pytest.approx(1.1e-9, rel=1e-2)
    apart = {"minimal, strict": row(EXACT), "tree, strict": row(EXACT + 1e-6)}
    for exact in (EXACT, EXACT + 1e-6):
        assert judge(row(exact), apart, BOUND).kind is Class.DEGRADED


def test_without_an_error_bound_nothing_converged_and_without_an_exact_run_nothing_is_known():
    assert judge(row(EXACT), TIGHT, math.nan).kind is Class.DEGRADED
    gone = {name: row([], "step-too-small") for name in TIGHT}
    assert judge(row(EXACT), gone, BOUND).kind is Class.UNCONFIRMED
    gone["tree, strict"] = row(EXACT)
    assert judge(row(EXACT), gone, BOUND).kind is Class.CONVERGED


@pytest.mark.parametrize(
    ("status", "kind"),
    [
        ("work-limit", Class.STOPPED),
        ("newton-failed", Class.STOPPED),
        ("bad input", Class.REFUSED),
        ("crashed", Class.CRASHED),
        ("unusable", Class.NONSENSE),
    ],
)
def test_every_status_has_its_class(status, kind):
    assert judge({"status": status, "message": ""}, TIGHT, BOUND).kind is kind


def test_spurious_energy_is_no_convergence():
    assert judge(row(EXACT, energy_share=0.009), TIGHT, BOUND).kind is Class.CONVERGED
    assert judge(row(EXACT, energy_share=0.011), TIGHT, BOUND).kind is Class.DEGRADED
    assert judge(row(EXACT, constraint_m=1.1e-6), TIGHT, BOUND).kind is Class.DEGRADED


def test_formulations_that_leave_at_one_instant_have_one_reason():
    unchanged = found(0.0, 2.0)
    of = found(0.0, 2.0)
    off = np.zeros(11)
    off[6:] = 1e-6
    for name in (FULL.name, TREE.name):
        of.rows[name] = row(EXACT + off)
        of.verdicts[name] = judge(of.rows[name], TIGHT, BOUND)
    assert "at 0.60 of the cycle, where tree" in reason(of, FULL.name, Base(unchanged, unchanged))
    of.verdicts[TREE.name] = judge(row(EXACT), TIGHT, BOUND)
    assert UNEXPLAINED in reason(of, FULL.name, Base(unchanged, unchanged))


def test_runs_are_as_far_apart_as_the_farthest_two_that_finished():
    moved = EXACT + 1e-9 * np.linspace(1.0, 40.0, 11)
    assert apart(row(EXACT), row(moved)) == pytest.approx(40e-9, rel=1e-6)
    assert apart(row(EXACT), row([], "work-limit"), row(EXACT - 1e-9), row(moved)) == pytest.approx(
        41e-9, rel=1e-6
    )
    assert math.isnan(apart(row(EXACT), row([], "work-limit")))


def reason(of: CellOutcome, name: str, base: Base) -> str:
    return "; ".join(map(str, reasons(of, name, base)))


def found(error: float, magnified: float, steps: float | None = None, law: str = LAWS[0]) -> CellOutcome:
    of = CellOutcome(Cell("axis", "value", law, (FULL,)), magnification=magnified)
    of.exact = TIGHT
    of.rows = {FULL.name: row(EXACT + error, steps_per_contact=steps)}
    of.verdicts = {FULL.name: judge(of.rows[FULL.name], TIGHT, BOUND)}
    return of


def test_a_reason_is_given_only_where_it_accounts_for_the_error():
    unchanged = found(0.0, 2.0, 100.0)
    base = Base(unchanged, unchanged)
    assert reason(unchanged, FULL.name, base) == ""
    # A hundred times the base's magnification, a thousand times the error bound: within the scatter.
    assert "magnifies 100" in reason(found(1e-6, 200.0, 100.0), FULL.name, base)
    assert UNEXPLAINED not in reason(found(1e-6, 200.0, 100.0), FULL.name, base)
    assert UNEXPLAINED in reason(found(2e-6, 200.0, 100.0), FULL.name, base)
    # A fifth of the steps a contact, 25 times the error.
    assert "20 steps a contact" in reason(found(2e-7, 2.0, 20.0), FULL.name, base)
    assert UNEXPLAINED not in reason(found(2e-7, 2.0, 20.0), FULL.name, base)
    assert UNEXPLAINED in reason(found(3e-7, 2.0, 20.0), FULL.name, base)
    assert reason(found(1.0, 2.0, 3.0), FULL.name, base) == "a contact lasts 3.0 steps"
    # A formulation that errs as much in the base scene errs by itself.
    poor = Base(found(1.5e-6, 2.0, 100.0), unchanged)
    assert "errs 1500 times its bound" in reason(found(1e-6, 2.0, 100.0), FULL.name, poor)
    assert "no run converges" in reason(found(1.0, 2.0, 100.0, LAWS[2]), FULL.name, base)


@pytest.mark.parametrize(
    ("row", "sentence", "named"),
    [
        ({"share": 0.3, "limit": 1000.0}, "work-limit, stopped after 1000 units", "work-limit"),
        ({"share": 0.3, "x": [], "limit": 1000.0}, "work-limit", "work-limit"),
    ],
)
def test_how_a_run_ended_follows_from_its_data(row, sentence, named):
    of = found(0.0, 2.0)
    of.rows[FULL.name] = {"status": "work-limit", "message": "", **row}
    of.verdicts[FULL.name] = judge(of.rows[FULL.name], TIGHT, BOUND)
    why = reasons(of, FULL.name, Base(of, of))
    assert ("; ".join(map(str, why)), kind(why)) == (sentence, named)
    of.cell = replace(of.cell, changes={"friction.coefficient": 2.0})
    assert kind(reasons(of, FULL.name, Base(of, of))) == f"{named} (friction may jam it)"


@pytest.mark.parametrize(
    ("strict", "named"), [("success", "tolerance too coarse"), ("bad input", "no such mechanism")]
)
def test_a_refusal_is_one_of_the_tolerance_where_a_finer_one_is_not_refused(strict, named):
    of = found(0.0, 2.0)
    of.rows[FULL.name] = {"status": "bad input", "message": "scene '150rpm-0.2mm': the rule"}
    of.verdicts[FULL.name] = judge(of.rows[FULL.name], TIGHT, BOUND)
    of.exact = {STRICT.name: row(EXACT, strict)}
    (why,) = reasons(of, FULL.name, Base(of, of))
    assert (str(why), kind([why])) == ("the rule", named)


def test_a_refined_rerun_is_a_reason_only_where_it_accounts_for_the_error():
    unchanged, of = found(0.0, 2.0, 100.0), found(2e-6, 200.0, 100.0)
    verdict = of.verdicts[FULL.name]

    def why(apart: float, finer: Verdict | None, status: str = "success") -> str:
        of.refined = {FULL.name: Refined(apart, finer, status)}
        return reason(of, FULL.name, Base(unchanged, unchanged))

    assert "no setting resolves" in why(2.1e-7, None)
    assert UNEXPLAINED in why(1.9e-7, None)
    assert "at the next finer one 900" in why(math.nan, replace(verdict, error=9e-7))
    assert UNEXPLAINED in why(math.nan, replace(verdict, error=1.1e-6))
    stopped = Verdict(Class.STOPPED)
    assert "edge of stopping: at the next finer setting newton-failed" in why(0.0, stopped, "newton-failed")


def test_starts_a_hair_apart_are_run_and_the_run_once_more_with_a_finer_setting():
    """In a scene that loses nothing, under the law of a whole side, a hair decides; in the base scene not."""
    many = []
    for cell in (
        Cell("restitution", "1", LAWS[1], (MINIMAL,), {"contact.restitution": 1.0}),
        Cell("base", BASE_LABEL, LAWS[0], (MINIMAL,)),
    ):
        of = CellOutcome(cell)
        exact = cell.scene.with_values({**STRICT.changes, "drive.cycles": 1.0})
        of.exact = {
            STRICT.name: run_cell(CellRun(exact, "reference"), lambda _: None) | {"status": "success"}
        }
        of.verdicts = {MINIMAL.name: Verdict(Class.DEGRADED, 1e-6, 1e-9, 0.5)}
        many.append(of)
    rerun(many, [(0, MINIMAL.name), (1, MINIMAL.name)], 1, None)
    hair, ordinary = (of.refined[MINIMAL.name] for of in many)
    # A thousand times the hair of 1e-13 m at the least; 9e-5 m, of a clearance of 2e-4 m, measured.
    assert hair.apart > 1e-10
    # The base scene magnifies it by 8 only, but the bound of either run is 3e-11 m.
    assert 0.0 < ordinary.apart < 1e-10
    assert ordinary.finer is not None
    assert ordinary.finer.error < 2.6e-10  # the bound at a tenth of the standard tolerance
    assert ordinary.status == "success"


def test_a_run_that_takes_too_long_is_stopped_and_the_others_are_not():
    endless = {"solver.exudyn.formulation": "full", "solver.exudyn.step": 1e-9, "drive.cycles": 0.1}
    tasks = {
        "endless": CellRun(load_scene("150rpm-0.2mm", endless), "exudyn", 150.0),
        "short": CellRun(load_scene("150rpm-0.2mm", {"drive.cycles": 0.05}), "reference", 150.0),
    }
    # Forty million steps take minutes; what is compiled before is not counted.
    rows = run_tasks(tasks, 2, None)
    assert rows["endless"]["status"] == "work-limit"
    assert 0.0 <= rows["endless"]["share"] < 0.5
    assert [out_of_time(row) for row in rows.values()] == [True, False]
    assert rows["short"]["status"] == "success"
    # Both are kept: neither is run again.
    (ledger,) = cache_folder().glob("extremes-runs-*.jsonl")
    kept = ledger.read_bytes()
    assert run_tasks(tasks, 2, None) == rows
    assert ledger.read_bytes() == kept


def test_some_cells_for_real(tmp_path):
    """Each ends in a class, the refused one with its reason, and tables and drawing hold them all."""
    wanted = {
        ("base", BASE_LABEL),
        ("modulus", "1e+08"),
        ("clearance", "1e-06"),
        ("restitution", "1"),
        ("edge of assembly", "rod 2 0.5 m"),
    }
    chosen = [
        replace(cell, methods=(MINIMAL, TREE))
        for cell in EVERY_CELL
        if (cell.axis, cell.label) in wanted and cell.law == LAWS[0]
    ]
    assert len(chosen) == len(wanted)
    every = run_campaign(chosen, 2, None)
    for of in every:
        assert set(of.verdicts) == {MINIMAL.name, TREE.name}
        for verdict in of.verdicts.values():
            assert verdict.kind not in (Class.CRASHED, Class.NONSENSE)
            if verdict.kind is Class.CONVERGED:
                assert verdict.error <= verdict.bound
    by_label = {of.cell.label: of for of in every}
    assert {v.kind for v in by_label["rod 2 0.5 m"].verdicts.values()} == {Class.REFUSED}
    assert by_label[BASE_LABEL].verdicts[MINIMAL.name].kind is Class.CONVERGED
    runs = tables.frame(every)
    assert len(tables.csv(runs)) == 2 * len(wanted)
    assert tables.counts(runs).count("\n") >= 3
    assert (runs["axis"] != HYPERCUBE).all()
    draw(runs, (LAWS[0],), tmp_path)
    assert "tree" in (tmp_path / "axes.svg").read_text()
