"""Orders, fronts and costs at equal error of curves whose answers are known; every method runs its scenes."""

from dataclasses import replace
from math import isnan

import numpy as np
import pytest

from comparison.accuracy.plan import plan
from comparison.studies.tradeoff import growth, measure
from comparison.studies.tradeoff.front import Point, asymptotic, cost_at, front, observed_order
from comparison.studies.tradeoff.methods import LOOSE, METHODS
from comparison.studies.tradeoff.study import orders, points, promises, ratio_at

STEPS = 2.0 ** -np.arange(8)


def curve(order, factor=1.0, rate=1.0):
    """Errors go with the step's power, costs with its inverse."""
    return [Point(h, 1e-3 * h**order, factor * h**-rate) for h in STEPS]


@pytest.mark.parametrize("order", [1.0, 2.0, 5.0])
def test_the_order_of_a_power_is_its_exponent(order):
    assert observed_order(curve(order)) == pytest.approx(order, rel=1e-12)
    assert isnan(observed_order(curve(order)[:2]))


def test_points_too_coarse_and_those_that_gain_nothing_are_not_asymptotic():
    good = curve(2.0)
    assert asymptotic(good, 2.0, 1.0) == [True] * 8
    assert asymptotic(good, 2.0, 1e-4) == [False] * 2 + [True] * 6
    stuck = [*good[:5], *(Point(p.setting, good[4].error, p.cost) for p in good[5:])]
    assert asymptotic(stuck, 2.0, 1.0) == [True] * 4 + [False] * 4
    assert asymptotic([], 1.0, 1.0) == []
    assert asymptotic(good[:1], 2.0, 1.0) == [False]
    assert asymptotic(good, 5.0, 1.0) == [False] * 8  # a second-order curve that promises the fifth


def test_the_front_keeps_what_nothing_beats():
    found = front([Point(1, 1e-3, 1.0), Point(1, 1e-4, 2.0), Point(1, 2e-4, 3.0), Point(1, 1e-6, 4.0)])
    assert [(p.error, p.cost) for p in found] == [(1e-3, 1.0), (1e-4, 2.0), (1e-6, 4.0)]


def test_costs_at_equal_error_are_those_of_the_powers_and_nothing_is_extrapolated():
    two, three = curve(2.0), curve(4.0, factor=10.0)
    # error = 1e-3 h^p and cost = f / h.
    assert cost_at(two, 1e-5) == pytest.approx(10.0, rel=1e-9)
    assert cost_at(three, 1e-5) == pytest.approx(10.0 * 100 ** (1 / 4), rel=1e-9)
    assert cost_at(two, 1e-2) == two[0].cost  # the cheapest is more accurate than that
    assert isnan(cost_at(two, 1e-9))
    # A dearer setting that is no better does not count.
    assert cost_at([*two, Point(1, 1e-4, 1e6)], 1e-5) == pytest.approx(10.0, rel=1e-9)


@pytest.mark.parametrize("method", METHODS, ids=lambda method: f"{method.model} {method.name}")
def test_every_method_is_a_setting_of_its_scenes_and_only_that(method):
    assert list(method.settings) == sorted(method.settings, reverse=True)
    for name in method.scenes:
        coarse, fine = (method.scene(name, setting).data for setting in method.settings[:2])
        assert coarse["solver"][method.model] != fine["solver"][method.model]
        assert {k: v for k, v in coarse.items() if k != "solver"} == {
            k: v for k, v in fine.items() if k != "solver"
        }
        made = plan(method.scene(name, method.settings[0]), method.model)
        whole = "multipliers" in method.name or "five bodies" in method.name
        assert made.coordinates == (15 if whole else 2)


def row(method, scene, setting, error, seconds):
    found = {"slider_x": error, "slider_y_error": error, "impulse": error, "peak_force": error}
    return {
        "method": method.name, "model": method.model, "scene": scene, "setting": setting, "status": "success",
        "seconds": seconds, "evaluations": 1000, "errors": found,
    }  # fmt: skip


def test_ratios_are_taken_at_equal_error_and_failures_are_no_points():
    base, other = METHODS[0], METHODS[5]
    rows = [
        row(m, scene, s, 10 * s, cost * s**-0.125)
        for scene in LOOSE
        for m, cost in ((base, 1.0), (other, 30.0))
        for s in m.settings
    ]
    rows[0] |= {"status": "gave up", "errors": {}, "seconds": None}
    assert len(points(rows, base, LOOSE[0])) == len(base.settings) - 1
    ratios = ratio_at(rows, LOOSE[1], other.name, base.name)
    assert ratios
    assert all(ratio == pytest.approx(30.0, rel=1e-9) for ratio in ratios.values())
    assert "1.00 (6 of 7)" in orders(rows)  # an error of 1e-5 m is none that falls as promised
    assert promises(rows).count("\n") == 1 + 9 * len(LOOSE)


def test_the_cheapest_base_counts_where_there_are_several():
    base, slow, other = METHODS[0], METHODS[1], METHODS[5]
    rows = [
        row(m, LOOSE[0], s, 10 * s, cost * s**-0.125)
        for m, cost in ((base, 1.0), (slow, 5.0), (other, 30.0))
        for s in m.settings
    ]
    both = ratio_at(rows, LOOSE[0], other.name, slow.name, base.name)
    assert both == pytest.approx(ratio_at(rows, LOOSE[0], other.name, base.name))
    # The slow base has settings down to 1e-9 alone; finer than that the other one is the only base.
    assert len(ratio_at(rows, LOOSE[0], other.name, slow.name)) < len(both)


def test_the_ratio_in_long_runs_is_of_the_longest_that_both_have():
    rows = [(growth.PLANNED, n, 0.01 * n, 1) for n in (1.0, 10.0, 100.0)]
    rows += [(growth.MULTIPLIERS, n, 0.2 * n, 1) for n in (1.0, 10.0)]
    assert growth.ratio_in_long_runs(rows) == pytest.approx((20.0, 10.0))
    assert np.isnan(growth.ratio_in_long_runs(rows[:3])).all()


def test_a_measured_run_has_its_errors_against_the_exact_one(tmp_path, monkeypatch):
    monkeypatch.setenv("SIXBAR_CACHE_DIR", str(tmp_path))
    method = replace(METHODS[0], scenes=("150rpm-0.2mm",), settings=(1e-6, 1e-9))
    rows = measure.measured(None, (method,))
    assert all(found["status"] == "success" for found in rows)
    # A thousandth of the tolerance; single runs scatter around their line by a factor of up to 10 either way.
    assert 0 < rows[1]["errors"]["slider_x"] < 1e-1 * rows[0]["errors"]["slider_x"]
    assert rows[1]["errors"]["impulse"] < rows[0]["errors"]["impulse"]
    assert rows[0]["evaluations"] < rows[1]["evaluations"]
    assert measure.measured(None, (method,)) == rows  # kept
    (bad,) = measure.measured(None, (replace(method, settings=(1.0,)),))
    assert "must be" in bad["status"]
    assert bad["seconds"] is None
