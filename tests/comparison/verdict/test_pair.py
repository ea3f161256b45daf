"""Judgements of two solvers of small systems whose right answer is known."""

from math import nan

import numpy as np
import pandas as pd
import pytest
from scipy.integrate import solve_ivp

import sixbar
from comparison.accuracy.uncertainty import RunValues, uncertainty
from comparison.execution.sides import command_side
from comparison.tables.table import TableError
from comparison.verdict.results import Basis, Doubt


def solver(rates, start, times, method="DOP853"):
    """Return a side that integrates a system from a start whose first states can be moved."""

    def run(tolerance, offsets):
        y = np.array(start, dtype=float)
        y[: offsets.size] += offsets
        solution = solve_ivp(rates, (times[0], times[-1]), y, method, times, rtol=tolerance, atol=tolerance)
        return pd.DataFrame({"time": times} | {f"y{n}": row for n, row in enumerate(solution.y)})

    return run


def oscillator(rate=1.0, method="DOP853"):
    return solver(lambda _, y: [y[1], -rate * y[0]], [1.0, 0.0], np.linspace(0, 20, 401), method)


def decay(tolerance, offsets):
    return solver(lambda _, y: -y, [1.0], np.linspace(0, 5, 101))(tolerance, offsets)


def test_equal_systems_agree_to_the_end_and_a_changed_parameter_is_confirmed():
    a, same, other = oscillator(), oscillator(method="LSODA"), oscillator(1.00001, "LSODA")
    result = sixbar.judge(a, same, tolerance=(1e-8, 1e-9), states=2)
    assert (result.verdict, result.until, result.exit_code, result.refined) == ("agree", 20.0, 0, 0)
    result = sixbar.judge(a, other, tolerance=1e-8, states=2)
    assert (result.verdict, result.confirmation.outcome, result.refined) == ("differ", "confirmed", 1)
    assert result.confirmation.members == (30, 30)
    # A channel may be decided by its largest uncertainty; its predictable samples count all the same.
    by_largest = sixbar.judge(a, oscillator(1.001, "RK45"), tolerance=1e-8, states=2)
    assert Basis.LARGEST in {channel.basis for channel in by_largest.channels.values()}
    assert by_largest.coverage == np.mean([channel.coverage for channel in by_largest.channels.values()])
    without = sixbar.judge(a, other, tolerance=1e-8)
    assert (without.verdict, without.confirmation.doubt) == ("differ", Doubt.NO_STARTS)


@pytest.mark.parametrize(("step", "factor", "levels"), [(2e-3, 2.0, 1), (1e-3, 1.7, 0)])
def test_a_ball_that_bounces_at_the_ends_of_fixed_steps(step, factor, levels):
    """Both err alike at first order, by far more than three nested steps show: no difference."""
    result = sixbar.judge(ball("y += v h"), ball("y += v h - g h^2 / 2"), step=step, factor=factor, states=2)
    assert result.verdict == "agree"
    assert result.channels["y"].coverage > 0.3  # measured 0.34: once its runs have parted u counts ten times
    assert result.refined >= levels  # three levels alone would differ


def ball(method, restitution=0.8, gravity=9.81, end=2.5):
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


@pytest.mark.parametrize(("last", "verdict"), [(3e-10, "agree"), (0.0, "differ")])
def test_a_difference_must_outlast_a_finer_level_at_the_same_samples(last, verdict):
    """Three runs err alike by chance from 2 s on, and three of a finer level from 6 s on."""

    def exact(tolerance, _):
        t = np.linspace(0, 10, 1001)
        return pd.DataFrame({"time": t, "y": np.sin(9 * t) + tolerance * np.cos(5 * t)})

    def unlucky(tolerance, offsets):
        run = exact(tolerance, offsets)
        early, late = run["time"].between(2, 3), run["time"].between(6, 7)
        # Coarser ones err by more from 6 s on: by the distance of the levels they explain that.
        return run.assign(y=run["y"] + 1e-3 * early * (tolerance > last) + late * max(1e-3, 5e4 * tolerance))

    result = sixbar.judge(exact, unlucky, tolerance=1e-8)
    assert (result.verdict, result.refined) == (verdict, 1)


def test_an_order_counts_only_where_it_is_stated():
    """An order that is fitted to the three runs that it judges is theirs by construction."""
    base, distance = np.zeros(50), 1e-6
    # 3 of the larger one, of which the coarser run counts as of order 1.
    for coarse, expected in ((4 * distance, 3 * 4 * distance / 2), (distance, 3 * distance)):
        levels = RunValues(base, base - distance, base + coarse, factor=2.0, order=nan)
        assert uncertainty(levels, 1, 0.0) == pytest.approx(expected)
    options = ({}, {"order": 1.0})
    u = [sixbar.judge(euler, euler, step=1e-3, **order).channels["y"].u.max() for order in options]
    assert u[0] == pytest.approx(u[1] * 3 / (1.25 * 1.7 / 0.7), rel=1e-2)
    assert sixbar.judge(euler, euler, step=1e-3, window=0.5).window == 0.5


def euler(step, _):
    t = np.linspace(0, 2, 101)
    return pd.DataFrame({"time": t, "y": np.exp(-t) * (1 + step * t)})


def test_a_setting_or_a_start_without_effect_is_said():
    """Without moved starts the motions do not diverge, and `until` would be later than it is."""

    def fixed(_, offsets):
        return decay(1e-4, offsets)

    result = sixbar.judge(fixed, decay, tolerance=1e-8, states=1)
    assert (result.verdict, result.confirmation.doubt) == ("differ", Doubt.NO_EFFECT)
    assert "fixed: runs at two settings are equal: is the setting used?" in result.warnings

    def unmoved(tolerance, offsets):
        return decay(tolerance, 0 * offsets)

    for side, has_warning in ((decay, False), (unmoved, True)):
        warnings = sixbar.judge(side, decay, tolerance=1e-8, states=1).warnings
        assert any("a moved start changes nothing" in warning for warning in warnings) == has_warning


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda table: table.assign(y0=nan), "b: y0 is nan in data row 1"),
        (lambda table: table[:0], "b: 0 data rows"),
        (lambda table: table[:-9], "write both over the same time"),
        (lambda table: table[::2], "sixbar compare --tolerance"),
        (lambda table: table.iloc[[0, 0, *range(1, 101)]], "write one row of each time"),
    ],
)
def test_a_table_that_cannot_be_judged_is_refused_in_one_line(change, message):
    def side(tolerance, offsets):
        return change(decay(tolerance, offsets))

    with pytest.raises(TableError, match=r"^[^\n]+$") as refusal:
        sixbar.judge(decay, lambda *call: side(*call), tolerance=1e-8, states=1)
    assert message in str(refusal.value)


def test_demands_are_met_by_what_is_agreed_until():
    """From 6 s on the finer run is apart."""

    def parting(tolerance, _):
        t = np.linspace(0, 10, 1001)
        jump = 0.2 * (t > 6.0) * (tolerance < 1e-8)
        return pd.DataFrame({"time": t, "y": np.sin(9 * t) + tolerance * np.cos(5 * t) + jump})

    demands = {"until": (6.0, 0, "agree"), "coverage": (0.9, 3, "indeterminate")}
    for name, (value, code, verdict) in demands.items():
        result = sixbar.judge(parting, parting, tolerance=1e-8, scale={"y": 40.0}, **{name: value})
        assert (result.verdict, result.exit_code, result.until) == (verdict, code, 6.0)
        assert result.channels["y"].scale == 40.0


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"tolerance": (1e-8, None)}, "side.b must have a tolerance or a step"),
        ({"tolerance": 1e-8, "scale": {"y1": 1.0}}, "scale.y1: 'y1' is not a channel"),
        ({"tolerance": 1e-8, "factor": 1.0}, "side.a.factor = 1.0 must be > 1"),
        ({"tolerance": 1e-8, "states": "phi"}, "states: 'phi' is not a column of decay"),
        ({"step": 1e-3}, "failing, step 0.001: ZeroDivisionError: division by zero"),
    ],
)
def test_what_cannot_be_judged_is_refused_in_one_line(options, message):
    def failing(*_):
        return 1 / 0

    with pytest.raises(TableError, match=r"^[^\n]+$") as refusal:
        sixbar.judge(decay, failing if "step" in options else decay, **options)
    assert message in str(refusal.value)


def printer(digits, rate=1.0):
    """Return a side whose table has so many digits, as a program that prints them."""

    def run(tolerance, offsets):
        table = oscillator(rate, "LSODA")(tolerance, offsets)
        columns = {name: [float(f"{x:.{digits}g}") for x in table[name]] for name in table if name != "time"}
        return table.assign(**columns)

    return run


@pytest.mark.parametrize("digits", [6, 9])
def test_the_digits_of_a_table_are_part_of_its_uncertainty(digits):
    result = sixbar.judge(oscillator(), printer(digits), tolerance=1e-10, states=2)
    assert (result.verdict, result.until) == ("agree", 20.0)
    fault = sixbar.judge(oscillator(), printer(digits, 1.0 + 10.0 ** (2 - digits)), tolerance=1e-10, states=2)
    assert fault.verdict == "differ"


@pytest.mark.parametrize(
    ("unit", "scale", "verdict"), [(" [N]", {}, "agree"), ("", {"z": 100.0}, "agree"), ("", {}, "differ")]
)
def test_what_is_zero_in_one_and_the_residue_of_others_in_the_other_is_no_difference(unit, scale, verdict):
    def side(share):
        def run(tolerance, offsets):
            table = oscillator()(tolerance, offsets)
            return table.assign(**{f"f{unit}": 100.0 * table.y0, f"z{unit}": share * 100.0 * table.y0})

        return run

    result = sixbar.judge(side(0.0), side(np.cos(np.pi / 2)), tolerance=1e-8, states=2, scale=scale)
    assert result.verdict == verdict


@pytest.mark.parametrize(
    ("words", "name"),
    [
        ("python -m solver", "solver/part.py"),
        ("solve --data=data", "data/k.txt"),
        ("sh -c 'solve k.txt'", "k.txt"),
        ("{folder}/solve", "solve"),
    ],
)
def test_a_command_runs_again_where_a_file_that_it_names_has_changed(words, name, tmp_path):
    path = tmp_path / name
    path.parent.mkdir(exist_ok=True)
    line, hashes = f"{words} {{tolerance}} {{out}}".replace("{folder}", str(tmp_path)), []
    for text in ("1", "1.0"):
        path.write_text(text)
        path.chmod(0o755)
        hashes.append(command_side(line, tmp_path, ["tolerance"]).files)
    assert hashes[0] != hashes[1]
