"""Judgements of two solvers of small systems whose right answer is known."""

import subprocess
import sys
from math import nan

import numpy as np
import pandas as pd
import pytest
from scipy.integrate import solve_ivp

import sixbar
from comparison.accuracy.uncertainty import RunValues, uncertainty
from comparison.tables.table import TableError
from comparison.verdict.results import Basis, Doubt


def solver(rates, start, times, method="DOP853", **options):
    """Return a side that integrates a system from a start whose first states can be moved."""

    def run(tolerance, offsets):
        y = np.array(start, dtype=float)
        y[: offsets.size] += offsets
        span = times[0], times[-1]
        solved = solve_ivp(rates, span, y, method, times, rtol=tolerance, atol=tolerance, **options)
        return pd.DataFrame({"time": times} | {f"y{n}": row for n, row in enumerate(solved.y)})

    return run


def oscillator(rate=1.0):
    return lambda _, y: [y[1], -rate * y[0]]


OSCILLATION = {"start": [1.0, 0.0], "times": np.linspace(0, 20, 401)}


def test_equal_systems_agree_to_the_end_and_a_changed_parameter_is_confirmed():
    a = solver(oscillator(), **OSCILLATION)
    same, other = (solver(oscillator(rate), method="LSODA", **OSCILLATION) for rate in (1.0, 1.00001))
    result = sixbar.judge(a, same, tolerance=(1e-8, 1e-9), states=2)
    assert (result.verdict, result.until, result.exit_code, result.refined) == ("agree", 20.0, 0, 0)
    result = sixbar.judge(a, other, tolerance=1e-8, states=2)
    assert (result.verdict, result.confirmation.outcome, result.refined) == ("differ", "confirmed", 1)
    assert result.confirmation.members == (30, 30)
    # A channel may be decided by its largest uncertainty; its predictable samples count all the same.
    by_largest = sixbar.judge(
        a, solver(oscillator(1.001), method="RK45", **OSCILLATION), tolerance=1e-8, states=2
    )
    assert Basis.LARGEST in {channel.basis for channel in by_largest.channels.values()}
    assert by_largest.coverage == np.mean([channel.coverage for channel in by_largest.channels.values()])
    without = sixbar.judge(a, other, tolerance=1e-8)
    assert (without.verdict, without.confirmation.doubt) == ("differ", Doubt.NO_STARTS)


def test_a_scale_and_a_window_are_stated():
    wide = sixbar.judge(decay, decay, tolerance=1e-6, states=1, scale={"y0": 40.0}, window=0.5)
    assert (wide.channels["y0"].scale, wide.window) == (40.0, 0.5)


def test_processes_give_the_same_bits():
    runs = [sixbar.judge(decay, decay, tolerance=(1e-6, 1e-8), states=1, n_jobs=jobs) for jobs in (1, 2)]
    first, second = (run.channels["y0"] for run in runs)
    assert (first.a == second.a).all()
    assert (first.u == second.u).all()


def decay(tolerance, offsets):
    return solver(lambda _, y: -y, [1.0], np.linspace(0, 5, 101))(tolerance, offsets)


@pytest.mark.parametrize("factor", [2.0, 1.7])
@pytest.mark.parametrize("step", [2e-3, 1e-3, 5e-4, 2e-4])
def test_a_ball_that_bounces_at_the_ends_of_fixed_steps(step, factor):
    """Both err at first order alike, and by far more than by their three nested steps: no difference."""
    result = sixbar.judge(ball("y += v h"), ball("y += v h - g h^2 / 2"), step=step, factor=factor, states=2)
    assert result.verdict == "agree"
    assert result.channels["y"].coverage > 0.4
    if (step, factor) == (2e-3, 2.0):
        assert result.refined == 1  # three levels alone would differ


def ball(method, gravity=9.81, restitution=0.8, end=2.5):
    """Return a side without location of impacts: the velocity turns round after the first step below."""

    def run(step, offsets):
        y, v = np.array([1.0, 0.0]) + np.pad(offsets, (0, 2 - offsets.size))
        rows = [(0.0, y, v)]
        while rows[-1][0] < end:
            v -= gravity * step
            y += v * step if method == "y += v h" else v * step + gravity * step**2 / 2
            if y < 0.0 and v < 0.0:
                y, v = (-restitution * y if method == "y += v h" else 0.0), -restitution * v
            rows.append((rows[-1][0] + step, y, v))
        time, (t, *columns) = np.linspace(0, end, 501), np.transpose(rows)
        y, v = (np.interp(time, t, column) for column in columns)
        return pd.DataFrame({"time": time, "y": y, "v": v})

    return run


def test_another_restitution_of_such_a_ball_is_a_difference():
    a, b = ball("y += v h"), ball("y += v h - g h^2 / 2", restitution=0.75)
    result = sixbar.judge(a, b, step=5e-4, states=2)
    assert (result.verdict, result.confirmation.outcome, result.refined) == ("differ", "confirmed", 2)
    # A fall from 1 m takes 0.45 s, and the rebound is the first that can differ.
    assert result.confirmation.since == pytest.approx(np.sqrt(2 / 9.81), abs=0.02)


def test_a_cart_alone_that_is_moved_does_not_show_how_its_pendulum_falls():
    """Of an inverted pendulum on a cart, whose fall rounding decides, the cart's position is cyclic."""

    def rates(_, y, gravity=9.81, length=0.5, mass=0.3):
        phi, v, w = y[1:]
        s, c = np.sin(phi), np.cos(phi)
        pull = mass * s * (length * w**2 - gravity * c) / (1.0 + mass * s**2)
        return [v, w, pull, (gravity * s - pull * c) / length]

    start = {"start": [0.1, 1e-14, 0.2, 0.0], "times": np.linspace(0, 8, 801)}
    a, b = (solver(rates, method=method, **start) for method in ("DOP853", "LSODA"))
    assert sixbar.judge(a, b, tolerance=1e-6, states=4).verdict == "agree"
    alone = sixbar.judge(a, b, tolerance=1e-6, states=1)
    assert (alone.verdict, alone.confirmation.doubt) == ("differ", Doubt.ONE_STATE)
    assert any("only one state is moved" in warning for warning in alone.warnings)


def test_a_pulse_that_both_skip_is_seen_only_with_a_largest_step_of_one():
    """The stated limit: the true velocity jumps by 0.05 at 7 s, a third of its range."""

    def rates(t, y):
        return [y[1], -0.01 * y[0] + 10.0 * (7.0 <= t < 7.005)]

    options = {"start": [1.0, 0.0], "times": np.linspace(0, 10, 1001)}
    a, b, careful = (
        solver(rates, method=method, max_step=step, **options)
        for method, step in (("DOP853", np.inf), ("LSODA", np.inf), ("LSODA", 1e-3))
    )
    skipped = sixbar.judge(a, b, tolerance=1e-6, states=2)
    assert (skipped.verdict, skipped.until, skipped.coverage) == ("agree", 10.0, 1.0)
    seen = sixbar.judge(a, careful, tolerance=1e-6, states=2)
    assert seen.verdict == "differ"
    assert seen.confirmation.since == pytest.approx(7.0, abs=0.02)


def test_an_order_counts_only_where_it_is_stated():
    """An order that is fitted to the three runs that it judges is theirs by construction."""
    base, distance = np.zeros(50), 1e-6
    levels = {"base": base, "finer": base - distance, "coarser": base + 4 * distance, "factor": 2.0}
    stated = uncertainty(RunValues(order=2.0, **levels), 1, 0.0)
    assert stated == pytest.approx(1.25 * 4 / 3 * distance)
    # 3 of the larger one, of which the coarser run counts as of order 1.
    assert uncertainty(RunValues(order=nan, **levels), 1, 0.0) == pytest.approx(3 * 4 * distance / 2)
    even = levels | {"coarser": base + distance}
    assert uncertainty(RunValues(order=nan, **even), 1, 0.0) == pytest.approx(3 * distance)
    u = [
        sixbar.judge(euler, euler, step=1e-3, **given).channels["y"].u.max() for given in ({}, {"order": 1.0})
    ]
    assert u[0] == pytest.approx(u[1] * 3 / (1.25 * 1.7 / 0.7), rel=1e-2)


def euler(step, _):
    """Return exp(-t) with an error of first order."""
    t = np.linspace(0, 2, 101)
    return pd.DataFrame({"time": t, "y": np.exp(-t) * (1 + step * t)})


def test_a_setting_without_effect_confirms_nothing():
    def fixed(_, offsets):
        return decay(1e-4, offsets)

    result = sixbar.judge(fixed, decay, tolerance=1e-8, states=1)
    assert (result.verdict, result.confirmation.doubt) == ("differ", Doubt.NO_EFFECT)
    assert "fixed: runs at two settings are equal: is the setting used?" in result.warnings


def test_chaotic_motion_agrees_until_it_is_lost_and_demands_are_met_by_that():
    def lorenz(_, y):
        return [10 * (y[1] - y[0]), y[0] * (28 - y[2]) - y[1], y[0] * y[1] - 8 / 3 * y[2]]

    start = {"start": [1.0, 1.0, 1.0], "times": np.linspace(0, 30, 3001)}
    a, b = (solver(lorenz, method=method, **start) for method in ("DOP853", "LSODA"))
    result, enough, more, share = (
        sixbar.judge(a, b, tolerance=1e-8, states=3, **demand)
        for demand in ({}, {"until": 8.0}, {"until": 29.0}, {"coverage": 0.9})
    )
    # An error of 1e-8 grows to 1 % of the range in ln(1e6) / 0.906 = 15 s.
    assert result.until == pytest.approx(15.0, abs=5.0)
    assert [one.verdict for one in (result, enough, more, share)] == ["agree"] * 3 + ["indeterminate"]
    assert [one.exit_code for one in (result, enough, more, share)] == [3, 0, 3, 3]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"tolerance": -1e-8}, "side.a.tolerance = -1e-08 must be > 0"),
        ({}, "side.a must have a tolerance or a step"),
        ({"tolerance": (1e-8, None)}, "side.b must have a tolerance or a step"),
        ({"tolerance": 1e-8, "untl": 3.0}, "untl is not a known key"),
        ({"tolerance": 1e-8, "mapping": 3}, "mapping = 3 must be"),
        ({"tolerance": 1e-8, "size": "small"}, "start.size = 'small' must be a number"),
        ({"tolerance": 1e-8, "scale": {"y1": 1.0}}, "scale.y1: 'y1' is not a channel"),
        ({"tolerance": 1e-8, "factor": 1.0}, "side.a.factor = 1.0 must be > 1"),
    ],
)
def test_a_wrong_option_is_refused_in_one_line(options, message):
    with pytest.raises(TableError, match=r"^[^\n]+$") as refusal:
        sixbar.judge(decay, decay, **options)
    assert message in str(refusal.value)


@pytest.mark.parametrize(
    ("result", "message"),
    [
        (lambda: 1 / 0, "other, tolerance 1e-08: ZeroDivisionError: division by zero"),
        (lambda: [1.0], "other: must be a path, a table or a pandas data frame, not of type list"),
        (lambda: "a.csv", "other: must return a pandas data frame, not a path"),
        (lambda: decay(1e-8, np.zeros(1)).iloc[:50], "decay spans 0 to 5 s and other 0 to 2.45 s"),
    ],
)
def test_a_function_that_fails_is_named(result, message):
    def other(*_):
        return result()

    with pytest.raises(TableError, match=r"^[^\n]+$") as refusal:
        sixbar.judge(decay, other, tolerance=1e-8)
    assert message in str(refusal.value)


def test_neither_judge_nor_compare_loads_a_model():
    code = """
import sys, numpy, pandas, sixbar
t = numpy.linspace(0, 1, 99)
run = lambda tolerance, start: pandas.DataFrame({"time": t, "y": t**2 * (1 + tolerance)})
a, b = sixbar.judge(run, run, tolerance=1e-6), sixbar.compare(run(0, 0), run(0, 0), tolerance=1e-3)
print(a.verdict, b.verdict)
print([name for name in ("exudyn", "numba", "exudyn_model", "reference_model") if name in sys.modules])
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "agree agree\n[]\n"


def test_a_solver_that_ignores_the_start_is_said_and_a_state_of_no_column_refused():
    """Without moved starts the motions do not diverge, and `until` would be later than it is."""

    def rates(_, y):
        return [y[1], -np.sin(y[0])]

    options = {"start": [1.0, 0.0], "times": np.linspace(0, 10, 201)}
    a, b = (solver(rates, method=method, **options) for method in ("DOP853", "LSODA"))
    fixed = sixbar.judge(lambda tol, start: a(tol, 0 * start), b, tolerance=1e-7, states=2)
    assert any("a moved start changes nothing" in warning for warning in fixed.warnings)
    moving = sixbar.judge(a, b, tolerance=1e-7, states=2)
    assert not any("changes nothing" in warning for warning in moving.warnings)
    with pytest.raises(TableError, match="states: 'phi' is not a column of a, which has"):
        sixbar.judge(lambda tol, start: a(tol, 0 * start), b, tolerance=1e-7, states="phi")
