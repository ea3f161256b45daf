"""Verdict and numbers do not change with what has no meaning: order, units, formats, origins."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from judged_runs import MODELS, Judged, compared, each, random_scene, random_tables

from comparison.accuracy.uncertainty import WINDOW, Runs
from comparison.scene import load_scene
from comparison.tables.channels import channels
from comparison.tables.table import Table
from comparison.verdict.compare import compare, model_uncertainty
from comparison.verdict.recorded import Recorded, compare_recorded
from comparison.verdict.results import SceneComparison
from comparison.words.verdicts import scene_reason

NUMBERS = (
    "coverage", "explained", "outside", "max_difference", "rms_difference", "max_scaled", "rms_scaled",
    "worst_time", "worst_threshold", "scale", "coverage_error", "rms_error",
)  # fmt: skip
SCENES = ((2, 0.0), (3, 0.0), (3, 0.02), (13, 0.0))
"""Seed and fault: two that agree, one that differs, one that is indeterminate."""


def cases() -> list[Judged]:
    return [random_tables(seed) for seed in range(30)] + [
        random_scene(seed, fault=fault) for seed, fault in SCENES
    ]


def assert_equal(
    found: SceneComparison, other: SceneComparison, *, rel: float = 0.0, besides: str = ""
) -> None:
    """All numbers of two comparisons, but for rounding of a relative size."""
    assert (found.verdict, set(found.channels)) == (other.verdict, set(other.channels))
    assert found.coverage == pytest.approx(other.coverage, rel=rel, nan_ok=True)
    for name, channel in found.channels.items():
        second = other.channels[name]
        assert channel.verdict == second.verdict, name
        for key in NUMBERS:
            expected = pytest.approx(getattr(second, key), rel=rel, abs=0, nan_ok=True)
            assert key == besides or getattr(channel, key) == expected, (name, key)


def test_exchanging_the_models_changes_the_sign_and_no_number():
    for judged in cases():
        found = compared(judged)
        other = compared(judged._replace(a=judged.b, b=judged.a), labels=MODELS[::-1])
        # Squares and sums of two in the other order.
        assert_equal(found, other, rel=1e-14)
        for name, channel in found.channels.items():
            np.testing.assert_array_equal(channel.difference, -other.channels[name].difference)
        if found.impacts is None:
            continue
        assert found.shift is not None
        # The other table is interpolated between its samples.
        assert other.shift.value == pytest.approx(-found.shift.value, abs=1e-2 * found.shift.uncertainty)
        swapped = {"count_a": "count_b", "count_b": "count_a", "precision": "recall", "recall": "precision"}
        for part, impacts in found.impacts.items():
            for key, value in vars(impacts).items():
                if key != "pairs":
                    back = getattr(other.impacts[part], swapped.get(key, key))
                    assert back == pytest.approx(value, rel=1e-12, abs=1e-14), key
        y, back = found.channels["slider_y"].metrics, other.channels["slider_y"].metrics
        magnitude = 1 / (1 + y["sprague_geers_magnitude"]) - 1
        assert back["sprague_geers_magnitude"] == pytest.approx(magnitude, abs=1e-14)
        assert back["sprague_geers_phase"] == pytest.approx(y["sprague_geers_phase"], rel=1e-6, abs=1e-15)


def test_by_a_tolerance_the_first_table_is_the_reference_and_its_range_the_scale():
    for seed in range(20):
        judged = random_tables(seed)
        a, b = Runs(judged.a.base), Runs(judged.b.base)
        there, back = (
            compare(*pair, scene=judged.scene, tolerance=0.01, only=a.base.channels)
            for pair in ((a, b), (b, a))
        )
        for name, channel in there.channels.items():
            other = back.channels[name]
            assert channel.max_difference == other.max_difference
            assert channel.rms_difference == other.rms_difference
            if channels()[name].scale == "range":
                assert (channel.scale, other.scale) == (
                    np.ptp(a.base.values(name)),
                    np.ptp(b.base.values(name)),
                )
            else:
                assert channel.scale == other.scale
            if channel.scale == other.scale:
                assert (channel.verdict, channel.outside) == (other.verdict, other.outside)


def test_the_order_of_columns_does_not_matter():
    for number, judged in enumerate(cases()):
        rng = np.random.default_rng(number)

        def shuffled(table: Table, rng: np.random.Generator = rng) -> Table:
            return replace(table, frame=table.frame[rng.permutation(list(table.frame))])

        other = judged._replace(a=each(judged.a, shuffled), b=each(judged.b, shuffled))
        found, second = compared(judged), compared(other, only=judged.a.base.channels)
        assert_equal(found, second)
        assert scene_reason(found) == scene_reason(second)
        assert str(found.shift) == str(second.shift)  # bit for bit, also where it is nan


@pytest.mark.parametrize("offset", [0.25, 64.0, 4096.0])
def test_the_origin_of_time_does_not_matter(offset):
    """Distances of times round with the offset's last digit, of 1e-12 s at most; a sample's is 3e-4 s."""

    def late(table: Table) -> Table:
        events = table.events
        if events is not None and len(events):
            events = events.assign(start=events["start"] + offset, end=events["end"] + offset)
        return replace(table, frame=table.frame.assign(time=table.time + offset), events=events, pulses=None)

    for judged in cases():
        without = {"scene": None, "period": judged.scene.period}
        found = compared(judged, **without)
        other = compared(judged._replace(a=each(judged.a, late), b=each(judged.b, late)), **without)
        assert_equal(found, other, rel=1e-7, besides="worst_time")
        for name, channel in other.channels.items():
            expected = pytest.approx(found.channels[name].worst_time + offset, abs=1e-9, nan_ok=True)
            assert channel.worst_time == expected
        if found.shift is not None and not found.shift.reason:
            digits = 4 * np.spacing(offset + 2.0)
            assert other.shift.value == pytest.approx(
                found.shift.value, abs=1e-3 * found.shift.uncertainty + digits
            )
        assert (found.impacts is None) == (other.impacts is None)
        if found.impacts is not None:
            assert other.impacts["all"].recall == found.impacts["all"].recall


@pytest.mark.parametrize("offset", [0.0, 1e4, 1.7e9])
def test_late_times_that_two_programs_count_differently_are_the_same_grid(offset):
    """Seconds since 1970 have a last digit of 2e-7: runs with uncertainties would be refused."""
    steps = np.arange(801) * 1e-3
    time = offset + steps
    other = np.nextafter(time, np.inf)

    def runs(time: np.ndarray, sign: float) -> Recorded:
        def table(error: float, time: np.ndarray = time) -> Table:
            y = 0.1 * np.sin(9 * steps) + error * np.cos(5 * steps)
            return Table(pd.DataFrame({"time": time, "slider_y": y}))

        error = sign * 1e-6
        return Recorded(table(error), table(error / 4, np.nextafter(time, np.inf)), table(4 * error))

    result = compare_recorded(runs(time, 1.0), runs(other, -1.0), scene=None, labels=("a", "b"))
    assert result.verdict == "agree"
    # At the largest error: 2e-6.
    assert result.channels["slider_y"].max_difference == pytest.approx(2e-6, rel=1e-6)


# Angles


TIME = np.arange(1001) * 4e-4


def crank(error: float, turned: Callable[[np.ndarray], np.ndarray], shape: float = 9.0) -> Table:
    """A crank angle with an error, told as a program may tell it."""
    angle = 2 * np.pi * TIME / 0.1 + error * np.sin(shape * TIME) + 1.0
    rate = np.full(TIME.size, 2 * np.pi / 0.1) + error * shape * np.cos(shape * TIME)
    return Table(pd.DataFrame({"time": TIME, "crank_angle": turned(angle), "crank_speed": rate}))


TOLD = {
    "as it is": lambda angle: angle,
    "turns ahead": lambda angle: angle + 6 * np.pi,
    "within a turn": lambda angle: np.mod(angle, 2 * np.pi),
    "within half a turn": lambda angle: np.mod(angle + np.pi, 2 * np.pi) - np.pi,
}


@pytest.mark.parametrize("size", [1e-6, 1.0])
@pytest.mark.parametrize("which", range(6))
@pytest.mark.parametrize("told", TOLD)
def test_whole_revolutions_in_any_run_make_no_difference(told, which, size):
    def result(told: str) -> SceneComparison:
        # The finer run of a, say, counts revolutions in another way than the others.
        ways = [TOLD[told if n == which else "as it is"] for n in range(6)]
        a, b = (
            Recorded(
                *(crank(sign * error, way) for error, way in zip((1e-6, 2.5e-7, 4e-6), part, strict=True))
            )
            for sign, part in ((1.0, ways[:3]), (size / 1e-6, ways[3:]))
        )
        return compare_recorded(a, b, scene=None, labels=("a", "b"), period=0.1)

    found, plain = result(told), result("as it is")
    assert plain.verdict == ("agree" if size == 1e-6 else "indeterminate")
    assert found.verdict == plain.verdict
    channel, other = found.channels["crank_angle"], plain.channels["crank_angle"]
    # Angles up to 45 rad round at 7e-15, of differences of 1e-6.
    np.testing.assert_allclose(channel.difference, other.difference, rtol=0, atol=5e-14)
    np.testing.assert_allclose(channel.u, other.u, rtol=1e-6)
    assert channel.coverage == other.coverage


def test_times_that_are_not_even_take_no_sample_out_of_the_window():
    """Samples are dense at contacts: so many of them as a window holds elsewhere are a far shorter time."""
    rng = np.random.default_rng(4)
    period = 0.4
    dense = np.concatenate([at + np.arange(40) * 1e-5 for at in (0.05, 0.11, 0.31)])
    time = np.unique(np.concatenate([np.arange(401) * 1e-3, dense]))
    base = rng.normal(size=time.size)
    finer = base + 10 ** rng.uniform(-6, -2, time.size)
    runs = Runs(*(Table(pd.DataFrame({"time": time, "slider_vx": values})) for values in (base, finer)))
    u = model_uncertainty(runs, "slider_vx", period)
    near = np.abs(time[:, None] - time[None, :]) < WINDOW * period
    least = 3 * np.where(near, np.abs(base - finer)[None, :], 0.0).max(axis=1)
    assert np.all(u >= least * (1 - 1e-12))


def test_the_scene_of_tables_that_start_late_is_told_that_they_do():
    """Beside a scene time is that of its start: an offset is refused, not compared with another part."""
    judged = random_tables(0)
    later = each(judged.a, lambda table: replace(table, frame=table.frame.assign(time=table.time + 1.0)))
    with pytest.raises(ValueError, match=r"spans 1 to .* must span 0 to"):
        compared(judged._replace(a=later))
    assert load_scene("150rpm-0.2mm").period == pytest.approx(judged.scene.period)
