"""Every number of a comparison once more by a second judge, on random tables and on random scenes."""

from __future__ import annotations

from collections import Counter
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
import second_judge
from judged_runs import Judged, changed_scene, compared, frames, random_scene, random_tables
from scipy.interpolate import CubicHermiteSpline

from comparison.accuracy.uncertainty import Runs
from comparison.agreement.compare import compare
from comparison.agreement.results import SceneComparison
from comparison.execution.run import run_one
from comparison.metrics.impacts import WINDOW
from comparison.metrics.iso18571 import rating
from comparison.metrics.norms import rms, sprague_geers, tube_share
from comparison.tables.channels import Channel
from comparison.tables.resample import resample
from comparison.tables.table import Table
from comparison.tables.time_shift import estimate

CASES = ((1, 0.0), (2, 0.0), (3, 0.0), (13, 0.0), (1, 0.02), (3, 0.02))
"""Of `judged_runs.random_scene`, seed and fault: both tiers; 13 is indeterminate, a faulty one differs."""
EXACT = ("verdict", "outside")
# Numbers that both make of the same few operations in another order.
ROUNDED = (
    "coverage", "explained", "worst_time", "worst_difference", "worst_threshold", "max_difference",
    "rms_difference", "scale",
)  # fmt: skip


def assert_same(found: SceneComparison, channels: dict[str, SimpleNamespace]) -> None:
    assert set(found.channels) == set(channels)
    for name, second in channels.items():
        channel = found.channels[name]
        for key in EXACT:
            assert getattr(channel, key) == getattr(second, key), (name, key)
        for key in ROUNDED:
            expected = pytest.approx(getattr(second, key), rel=1e-12, abs=0, nan_ok=True)
            assert getattr(channel, key) == expected, (name, key)
        for key in ("max", "rms"):
            size = getattr(second, f"{key}_difference")
            expected = size / second.scale if second.scale else np.nan
            assert getattr(channel, f"{key}_scaled") == pytest.approx(expected, rel=1e-12, nan_ok=True)
        if channel.u is not None:
            np.testing.assert_allclose(channel.u, second.u, rtol=1e-12)
            np.testing.assert_array_equal(channel.predictable, second.predictable)


def second(judged: Judged) -> SimpleNamespace:
    refined = judged.a.refinement, judged.b.refinement
    return second_judge.judge(frames(judged.a), frames(judged.b), judged.scene.data, judged.tier, refined)


def test_random_tables_are_judged_alike_in_every_branch():
    verdicts: Counter[str] = Counter()
    for seed in range(120):
        judged = random_tables(seed)
        found, other = compared(judged), second(judged)
        assert_same(found, other.channels)
        assert found.verdict == other.verdict, seed
        assert found.coverage == pytest.approx(other.coverage, rel=1e-12)
        verdicts += Counter(f"scene {found.verdict}" for _ in [0])
        verdicts += Counter(channel.verdict for channel in found.channels.values())
        little = [c for c in found.channels.values() if c.coverage < c.limits.coverage]
        verdicts += Counter(f"little {channel.verdict}" for channel in little)
        share = [c for c in found.channels.values() if c.verdict == "agree" and c.outside]
        verdicts += Counter(["agree with some outside"] * len(share))
    branches = {"agree", "differ", "indeterminate", "unexcited", "little differ", "agree with some outside"}
    assert all(verdicts[name] >= 5 for name in branches), verdicts
    assert all(verdicts[f"scene {name}"] >= 5 for name in ("agree", "differ", "indeterminate")), verdicts


@pytest.mark.parametrize("share", [1.0, 0.99, 0.9])
def test_random_tables_are_judged_alike_by_a_tolerance(share):
    verdicts: Counter[str] = Counter()
    for seed in range(40):
        judged = random_tables(seed)
        a, b = judged.a.base, judged.b.base
        tolerance = 10 ** np.random.default_rng(seed).uniform(-5, 0)
        pair = (Runs(a), Runs(b))
        found = compare(*pair, scene=judged.scene, tolerance=tolerance, share=share, only=a.channels)
        data = judged.scene.data
        other = {}
        for name in a.channels:
            values = a.values(name)
            scale = second_judge.scale_of(name, data, values.min(), values.max())  # that of the first
            other[name] = second_judge.judge_by_tolerance(
                name, a.time, values, b.values(name), scale, tolerance, share
            )
        assert_same(found, other)
        verdicts += Counter(channel.verdict for channel in found.channels.values())
    assert min(verdicts["agree"], verdicts["differ"]) >= 20


@pytest.mark.parametrize(("seed", "fault"), CASES)
def test_random_scenes_are_judged_alike(seed, fault):
    judged = random_scene(seed, fault=fault)
    found, other = compared(judged), second(judged)
    assert_same(found, other.channels)
    assert (found.verdict, found.coverage) == (other.verdict, pytest.approx(other.coverage, rel=1e-12))
    assert (found.verdict == "differ") == bool(fault)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(20, 50))
def test_many_random_scenes_are_judged_alike(seed):
    judged = random_scene(seed)
    found, other = compared(judged), second(judged)
    assert_same(found, other.channels)
    assert found.verdict == other.verdict


# Impacts


@pytest.mark.parametrize(("seed", "fault"), CASES)
def test_the_impacts_of_random_scenes_are_compared_alike(seed, fault):
    judged = random_scene(seed, fault=fault)
    found = compared(judged)
    assert found.impacts is not None
    a, b = found.events
    window, time = WINDOW * judged.scene.period, found.time
    assert WINDOW == 1 / 5000
    masks = {place: found.channels[f"corner_{place}_gap"].predictable for place in ("ll", "lr", "ul", "ur")}
    within = [second_judge.begins_in(events, time, masks) for events in (a, b)]
    for part, of in (("all", (None, None)), ("predictable", within)):
        expected = second_judge.impacts(a, b, window, *of)
        assert [tuple(pair) for pair in found.impacts[part].pairs] == expected.pop("pairs")
        assert len(found.impacts[part].pairs) >= 5
        for name, value in expected.items():
            # Sums of hundreds of terms.
            assert getattr(found.impacts[part], name) == pytest.approx(value, rel=1e-12, abs=1e-14), name


def test_an_impulse_is_the_area_below_the_force_of_a_dense_table():
    """Both models integrate it on the way; from samples without them it has the error of a quadrature.

    The trapezoidal rule on two grids tells that error. Peaks are those of parabolas through three samples;
    contacts of fewer than 40 samples are left out.
    """
    for model in ("reference", "exudyn"):
        scene, _ = changed_scene(2)
        table = run_one(scene.with_values({"output.samples_per_cycle": 60_000, "drive.cycles": 0.5}), model)
        time, seen = table.time, 0
        for event in table.events.itertuples():
            if event.corner == "pin":
                continue
            inside = (time > event.start) & (time < event.end)
            if inside.sum() < 40:
                continue
            at = np.concatenate([[event.start], time[inside], [event.end]])
            normal = table.values(f"corner_{event.corner}_normal")[inside]
            # At its start and end a contact presses by nothing, but that damping may end it earlier.
            force = np.concatenate([[0.0], normal, [0.0 if normal[-1] < 0.1 * normal.max() else normal[-1]]])
            area, coarse = np.trapezoid(force, at), np.trapezoid(force[::2], at[::2])
            # Twice the step of a rule of second order: a third of the change, three times for safety.
            assert event.impulse == pytest.approx(area, abs=abs(area - coarse) + 1e-5 * area)
            gap = -table.values(f"corner_{event.corner}_gap")[inside]
            for name, values in (("peak_force", normal), ("largest_depth", gap)):
                k = int(np.clip(values.argmax(), 1, values.size - 2))
                before, most, after = values[k - 1 : k + 2]
                vertex = most - (before - after) ** 2 / (8 * (before - 2 * most + after))
                # The event's is that over the integrator's steps.
                assert getattr(event, name) == pytest.approx(vertex, rel=1e-4)
            seen += 1
        assert seen >= 10


# Measures of signals


def noise(seed: int, size: int = 60) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Uneven times and two signals that have something in common."""
    rng = np.random.default_rng(seed)
    time = np.cumsum(rng.exponential(1.0, size) + 1e-3)
    first = np.cumsum(rng.normal(size=size))
    return time, first, first + rng.normal(size=size) * rng.uniform(0, 2)


@pytest.mark.parametrize("seed", range(20))
def test_measures_of_random_signals(seed):
    time, first, other = noise(seed)
    assert rms(time, first - other) == pytest.approx(
        second_judge.root_mean_square(time, first - other), rel=1e-13
    )
    magnitude, phase, combined = sprague_geers(time, first, other)
    expected = second_judge.sprague_geers(time, first, other)
    assert (magnitude, combined) == pytest.approx((expected[0], expected[2]), abs=1e-7)
    assert phase == pytest.approx(expected[1], abs=1e-7)  # the arc cosine's
    even = np.linspace(0.0, 7.0, 1237)  # 0.002 of it are two and a half samples
    first, other = (np.interp(even, np.linspace(0.0, 7.0, 60), of) for of in (first, other))
    other = first + 0.01 * np.ptp(first) * np.sin(9 * even)  # outside where it is flat
    assert tube_share(even, first, other) == second_judge.tube_share(even, first, other)
    assert 0.0 < tube_share(even, first, other) < 1.0


@pytest.mark.parametrize("seed", range(12))
def test_the_rating_of_random_signals(seed):
    _, first, other = noise(seed, 90)
    late = int(np.random.default_rng(seed).integers(-12, 13))
    found = rating(first[12:-12], np.roll(other, late)[12:-12])
    expected = second_judge.iso18571(first[12:-12], np.roll(other, late)[12:-12])
    assert vars(found) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("seed", [2, 18])
@pytest.mark.parametrize("name", ["slider_y", "slider_omega"])
def test_measures_of_random_scenes(seed, name):
    channel = compared(random_scene(seed)).channels[name]
    time, a, b = channel.time, channel.a, channel.b
    if name == "slider_y":  # a position: its zero is arbitrary
        middle = (a.sum() + b.sum()) / (2 * a.size)
        a, b = a - middle, b - middle
    expected = second_judge.sprague_geers(time, a, b)
    found = [channel.metrics[f"sprague_geers_{key}"] for key in ("magnitude", "phase", "combined")]
    assert found == pytest.approx(expected, abs=1e-7)  # the arc cosine's
    assert channel.metrics["tube_share"] == second_judge.tube_share(time, a, b)
    expected = second_judge.iso18571(a[:300], b[:300])
    assert vars(rating(a[:300], b[:300])) == pytest.approx(expected, abs=1e-12)


# Alignment and shift


@pytest.mark.parametrize("seed", range(12))
def test_interpolation_between_events(seed):
    rng = np.random.default_rng(seed)
    time = np.cumsum(rng.uniform(0.5, 1.5, 40))
    at = np.sort(np.concatenate([rng.uniform(time[0], time[-1], 60), time[::7], time[-1:]]))
    starts = rng.uniform(time[0] - 1, time[-1] - 1, 9)
    events = pd.DataFrame(
        {
            "corner": rng.choice(["ll", "ur", "pin"], 9),
            "start": starts,
            "end": starts + rng.exponential(2.0, 9),
        }
    )
    columns = {
        name: rng.normal(size=40)
        for name in ("slider_x", "slider_vx", "slider_ax", "corner_ll_normal", "corner_ll_gap")
    }
    found, unknown = resample(time, columns, at, events)
    curve = CubicHermiteSpline(time, columns["slider_x"], columns["slider_vx"])
    np.testing.assert_allclose(found["slider_x"], curve(at), atol=1e-13)
    for name in ("slider_vx", "corner_ll_gap"):  # continuous
        expected = second_judge.between_events(time, columns[name], at, [])
        np.testing.assert_allclose(found[name], expected, atol=1e-13)
    own = events[events["corner"] == "ll"]
    for name, of in (("slider_ax", events), ("corner_ll_normal", own)):
        expected = second_judge.between_events(time, columns[name], at, [*of["start"], *of["end"]])
        known = ~unknown.get(name, np.zeros(at.size, bool))
        np.testing.assert_array_equal(known, np.isfinite(expected))
        np.testing.assert_allclose(found[name][known], expected[known], atol=1e-12)


RATES = {"slider_x": "slider_vx", "slider_y": "slider_vy", "slider_angle": "slider_omega"}


@pytest.mark.parametrize(("seed", "fault"), CASES)
def test_the_shift_of_random_scenes(seed, fault):
    """Both find the same minimum, and another seed's crank turns no faster: within the stated uncertainty."""
    judged = random_scene(seed, fault=fault)
    shift = compared(judged).shift
    sides = [{name: run.base.values(name) for name in (*RATES, *RATES.values())} for run in judged[2:]]
    assert shift is not None
    reach = max(10 * shift.uncertainty, 2 * abs(shift.value))
    other = second_judge.shift_between(judged.a.base.time, *sides, RATES, reach)
    assert abs(other - shift.value) <= shift.uncertainty


@pytest.mark.parametrize("seed", range(10))
def test_the_shift_of_random_signals(seed):
    rng = np.random.default_rng(seed)
    time, late = np.arange(900) * 1e-3, rng.uniform(-0.03, 0.03)
    waves = [rng.uniform((0.1, 5, 0), (1, 30, 6), (4, 3)) for _ in RATES]

    def tables(t: np.ndarray, noise: float) -> dict[str, np.ndarray]:
        made = {}
        for (position, rate), parts in zip(RATES.items(), waves, strict=True):
            made[position] = sum(s * np.sin(w * t + p) for s, w, p in parts) + noise * rng.normal(size=t.size)
            made[rate] = sum(s * w * np.cos(w * t + p) for s, w, p in parts)
        return made

    a, b = tables(time, 0.0), tables(time - late, 10 ** rng.uniform(-9, -3))
    found = estimate(time, a, b)
    other = second_judge.shift_between(time, a, b, RATES, 0.04)
    assert found.value == pytest.approx(late, abs=3 * found.uncertainty)
    assert found.value == pytest.approx(other, abs=3 * found.uncertainty)
    # Interpolation alone: (w h)^4 / 384 over the rate, some 1e-9 s.
    assert found.uncertainty < 1e-4


@pytest.mark.parametrize("seed", range(8))
def test_a_tolerance_allows_a_shift_in_which_the_motion_crosses_its_tolerance_at_its_largest_rate(seed):
    """Of a wave of frequency w a share T of its range is crossed in T / w, whatever its size and sign."""
    rng = np.random.default_rng(seed)
    time, w, size = np.arange(4001) * 1e-3, rng.uniform(3, 20), 10 ** rng.uniform(-3, 3)
    tolerance, sign = 10 ** rng.uniform(-3, -1.5), rng.choice([-1, 1])
    own = Channel("height", "height", "m", "", "own", "range", 1e-12 * size, 0.0, rate="climb")
    known = {"height": own, "climb": Channel("climb", "climb", "m/s", "", "own", "range", 1e-12 * size, 0.0)}

    def table(late: float) -> Runs:
        height, climb = size * np.sin(w * (time - late)), size * w * np.cos(w * (time - late))
        return Runs(Table(pd.DataFrame({"time": time, "height": height, "climb": climb}), own=known))

    for times, verdict in ((0.98, "agree"), (1.02, "differ")):
        late = sign * times * tolerance / w
        # A shift moves samples by its share of the range at most, half of what is allowed for the shift.
        result = compare(table(0.0), table(late), tolerance=tolerance)
        assert {channel.verdict for channel in result.channels.values()} == {"agree"}
        assert result.verdict == verdict
        assert result.shift.value == pytest.approx(late, rel=1e-6)
