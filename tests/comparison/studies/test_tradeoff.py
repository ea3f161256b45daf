"""Costs at equal error of curves whose answers are known, bounds of named settings, the page."""

import tomllib
from math import isnan

import numpy as np
import pandas as pd
import pytest

from comparison.accuracy.levels import NAMES
from comparison.execution.tasks import measure_all, on_processes
from comparison.studies import tradeoff as study
from comparison.studies.shared.scenes import MINIMAL, MINIMAL_SCIPY, MULTIPLIERS
from comparison.studies.tradeoff import SWEEPS, cost_at, front, measure

SCENE = "300rpm-0.2mm"


def curve(order, factor=1.0):
    """Errors go with the step's power, costs with its inverse."""
    rows = [(1e-3 * h**order, factor / h) for h in 2.0 ** -np.arange(8)]
    return pd.DataFrame(rows, columns=["error", "seconds"])


def test_costs_at_equal_error_are_those_of_the_powers_and_nothing_is_extrapolated():
    rows = [(1e-3, 1.0), (1e-4, 2.0), (1e-4, 2.0), (1e-4, 2.5), (2e-4, 3.0), (1e-6, 4.0)]
    points = pd.DataFrame(rows, columns=["error", "seconds"])  # equal points once
    assert front(points).to_numpy().tolist() == [[1e-3, 1.0], [1e-4, 2.0], [1e-6, 4.0]]
    two, four = curve(2.0), curve(4.0, factor=10.0)
    # error = 1e-3 h^p and cost = f / h.
    assert cost_at(two, 1e-5) == pytest.approx(10.0, rel=1e-9)
    assert cost_at(four, 1e-5) == pytest.approx(10.0 * 100 ** (1 / 4), rel=1e-9)
    assert cost_at(two, 1e-2) == pytest.approx(two["seconds"][0])  # the cheapest is more accurate than that
    assert isnan(cost_at(two, 1e-9))


def test_ratios_are_taken_at_equal_error_and_failures_are_no_points():
    """Errors are ten times the setting, and costs go with its power -1/8."""
    costs = dict.fromkeys(SWEEPS, 1.0) | {MINIMAL_SCIPY: 5.0, MULTIPLIERS: 30.0}
    labels = ("method", "model", "scene", "setting")
    rows = [
        dict(zip(labels, (method.name, method.model, scene, setting), strict=True))
        | {"status": "success", "seconds": costs[method] * setting**-0.125, "evaluations": 1000}
        | {"error": 10 * setting}
        for scene in study.SCENES
        for method in costs
        for setting in SWEEPS[method]
    ]
    rows[0] |= {"status": "gave up", "error": None, "seconds": None}
    frame = pd.DataFrame(rows)
    assert len(study.curve_of(frame, MINIMAL, next(iter(study.SCENES)))) == len(SWEEPS[MINIMAL]) - 1
    table = study.ratios(frame).set_index(["cost of", "scene"])
    ratios = table.loc[(MULTIPLIERS.title, study.SCENES[SCENE]), list(study.ERRORS)]
    assert ratios.astype(float).to_numpy() == pytest.approx(30.0, rel=1e-9)
    # 1e-9 m is out of reach of scipy's DOP853, whose settings end at 1e-9.
    assert study.costs(frame, SCENE).loc[MINIMAL_SCIPY.title].isna().tolist() == [False] * 4 + [True]


def test_a_bound_is_three_times_the_largest_error_and_no_less_than_that_of_a_finer_setting():
    assert study.error_bounds([1.11e-6, 1e-9, 3e-9], 1e-12) == [3.4e-6, 9e-9, 9e-9]
    assert study.error_bounds([1e-6, 1e-9, 1e-13], 1e-10) == [3e-6, 3e-9, 3e-10]
    labels = {"model": "reference", "scene": "a", "cycles": 0.5}
    rows = [
        labels | {"formulation": name, "accuracy": each, "seconds": seconds, "error": error}
        for name, errors in (("minimal", (1e-6, 1e-9, 1e-13)), ("tree", (1e-7, 1e-9, 1e-10)))
        for seconds, share in ((2.0, 1.0), (3.0, 0.5))
        for each, error in zip(NAMES, np.multiply(errors, share), strict=True)
    ]
    table = tomllib.loads(study.settings_toml(rows))
    assert table["a"]["minimal"] == {"error": [3e-6, 3e-9, 3e-10], "seconds": [4.0] * 3}
    assert table["a"]["tree"]["error"] == [3e-7, 3e-9, 3e-10]


@pytest.mark.usefixtures("empty_cache")
def test_a_measured_run_has_its_error_against_the_exact_one():
    scene = study.first_cycle(SCENE).variant({"drive.cycles": 1.0, "output.groups": []})
    tasks = [
        study.TimedRun(SCENE, 0, "reference", "minimal", scene.variant({"solver.reference.tolerance": value}))
        for value in (1e-6, 1e-9)
    ]
    coarse, fine = measure_all(measure, tasks, on_processes(1))
    # A thousandth of the tolerance; single runs scatter around their line by a factor of up to 10 either way.
    assert 0 < fine["error"] < 1e-1 * coarse["error"]
    assert coarse["evaluations"] < fine["evaluations"]
