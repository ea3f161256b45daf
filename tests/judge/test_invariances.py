"""Verdict and numbers do not change with the order of columns and the origins of times and angles."""

from dataclasses import replace
from functools import cache

import numpy as np
import pandas as pd
import pytest
from by_keywords import compare_recorded
from judged_runs import CASES, alter, changed_scene, comparison_of, random_tables

import sixbar
from comparison.tables.table import Table
from comparison.verdict.recorded import ProgramRuns
from comparison.words.verdicts import scene_reason

NUMBERS = (
    "coverage", "explained", "outside", "max_difference", "rms_difference", "max_scaled", "rms_scaled",
    "worst_time", "worst_threshold", "scale", "coverage_error", "rms_error",
)  # fmt: skip


@cache
def cases():
    """Pairs of runs with their comparisons, computed once."""
    pairs = [random_tables(seed) for seed in range(20)]
    pairs += [changed_scene(name, fault=fault) for name, fault in CASES]
    return [(pair, comparison_of(pair)) for pair in pairs]


def assert_equal(result, other, *, rel=0.0, besides=""):
    """Require equal numbers of two comparisons, up to rounding of a relative size."""
    assert (result.verdict, set(result.channels)) == (other.verdict, set(other.channels))
    assert result.coverage == pytest.approx(other.coverage, rel=rel, nan_ok=True)
    for name, channel in result.channels.items():
        second = other.channels[name]
        assert channel.verdict == second.verdict, name
        for key in NUMBERS:
            expected = pytest.approx(getattr(second, key), rel=rel, abs=0, nan_ok=True)
            assert key == besides or getattr(channel, key) == expected, (name, key)


def test_the_order_of_columns_does_not_matter():
    for number, (pair, result) in enumerate(cases()):
        rng = np.random.default_rng(number)

        def shuffle(table, rng=rng):
            return replace(table, frame=table.frame[rng.permutation(list(table.frame))])

        other = pair._replace(a=alter(pair.a, shuffle), b=alter(pair.b, shuffle))
        second = comparison_of(other, only=pair.a.base.channels)
        assert_equal(result, second)
        assert scene_reason(result) == scene_reason(second)
        assert str(result.shift) == str(second.shift)  # bit for bit, also where it is nan


def test_the_origin_of_time_does_not_matter():
    """Distances of times round with the offset's last digit, of 1e-12 s at most; a sample's is 3e-4 s."""
    offset = 4096.0

    def postpone(table):
        events = table.events
        if events is not None and len(events):
            events = events.assign(start=events["start"] + offset, end=events["end"] + offset)
        return replace(table, frame=table.frame.assign(time=table.time + offset), events=events, pulses=None)

    for pair, _ in cases():
        options = {"scene": None, "period": pair.scene.period}
        result = comparison_of(pair, **options)
        other = comparison_of(pair._replace(a=alter(pair.a, postpone), b=alter(pair.b, postpone)), **options)
        assert_equal(result, other, rel=1e-7, besides="worst_time")
        for name, channel in other.channels.items():
            expected = pytest.approx(result.channels[name].worst_time + offset, abs=1e-9, nan_ok=True)
            assert channel.worst_time == expected
        if result.shift is not None and not result.shift.reason:
            digits = 4 * np.spacing(offset + 2.0)
            assert other.shift.value == pytest.approx(
                result.shift.value, abs=1e-3 * result.shift.uncertainty + digits
            )
        assert (result.impacts is None) == (other.impacts is None)
        if result.impacts is not None:
            assert other.impacts["all"].recall == result.impacts["all"].recall


@pytest.mark.parametrize("offset", [0.0, 1.7e9])
def test_late_times_that_two_programs_count_differently_are_the_same_grid(offset):
    """Seconds since 1970 have a last digit of 2e-7: runs with uncertainties would be refused."""
    steps = np.arange(801) * 1e-3
    time = offset + steps
    other = np.nextafter(time, np.inf)

    def runs(time, sign):
        def table(error, time=time):
            y = 0.1 * np.sin(9 * steps) + error * np.cos(5 * steps)
            return Table(pd.DataFrame({"time": time, "slider_y": y}))

        error = sign * 1e-6
        return ProgramRuns(table(error), table(error / 4, np.nextafter(time, np.inf)), table(4 * error))

    result = compare_recorded(runs(time, 1.0), runs(other, -1.0), scene=None, labels=("a", "b"))
    assert result.verdict == "agree"
    # At the largest error: 2e-6.
    assert result.channels["slider_y"].max_difference == pytest.approx(2e-6, rel=1e-6)
    one = pd.DataFrame({"time": time, "x": np.sin(6 * steps), "z": np.cos(5 * steps)})
    shift = sixbar.compare(one, one.assign(z=one["z"] + 0.3 * (steps > 0.4)), tolerance=1e-3).shift
    assert not shift.significant  # one channel jumps, the other is the same


# Angles


TIME = np.arange(1001) * 4e-4


def crank(error, convention, shape=9.0):
    """A crank angle with an error, in a program's convention."""
    angle = 2 * np.pi * TIME / 0.1 + error * np.sin(shape * TIME) + 1.0
    rate = np.full(TIME.size, 2 * np.pi / 0.1) + error * shape * np.cos(shape * TIME)
    return Table(pd.DataFrame({"time": TIME, "crank_angle": convention(angle), "crank_speed": rate}))


CONVENTIONS = {
    "as it is": lambda angle: angle,
    "turns ahead": lambda angle: angle + 6 * np.pi,
    "within a turn": lambda angle: np.mod(angle, 2 * np.pi),
    "within half a turn": lambda angle: np.mod(angle + np.pi, 2 * np.pi) - np.pi,
}


@cache
def compare_angles(size, convention="as it is", index=0):
    """Compare six runs, three of either program, of which one counts revolutions in another way."""
    conventions = [CONVENTIONS[convention if n == index else "as it is"] for n in range(6)]
    a, b = (
        ProgramRuns(
            *(crank(sign * error, way) for error, way in zip((1e-6, 2.5e-7, 4e-6), part, strict=True))
        )
        for sign, part in ((1.0, conventions[:3]), (size / 1e-6, conventions[3:]))
    )
    return compare_recorded(a, b, scene=None, labels=("a", "b"), period=0.1)


@pytest.mark.parametrize("size", [1e-6, 1.0])
@pytest.mark.parametrize("index", range(6))
@pytest.mark.parametrize("convention", list(CONVENTIONS)[1:])
def test_whole_revolutions_in_any_run_make_no_difference(convention, index, size):
    result, base = compare_angles(size, convention, index), compare_angles(size)
    assert (base.verdict, base.exit_code) == ("agree", 0 if size == 1e-6 else 3)  # predictable for 0.02 s
    assert (result.verdict, result.until) == (base.verdict, base.until)
    channel, other = result.channels["crank_angle"], base.channels["crank_angle"]
    # Angles up to 45 rad round at 7e-15, of differences of 1e-6.
    np.testing.assert_allclose(channel.difference, other.difference, rtol=0, atol=5e-14)
    np.testing.assert_allclose(channel.u, other.u, rtol=1e-6)
    assert channel.coverage == other.coverage


@pytest.mark.parametrize("seed", range(6))
def test_the_stated_errors_are_those_of_tables_with_fewer_samples(seed):
    """The tables have every second and every fourth row of the files."""
    pair = random_tables(seed) if seed else changed_scene("soft")

    def thin(every):
        def part(table):
            return replace(table, frame=table.frame.iloc[::every].reset_index(drop=True))

        thin_pair = pair._replace(a=alter(pair.a, part), b=alter(pair.b, part))
        return comparison_of(thin_pair, scene=None, period=pair.scene.period)

    result, half, fourth = map(thin, (1, 2, 4))

    def error(name, key):
        one, two, four = (getattr(run.channels[name] if name else run, key) for run in (result, half, fourth))
        return 3 * max(abs(two - one), abs(four - one) / 2)

    for name, channel in result.channels.items():
        assert channel.coverage_error == pytest.approx(error(name, "coverage"), rel=1e-12, abs=1e-15)
        assert channel.rms_error == pytest.approx(error(name, "rms_difference"), rel=1e-12, abs=1e-18)
    expected = pytest.approx(error("", "coverage"), rel=1e-12, abs=1e-15, nan_ok=True)
    assert result.coverage_error == expected
