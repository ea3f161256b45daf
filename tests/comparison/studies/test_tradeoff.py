"""Orders, fronts and costs at equal error of curves whose answers are known; every method runs its scenes."""

import re
from math import isnan

import numpy as np
import pandas as pd
import pytest

from comparison.accuracy.levels import plan
from comparison.execution.tasks import measure_all, on_processes
from comparison.studies.shared.scenes import METHODS, MINIMAL, MINIMAL_SCIPY, MULTIPLIERS
from comparison.studies.tradeoff import study
from comparison.studies.tradeoff.measure import CHIEF, SWEEPS, WITH_CLEARANCE, Timed, measure
from comparison.studies.tradeoff.study import asymptotic, cost_at, front

ERRORS = ("slider_x", "slider_y_error", "impulse", "peak_force", "crank_torque")


def points(*rows):
    return pd.DataFrame(rows, columns=["setting", "error", "cost"], dtype=float)


def curve(order, factor=1.0):
    """Errors go with the step's power, costs with its inverse."""
    return points(*((h, 1e-3 * h**order, factor / h) for h in 2.0 ** -np.arange(8)))


def test_points_too_coarse_and_those_that_gain_nothing_are_not_asymptotic():
    good = curve(2.0)
    assert asymptotic(good, 2.0).tolist() == [False] * 5 + [True] * 3  # at most 2e-6
    good["error"] /= 1e3
    assert asymptotic(good, 2.0).tolist() == [True] * 8
    stuck = good.assign(error=good["error"].clip(lower=good["error"][4]))
    assert asymptotic(stuck, 2.0).tolist() == [True] * 4 + [False] * 4
    assert asymptotic(points(), 1.0).tolist() == []
    assert asymptotic(good[:1], 2.0).tolist() == [False]
    assert asymptotic(good, 5.0).tolist() == [False] * 8  # second order where the fifth is expected
    assert asymptotic(points((1e-6, 0.0, 1.0), (1e-7, 0.0, 1.0)), 1.0).tolist() == [False] * 2


def test_costs_at_equal_error_are_those_of_the_powers_and_nothing_is_extrapolated():
    result = front(points((1, 1e-3, 1.0), (1, 1e-4, 2.0), (1, 2e-4, 3.0), (1, 1e-6, 4.0), (1, 0.0, 5.0)))
    assert result[["error", "cost"]].to_numpy().tolist() == [[1e-3, 1.0], [1e-4, 2.0], [1e-6, 4.0]]
    two, four = curve(2.0), curve(4.0, factor=10.0)
    # error = 1e-3 h^p and cost = f / h.
    assert cost_at(two, 1e-5) == pytest.approx(10.0, rel=1e-9)
    assert cost_at(four, 1e-5) == pytest.approx(10.0 * 100 ** (1 / 4), rel=1e-9)
    assert cost_at(two, 1e-2) == pytest.approx(two["cost"][0])  # the cheapest is more accurate than that
    assert isnan(cost_at(two, 1e-9))
    # A dearer setting that is no better does not count.
    assert cost_at(pd.concat([two, points((1, 1e-4, 1e6))]), 1e-5) == pytest.approx(10.0, rel=1e-9)


def test_every_method_is_a_setting_of_its_scenes_and_only_that():
    assert {sweep.method for sweep in SWEEPS} == set(METHODS)
    assert len({method.name for method in METHODS}) == len(METHODS) == 11
    for sweep, name in ((each, name) for each in SWEEPS for name in each.scenes):
        assert list(sweep.settings) == sorted(sweep.settings, reverse=True)
        coarse, fine = (sweep.scene(name, setting).data for setting in sweep.settings[:2])
        assert {key for key in coarse if coarse[key] != fine[key]} == {"solver"}
        made = plan(sweep.scene(name, sweep.settings[0]), sweep.method.model)
        assert made.coordinates == (15 if sweep.method.name.startswith(("multipliers", "full")) else 2)


def measured(costs, scenes=WITH_CLEARANCE):
    """Rows of some methods: an error of ten times the setting, costs in its power -1/8."""
    return [
        {
            "method": sweep.method.name, "model": sweep.method.model, "scene": scene, "setting": setting,
            "status": "success", "seconds": costs[sweep.method] * setting**-0.125, "evaluations": 1000,
            "errors": dict.fromkeys(ERRORS, 10 * setting),
        }
        for scene in scenes
        for sweep in SWEEPS
        if sweep.method in costs and scene in sweep.scenes
        for setting in sweep.settings
    ]  # fmt: skip


def test_ratios_are_taken_at_equal_error_and_failures_are_no_points(monkeypatch):
    rows = measured({MINIMAL: 1.0, MINIMAL_SCIPY: 5.0, MULTIPLIERS: 30.0})
    rows[0] |= {"status": "gave up", "errors": {}, "seconds": None}
    frame = pd.json_normalize(rows)
    assert len(study.curve_of(frame, SWEEPS[0], WITH_CLEARANCE[0])) == len(SWEEPS[0].settings) - 1
    # Of several bases the cheapest counts. The slow one has settings down to 1e-9 alone.
    bases = [(MINIMAL,), (MINIMAL_SCIPY,), (MINIMAL_SCIPY, MINIMAL)]
    monkeypatch.setattr(study, "RATIOS", [(MULTIPLIERS, str(n), base) for n, base in enumerate(bases)])
    table = study.ratios(frame).set_index("over that of")
    ratios = table.loc[table["scene"] == study.TITLES[WITH_CLEARANCE[1]], list(study.EQUAL)].to_numpy()
    assert ratios[::2] == pytest.approx(np.full((2, len(study.EQUAL)), 30.0), rel=1e-9)
    assert ratios[1] == pytest.approx([6.0] * (len(study.EQUAL) - 1) + [np.nan], rel=1e-9, nan_ok=True)
    # An error of 1e-5 m is too large to be asymptotic.
    first = study.orders(frame).iloc[1]
    assert (first["observed"], first["asymptotic"], first["settings"]) == (pytest.approx(1.0), 6, 7)
    named = study.settings(frame).dropna(subset=["accuracy"])
    assert len(named) == 3 * len(WITH_CLEARANCE)
    assert (named["bound_of_x_m"] > 0).all()


def test_the_ratio_in_long_runs_is_of_the_longest_that_both_have():
    rows = [(MINIMAL.title, n, 0.01 * n) for n in (1.0, 10.0, 100.0)]
    rows += [(MULTIPLIERS.title, n, 0.2 * n) for n in (1.0, 10.0)]
    grown = pd.DataFrame(rows, columns=["method", "cycles", "seconds"]).assign(table="cycles")
    assert study.ratio_in_long_runs(grown) == pytest.approx((20.0, 10.0))
    assert np.isnan(study.ratio_in_long_runs(grown[:3])).all()


def test_a_measured_run_has_its_errors_against_the_exact_one(own_cache):
    del own_cache
    sweep, name = SWEEPS[0], WITH_CLEARANCE[0]
    tasks = [Timed("reference", sweep.scene(name, value), 3, 0.1, name) for value in (1e-6, 1e-9, 1.0)]
    coarse, fine, bad = rows = measure_all(measure, tasks, on_processes(1))
    # A thousandth of the tolerance; single runs scatter around their line by a factor of up to 10 either way.
    assert 0 < fine["errors"]["slider_x"] < 1e-1 * coarse["errors"]["slider_x"]
    assert fine["errors"]["impulse"] < coarse["errors"]["impulse"]
    assert coarse["evaluations"] < fine["evaluations"]
    assert "must be" in bad["status"]
    assert bad["seconds"] is None
    assert measure_all(measure, tasks, on_processes(1)) == rows  # cached


def test_the_page_shows_tables_drawings_and_failures(tmp_path):
    rows = measured(dict.fromkeys(METHODS, 1.0), CHIEF)
    rows[0] |= {"status": "gave up", "seconds": None, "evaluations": None, "errors": {}}
    labels = {"method": MINIMAL.title, "scene": WITH_CLEARANCE[0], "channels": "motion"}
    grown = [{"table": "cycles", "cycles": 10.0, "seconds": 0.05, "contacts": 500} | labels]
    results = study.Results(study.STUDY.small, rows, grown, [1e-12, 1e-12])
    text = study.STUDY.report(results, tmp_path).read_text("utf-8")
    assert not re.search(r"\{\w*\}|\bnan\b", text)
    linked = re.findall(r"\]\(([\w.-]+\.\w+)\)", text)
    assert {path.name for path in tmp_path.iterdir()} == {"README.md", *linked}
    assert sum(name.endswith(".svg") for name in linked) == 6
    assert re.search(r"^- reference, multipliers, DOP853, ideal, 1e-06: gave up$", text, re.MULTILINE)
    assert ">multipliers, DOP853 (-1)<" in (tmp_path / "ideal-seconds.svg").read_text("utf-8")
