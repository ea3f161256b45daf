"""Orders, fronts and costs at equal error of curves whose answers are known; every method runs its scenes."""

import re
from dataclasses import replace
from math import isnan

import numpy as np
import pandas as pd
import pytest

from comparison.accuracy.plan import plan
from comparison.execution.tasks import measure_all, on_processes
from comparison.studies.shared.formulations import (
    METHODS,
    MINIMAL,
    MINIMAL_SCIPY,
    MULTIPLIERS,
)
from comparison.studies.tradeoff import growth
from comparison.studies.tradeoff.front import asymptotic, cost_at, curve_of, front, observed_order
from comparison.studies.tradeoff.measure import QUANTITIES, Timed, measure
from comparison.studies.tradeoff.methods import SCENES, SWEEPS, WITH_CLEARANCE
from comparison.studies.tradeoff.study import STUDY, Results
from comparison.studies.tradeoff.tables import bounds, orders, ratio_at

STEPS = 2.0 ** -np.arange(8)
X = "slider_x"


def curve(order, factor=1.0, rate=1.0):
    """Errors go with the step's power, costs with its inverse."""
    return points(*((h, 1e-3 * h**order, factor * h**-rate) for h in STEPS))


def points(*rows):
    return pd.DataFrame(rows, columns=["setting", "error", "cost"], dtype=float)


@pytest.mark.parametrize("order", [1.0, 2.0, 5.0])
def test_the_order_of_a_power_is_its_exponent(order):
    assert observed_order(curve(order)) == pytest.approx(order, rel=1e-12)
    assert isnan(observed_order(curve(order)[:2]))


def test_points_too_coarse_and_those_that_gain_nothing_are_not_asymptotic():
    good = curve(2.0)
    assert asymptotic(good, 2.0, X).tolist() == [False] * 5 + [True] * 3  # at most 2e-6
    good["error"] /= 1e3
    assert asymptotic(good, 2.0, X).tolist() == [True] * 8
    stuck = good.assign(error=good["error"].clip(lower=good["error"][4]))
    assert asymptotic(stuck, 2.0, X).tolist() == [True] * 4 + [False] * 4
    assert asymptotic(points(), 1.0, X).tolist() == []
    assert asymptotic(good[:1], 2.0, X).tolist() == [False]
    assert asymptotic(good, 5.0, X).tolist() == [False] * 8  # second order where the fifth is expected
    exact = points((1e-6, 0.0, 1.0), (1e-7, 0.0, 1.0))
    assert asymptotic(exact, 1.0, X).tolist() == [False] * 2


def test_the_front_keeps_what_nothing_beats():
    found = front(points((1, 1e-3, 1.0), (1, 1e-4, 2.0), (1, 2e-4, 3.0), (1, 1e-6, 4.0), (1, 0.0, 5.0)))
    assert found[["error", "cost"]].to_numpy().tolist() == [[1e-3, 1.0], [1e-4, 2.0], [1e-6, 4.0]]


def test_costs_at_equal_error_are_those_of_the_powers_and_nothing_is_extrapolated():
    two, three = curve(2.0), curve(4.0, factor=10.0)
    # error = 1e-3 h^p and cost = f / h.
    assert cost_at(two, 1e-5) == pytest.approx(10.0, rel=1e-9)
    assert cost_at(three, 1e-5) == pytest.approx(10.0 * 100 ** (1 / 4), rel=1e-9)
    assert cost_at(two, 1e-2) == pytest.approx(two["cost"][0])  # the cheapest is more accurate than that
    assert isnan(cost_at(two, 1e-9))
    # A dearer setting that is no better does not count.
    assert cost_at(pd.concat([two, points((1, 1e-4, 1e6))]), 1e-5) == pytest.approx(10.0, rel=1e-9)


def test_every_method_of_the_catalogue_is_measured_and_has_a_name_of_its_own():
    assert {sweep.method for sweep in SWEEPS} == set(METHODS)
    assert len({method.name for method in METHODS}) == len(METHODS)


@pytest.mark.parametrize("sweep", SWEEPS, ids=lambda sweep: sweep.method.name)
def test_every_method_is_a_setting_of_its_scenes_and_only_that(sweep):
    model = sweep.method.model
    assert list(sweep.settings) == sorted(sweep.settings, reverse=True)
    for name in sweep.scenes:
        coarse, fine = (sweep.scene(name, setting).data for setting in sweep.settings[:2])
        assert coarse["solver"][model] != fine["solver"][model]
        assert {k: v for k, v in coarse.items() if k != "solver"} == {
            k: v for k, v in fine.items() if k != "solver"
        }
        made = plan(sweep.scene(name, sweep.settings[0]), model)
        whole = sweep.method.name.startswith(("multipliers", "full"))
        assert made.coordinates == (15 if whole else 2)


def measured(costs, scenes=WITH_CLEARANCE):
    """Rows of some methods: an error of ten times the setting, costs in its power -1/8."""
    return [
        {
            "method": sweep.method.name, "model": sweep.method.model, "scene": scene, "setting": setting,
            "status": "success", "seconds": costs[sweep.method] * setting**-0.125, "evaluations": 1000,
            "errors": dict.fromkeys(QUANTITIES, 10 * setting),
        }
        for scene in scenes
        for sweep in SWEEPS
        if sweep.method in costs and scene in sweep.scenes
        for setting in sweep.settings
    ]  # fmt: skip


def test_ratios_are_taken_at_equal_error_and_failures_are_no_points():
    rows = measured({MINIMAL: 1.0, MULTIPLIERS: 30.0})
    rows[0] |= {"status": "gave up", "errors": {}, "seconds": None}
    base, found = SWEEPS[0], pd.json_normalize(rows)
    assert len(curve_of(found[found["scene"] == WITH_CLEARANCE[0]], base, X)) == len(base.settings) - 1
    ratios = ratio_at(found, WITH_CLEARANCE[1], MULTIPLIERS, MINIMAL).dropna()
    assert len(ratios)
    assert ratios.to_numpy() == pytest.approx(30.0, rel=1e-9)
    assert "1.00 (6 of 7)" in orders(found)  # an error of 1e-5 m is too large to be asymptotic
    assert bounds(found).count("\n") == 1 + 9 * len(WITH_CLEARANCE)


def test_the_cheapest_base_counts_where_there_are_several():
    rows = pd.json_normalize(
        measured({MINIMAL: 1.0, MINIMAL_SCIPY: 5.0, MULTIPLIERS: 30.0}, WITH_CLEARANCE[:1])
    )
    both = ratio_at(rows, WITH_CLEARANCE[0], MULTIPLIERS, MINIMAL_SCIPY, MINIMAL)
    pd.testing.assert_series_equal(both, ratio_at(rows, WITH_CLEARANCE[0], MULTIPLIERS, MINIMAL))
    # The slow base has settings down to 1e-9 alone; finer than that the other one is the only base.
    assert ratio_at(rows, WITH_CLEARANCE[0], MULTIPLIERS, MINIMAL_SCIPY).count() < both.count()


def test_the_ratio_in_long_runs_is_of_the_longest_that_both_have():
    rows = [(MINIMAL.title, n, 0.01 * n) for n in (1.0, 10.0, 100.0)]
    rows += [(MULTIPLIERS.title, n, 0.2 * n) for n in (1.0, 10.0)]
    grown = pd.DataFrame(rows, columns=["method", "cycles", "seconds"]).assign(table="cycles")
    assert growth.ratio_in_long_runs(grown) == pytest.approx((20.0, 10.0))
    assert np.isnan(growth.ratio_in_long_runs(grown[:3])).all()


def test_a_measured_run_has_its_errors_against_the_exact_one(tmp_path, monkeypatch):
    monkeypatch.setenv("SIXBAR_CACHE_DIR", str(tmp_path))
    sweep, name = SWEEPS[0], WITH_CLEARANCE[0]

    def rows_of(*settings):
        tasks = [Timed("reference", sweep.scene(name, setting), 3, 0.5, name) for setting in settings]
        return measure_all(measure, tasks, on_processes(1))

    rows = rows_of(1e-6, 1e-9)
    assert all(found["status"] == "success" for found in rows)
    # A thousandth of the tolerance; single runs scatter around their line by a factor of up to 10 either way.
    assert 0 < rows[1]["errors"]["slider_x"] < 1e-1 * rows[0]["errors"]["slider_x"]
    assert rows[1]["errors"]["impulse"] < rows[0]["errors"]["impulse"]
    assert rows[0]["evaluations"] < rows[1]["evaluations"]
    assert rows_of(1e-6, 1e-9) == rows  # cached
    (bad,) = rows_of(1.0)
    assert "must be" in bad["status"]
    assert bad["seconds"] is None


def test_the_page_shows_tables_drawings_and_failures(tmp_path):
    rows = measured(dict.fromkeys(METHODS, 1.0), SCENES)
    rows[0] |= {"status": "gave up", "seconds": None, "evaluations": None, "errors": {}}
    of = {"method": MINIMAL.title, "scene": WITH_CLEARANCE[0], "channels": "motion"}
    run = {"cycles": 10.0, "seconds": 0.05, "contacts": 500}
    grown = [{"table": table} | of | run for table in ("cycles", "contacts", "channels")]
    study = replace(STUDY, measure=lambda config, *_: Results(config, rows, grown, [1e-12, 1e-12]))
    text = study.write(tmp_path, 1, None).read_text("utf-8")
    assert not re.search(r"\{\w*\}|\bnan\b", text)
    pictures = re.findall(r"\]\(([\w.-]+\.svg)\)", text)
    assert len(pictures) == 6
    assert {path.name for path in tmp_path.iterdir()} == {"README.md", "tradeoff.json", *pictures}
    assert re.search(r"^- reference, multipliers, DOP853, ideal, 1e-06: gave up$", text, re.MULTILINE)
    assert ">multipliers, DOP853 (-1)<" in (tmp_path / "ideal-seconds.svg").read_text("utf-8")
