"""Whether a user is told of a run that errs more than its bound; limits in units of a benchmark."""

from __future__ import annotations

import math

import numpy as np
import pytest

from comparison.scene import load_scene
from comparison.studies.extremes import runs
from comparison.studies.extremes.campaign import CellOutcome
from comparison.studies.extremes.cells import BASE_LABEL, LAWS, Cell
from comparison.studies.extremes.checks import check, estimate, warned
from comparison.studies.extremes.formulations import MINIMAL
from comparison.studies.extremes.runs import LIMIT, CellRun, run_cell
from comparison.studies.extremes.verdicts import Class, judge
from comparison.studies.shared import benchmark_unit

pytestmark = pytest.mark.usefixtures("own_cache")

SCENE = load_scene("150rpm-0.2mm", {"drive.cycles": 1.0, "output.samples_per_cycle": 250})
EXACT = 2e-4 * np.sin(np.linspace(0.0, 2.0 * np.pi, 251))


def row(x, status="success"):
    return {"status": status, "message": "", "x": list(x)}


def test_the_estimate_is_three_times_the_distance_of_levels_out_of_order():
    """Or of neighbouring starts, where that is more; without a finer run there is none."""
    family = {"base": row(EXACT), "finer": row(EXACT + 1e-9)}
    assert estimate(family, SCENE, "reference") == pytest.approx(3e-9, rel=1e-6)
    family |= {"coarser": row(EXACT), "perturbed": row(EXACT + 5e-9), "other_perturbed": row(EXACT)}
    assert estimate(family, SCENE, "reference") == pytest.approx(15e-9, rel=1e-6)
    # They are beside the coarser run: without its motion their distance from another one says nothing
    family["coarser"] = row([], "bad input")
    assert estimate(family, SCENE, "reference") == pytest.approx(3e-9, rel=1e-6)
    family["finer"] = row([], "work-limit")
    assert math.isnan(estimate(family, SCENE, "reference"))


@pytest.mark.parametrize(
    ("found", "told"),
    [({}, False), ({"steps_per_contact": 9.9}, True), ({"steps_per_contact": 10.0}, False),
     ({"energy_share": 0.011}, True), ({"constraint_m": 1.1e-6}, True), ({"energy_share": None}, False)],
)  # fmt: skip
def test_what_sixbar_run_warns_of_is_told(found, told):
    assert warned(row(EXACT) | found) is told


@pytest.mark.parametrize(("bound", "kind"), [(1e-12, Class.ANNOUNCED), (1e-5, Class.DEGRADED)])
def test_a_degraded_run_is_announced_if_its_check_exceeds_the_bound(bound, kind):
    """The check of a coarse run of the base scene, by its runs: it errs by some 1e-8 m."""
    coarse = {"solver.reference.tolerance": 1e-8}
    of = CellOutcome(Cell("tolerance", BASE_LABEL, LAWS[0], (MINIMAL,), {}, coarse))
    scene = of.cell.scene.with_values({**MINIMAL.changes, **of.cell.settings})
    done = {"status": "success"} | run_cell(CellRun(scene, "reference"), lambda _: None)
    of.rows = {MINIMAL.name: done | {"limit": LIMIT}}
    exact = {"strict": done | {"x": list(np.asarray(done["x"]) + 2.0 * bound)}}
    of.verdicts = {MINIMAL.name: judge(done, exact, bound)}
    assert of.verdicts[MINIMAL.name].kind is Class.DEGRADED
    check([of], 1, None)
    assert of.verdicts[MINIMAL.name].kind is kind
    assert 1e-10 < of.estimates[MINIMAL.name] < 1e-5


def test_the_limit_is_a_multiple_of_what_the_benchmark_takes(monkeypatch):
    """On a machine that is a million times as fast a run has a millionth of the time."""
    scene = load_scene("150rpm-0.2mm", {"drive.cycles": 20.0})
    for unit, ended in ((1e-9, True), (1e3, False)):
        monkeypatch.setattr(runs, "unit_seconds", lambda unit=unit: unit)
        assert runs.out_of_time(run_cell(CellRun(scene, "reference"), lambda _: None)) is ended


def test_the_unit_is_the_least_of_its_repeats(monkeypatch):
    times = iter([0.03, 0.02, 0.05, *[0.04] * benchmark_unit.REPEATS])
    monkeypatch.setattr(benchmark_unit, "_seconds", lambda _: next(times))
    assert benchmark_unit.unit_seconds.__wrapped__() == 0.02


def test_the_benchmark_bounces_between_its_walls():
    """It ends between them, less than the 5 um deep that 0.1 m/s reaches; and not where it began."""
    x = benchmark_unit._compiled()(benchmark_unit.STEPS)
    assert 0.0 < abs(x) < 1.05e-4
