"""Cells, classes and causes of the study extremes; a handful of its cells run for real."""

import math
from collections import Counter
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from comparison.scene import load_scene
from comparison.studies.extremes import runs, study
from comparison.studies.extremes.cells import (
    BASE_LABEL,
    COLUMNS,
    FULL,
    HYPERCUBE,
    IMPACT,
    LAWS,
    MINIMAL,
    STRICT,
    TREE,
    Cause,
    Cell,
    Class,
    apart,
    cells,
    check,
    estimate,
    explain,
    judge,
    judged,
    principal,
    rerun,
    run_campaign,
    warned,
)
from comparison.studies.extremes.runs import LIMIT, CellRun, run_cell

pytestmark = pytest.mark.usefixtures("own_cache")

EVERY_CELL = cells(study.STUDY.full.axes, study.STUDY.full.points)
BOUND = 1e-9
EXACT = np.linspace(-2e-4, 2e-4, 11)


def row(x, status="success", **more):
    return {"status": status, "message": "", "x": list(x), **more}


TIGHT = (row(EXACT), row(EXACT + 1e-12))
LATE = {"status": "work-limit", "message": "", "share": 0.3, "limit": LIMIT}


def leaving(at, error):
    return row(EXACT + np.where(np.arange(11) >= at, error, 0.0))


def run(ran, magnified=2.0, method=FULL, cell=1, **known):
    """What became of a run, as the campaign knows it."""
    return {
        "cell": cell, "axis": "axis", "value": "value", "law": LAWS[0], "formulation": method.name,
        "row": ran, "exact": {STRICT: row(EXACT)}, "exact_apart_m": 1e-12, "magnification": magnified,
        "neighbour_m": math.nan, "finer_error_m": math.nan, "finer_class": None, "friction": 0.15,
        "steps_per_contact": ran.get("steps_per_contact"), **judge(ran, TIGHT, BOUND), **known,
    }  # fmt: skip


def erring(error, magnified=2.0, steps=None, **known):
    return run(row(EXACT + error, steps_per_contact=steps), magnified, **known)


def why(of, base=None, *others):
    """Causes of a run beside one of the unchanged scene."""
    explain([(base or erring(0.0, 2.0, 100.0)) | {"cell": 0, "value": BASE_LABEL}, of, *others])
    return of["causes"]


RANGES = {
    "clearance.slider": (1e-9, 5e-3),
    "drive.speed_rpm": (1.0, 6000.0),
    "contact.youngs_modulus": (1e6, 1e13),
    "contact.youngs_modulus.guide": (1e6, 1e13),
    "load.force": (1.0, 1e5),
    "contact.damping": (0.0, 1e6),
    "friction.coefficient": (0.0, 2.0),
    "drive.cycles": (10.0, 10_000.0),
    "solver.exudyn.step": (1e-7, 1e-2),
}


def test_each_cell_is_there_once_and_the_ranges_that_are_asked_for_are_reached():
    assert max(Counter((cell.axis, cell.label, cell.law) for cell in EVERY_CELL).values()) == 1
    for key, ends in RANGES.items():
        values = [float(of[key]) for cell in EVERY_CELL if key in (of := {**cell.changes, **cell.settings})]
        values = [value for value in values if key != "drive.speed_rpm" or value > 0]
        assert (min(values), max(values)) == pytest.approx(ends, rel=0.05)
    laws = Counter(cell.law for cell in EVERY_CELL if cell.axis == HYPERCUBE)
    assert laws.keys() == {*LAWS, IMPACT}
    # Each is a scene; another material of the guide is beside that of the slider.
    for cell in EVERY_CELL:
        assert cell.scene.data["contact"]["law"] == cell.law
        if "contact.youngs_modulus.guide" in cell.changes:
            guide = cell.scene.data["contact"]["youngs_modulus"]["guide"]
            assert guide == cell.changes["contact.youngs_modulus.guide"]


GONE = row([], "step-too-small")
FAR = (row(EXACT), row(EXACT + 1e-6))


@pytest.mark.parametrize(
    ("ran", "exact", "bound", "kind"),
    [
        # Close to both runs that count as exact.
        (leaving(7, 0.9e-9), TIGHT, BOUND, Class.CONVERGED),
        (leaving(7, 1.1e-9), TIGHT, BOUND, Class.DEGRADED),
        *((each, FAR, BOUND, Class.DEGRADED) for each in FAR),
        (row(EXACT), TIGHT, math.nan, Class.DEGRADED),
        (row(EXACT), (GONE, GONE), BOUND, Class.UNCONFIRMED),
        (row(EXACT), (GONE, row(EXACT)), BOUND, Class.CONVERGED),
        (row([], "work-limit", share=0.3), TIGHT, BOUND, Class.STOPPED),
        ({"status": "bad input"}, TIGHT, BOUND, Class.REFUSED),
        ({"status": "crashed"}, TIGHT, BOUND, Class.CRASHED),
        ({"status": "unusable"}, TIGHT, BOUND, Class.NONSENSE),
        (LATE, TIGHT, BOUND, Class.NOT_TESTED),
    ],
)
def test_the_class_of_a_run(ran, exact, bound, kind):
    assert judge(ran, exact, bound)["class"] is kind


def test_a_run_lasts_as_long_as_it_is_within_its_bound():
    judged_run = judge(leaving(7, 1.1e-9), TIGHT, BOUND)
    assert (judged_run["lasted_cycles"], judged_run["error_m"]) == (0.7, pytest.approx(1.1e-9, rel=1e-2))


@pytest.mark.parametrize(
    ("measured", "kind", "told"),
    [
        ({}, Class.CONVERGED, False),
        ({"energy_share": 0.009}, Class.CONVERGED, False),
        ({"energy_share": 0.011}, Class.DEGRADED, True),
        ({"constraint_m": 1.1e-6}, Class.DEGRADED, True),
        ({"steps_per_contact": 9.9}, Class.CONVERGED, True),
        ({"steps_per_contact": 10.0, "energy_share": None}, Class.CONVERGED, False),
    ],
)
def test_what_spoils_a_run_and_what_sixbar_run_warns_of(measured, kind, told):
    assert judge(row(EXACT, **measured), TIGHT, BOUND)["class"] is kind
    assert warned(row(EXACT, **measured)) is told


def test_runs_are_as_far_apart_as_the_farthest_two_that_finished():
    away = row(EXACT + 1e-9 * np.linspace(1.0, 40.0, 11))
    assert apart(row(EXACT), away) == pytest.approx(40e-9, rel=1e-6)
    assert apart(row(EXACT), LATE, row(EXACT - 1e-9), away) == pytest.approx(41e-9, rel=1e-6)
    assert math.isnan(apart(row(EXACT), LATE))


@pytest.mark.parametrize(
    ("of", "causes"),
    [
        (erring(0.0, 2.0, 100.0), []),
        # A hundred times the base's magnification, a thousand times the error bound: within the scatter.
        (erring(1e-6, 200.0, 100.0), [Cause.MAGNIFIED]),
        (erring(2e-6, 200.0, 100.0), [Cause.MAGNIFIED, Cause.UNEXPLAINED]),
        # A fifth of the steps a contact, 25 times the error.
        (erring(2e-7, 2.0, 20.0), [Cause.FEW_STEPS]),
        (erring(3e-7, 2.0, 20.0), [Cause.FEW_STEPS, Cause.UNEXPLAINED]),
        (erring(1.0, 2.0, 3.0), [Cause.FEW_STEPS]),
        (erring(5e-9, 2.0, 100.0), [Cause.SCATTERED]),
        (erring(1.0, law=LAWS[2]), [Cause.LITERAL]),
        # A refined rerun is a cause only where it accounts for the error.
        (erring(2e-6, neighbour_m=2.1e-7), [Cause.UNRESOLVED]),
        (erring(2e-6, neighbour_m=1.9e-7), [Cause.UNEXPLAINED]),
        (erring(2e-6, finer_error_m=9e-7), [Cause.TOO_COARSE]),
        (erring(2e-6, finer_error_m=1.1e-6), [Cause.UNEXPLAINED]),
        (erring(2e-6, finer_class=Class.STOPPED), [Cause.EDGE]),
        (erring(2e-6, exact_apart_m=2 * BOUND), [Cause.STRICT_APART]),
        # Much friction may jam what stopped or was cut off.
        *((run(ended), []) for ended in (LATE, row([], "newton-failed"))),
        *((run(ended, friction=2.0), [Cause.JAMMED]) for ended in (LATE, row([], "newton-failed"))),
        # A refusal is one of the tolerance where a finer one is not refused.
        (run(row([], "bad input")), [Cause.COARSE_TOLERANCE]),
        (run(row([], "bad input"), exact={STRICT: row([], "bad input")}), [Cause.NO_MECHANISM]),
    ],
)
def test_a_cause_is_given_only_where_it_accounts_for_the_error(of, causes):
    assert why(of) == causes


def test_causes_from_other_runs():
    # A formulation that errs as much in the base scene errs by itself.
    assert why(erring(1e-6, 2.0, 100.0), erring(1.5e-6, 2.0, 100.0)) == [Cause.AS_IN_BASE]
    # Those that leave at one instant have one cause.
    left = [run(leaving(6, 1e-6), method=method) for method in (FULL, TREE)]
    assert why(left[0], None, left[1]) == [Cause.TOGETHER]
    assert why(left[0], None, run(row(EXACT), method=TREE)) == [Cause.UNEXPLAINED]
    assert principal([Cause.MAGNIFIED, Cause.UNEXPLAINED]) == "not explained"
    assert principal([]) == ""


def test_the_limit_is_a_multiple_of_what_the_benchmark_takes(monkeypatch):
    """On a machine that is a million times as fast a run has a millionth of the time."""
    scene = load_scene("150rpm-0.2mm", {"drive.cycles": 2.0})
    monkeypatch.setattr(runs, "unit_seconds", lambda: 1e-9)
    cut_off = run_cell(CellRun(scene, "reference"), lambda _: None)
    assert judge(cut_off, TIGHT, BOUND)["class"] is Class.NOT_TESTED


def test_the_estimate_is_three_times_the_distance_of_levels_out_of_order():
    """Or of neighbouring starts, where that is more; without a finer run there is none."""
    scene = load_scene("150rpm-0.2mm", {"drive.cycles": 1.0, "output.samples_per_cycle": 250})
    x = 2e-4 * np.sin(np.linspace(0.0, 2.0 * np.pi, 251))
    family = {"base": row(x), "finer": row(x + 1e-9)}
    assert estimate(family, scene, "reference") == pytest.approx(3e-9, rel=1e-6)
    family |= {"coarser": row(x), "perturbed": row(x + 5e-9), "other_perturbed": row(x)}
    assert estimate(family, scene, "reference") == pytest.approx(15e-9, rel=1e-6)
    # They are beside the coarser run: without its motion their distance from another one says nothing
    family["coarser"] = row([], "bad input")
    assert estimate(family, scene, "reference") == pytest.approx(3e-9, rel=1e-6)
    family["finer"] = LATE
    assert math.isnan(estimate(family, scene, "reference"))


def test_a_degraded_run_is_announced_if_its_check_exceeds_the_bound():
    """The check of a coarse run of the base scene, by its runs: it errs by some 1e-8 m."""
    cell = Cell("tolerance", BASE_LABEL, LAWS[0], (MINIMAL,), {}, {"solver.reference.tolerance": 1e-8})
    done = run_cell(CellRun(cell.scene_of(MINIMAL), "reference"), lambda _: None)
    for bound, kind in ((1e-12, Class.ANNOUNCED), (1e-5, Class.DEGRADED)):
        exact = done | {"x": list(np.asarray(done["x"]) + 2.0 * bound), "status": "success"}
        done |= {"status": "success", "limit": LIMIT, "bound": bound}
        (judged_run,) = judged([cell], {(0, MINIMAL): done, (0, STRICT): exact})
        assert judged_run["class"] is Class.DEGRADED
        check([cell], [judged_run], 1, None)
        assert judged_run["class"] is kind
        assert 1e-10 < judged_run["estimate_m"] < 1e-5


def test_starts_a_hair_apart_are_run_and_the_run_once_more_with_a_finer_setting():
    """In a scene that loses nothing, under the law of a whole side, a hair decides; in the base scene not."""
    of = [
        Cell("restitution", "1", LAWS[1], (MINIMAL,), {"contact.restitution": 1.0}),
        Cell("base", BASE_LABEL, LAWS[0], (MINIMAL,)),
    ]
    strict = [run_cell(CellRun(cell.scene_of(STRICT), "reference"), lambda _: None) for cell in of]
    rows = {(n, STRICT): exact | {"status": "success"} for n, exact in enumerate(strict)}
    rows |= {(n, MINIMAL): row(exact["x"]) | {"bound": 1e-9} for n, exact in enumerate(strict)}
    hair, ordinary = judged(of, rows)
    rerun(of, rows, [hair, ordinary], 1, None)
    assert hair["neighbour_m"] > 1e-10  # a thousand times the hair of 1e-13 m at the least
    # The base scene magnifies it by 8 only, but the bound of either run is 3e-11 m.
    assert 0.0 < ordinary["neighbour_m"] < 1e-10
    assert ordinary["finer_error_m"] < 2.6e-10  # the bound at a tenth of the standard tolerance


def test_some_cells_for_real():
    """Each ends in a class, the refused one with its reason, and the table holds them all."""
    wanted = {("base", BASE_LABEL), ("edge of assembly", "rod 2 0.5 m")}
    chosen = [
        replace(cell, methods=(MINIMAL, TREE))
        for cell in EVERY_CELL
        if (cell.axis, cell.label) in wanted and cell.law == LAWS[0]
    ]
    table = run_campaign(chosen, 1, None).set_index(["value", "formulation"])
    assert set(table.loc["rod 2 0.5 m", "class"]) == {"refused"}
    assert (table.loc["rod 2 0.5 m", "cause"] == Cause.NO_MECHANISM).all()
    assert table.loc[(BASE_LABEL, MINIMAL.name), "class"] == Class.CONVERGED
    good = table[table["class"] == Class.CONVERGED]
    assert (good["error_m"] <= good["bound_m"]).all()
    assert not table["class"].isin([Class.CRASHED, Class.NONSENSE]).any()


def test_the_page_counts_what_was_cut_off_apart_and_names_what_stopped(tmp_path):
    classes = [Class.CONVERGED, Class.ANNOUNCED, Class.STOPPED, Class.NOT_TESTED, Class.REFUSED]
    places = [("base", BASE_LABEL), ("clearance", "1e-09"), ("clearance", "0.005"), (HYPERCUBE, "1")]
    runs_of = [
        {"cell": number, "axis": axis, "value": value, "law": LAWS[0], "formulation": method.name}
        | {"class": str(classes[(number + at) % 5]), "status": "newton-failed", "cause": str(Cause.MAGNIFIED)}
        | dict.fromkeys(("error_m", "estimate_m"), 3e-9)
        | {"bound_m": 1e-9, "magnification": 0.0, "speed_rpm": 10.0, "modulus_Pa": 1e9}
        for number, (axis, value) in enumerate(places)
        for at, method in enumerate((MINIMAL, TREE, FULL))
    ]
    table = pd.DataFrame(runs_of).reindex(columns=["cell", *COLUMNS])
    study.STUDY.report(study.Results(table, {}, {}), tmp_path)
    text = (tmp_path / "README.md").read_text("utf-8")
    assert "Of 12 runs 3 ended at the study's own limit of time and are not tested. Of the other 9: " in text
    assert "reference (clearance 0.005); Exudyn, tree (clearance 1e-09); Exudyn, five bodies (base" in text
    first, _, _ = text.partition("## Appendix")
    assert (first.count("]("), first.count("\n|---|"), first.count(".svg")) == (3, 1, 1)
    assert "| reference, minimal | 1 | 1 | 0 | 1 | 0 | 1 | 4 |" in first
    assert len(pd.read_csv(tmp_path / "cells.csv")) == 12
    assert pd.read_csv(tmp_path / "classes.csv")["cells"].sum() == 4
    drawn = (tmp_path / "axes.svg").read_text("utf-8")
    assert all(text in drawn for text in ("clearance (m)", "reference", "Exudyn, tree", "stopped"))
