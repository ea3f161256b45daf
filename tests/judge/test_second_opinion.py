"""Every number of a comparison once more by a second judge, on random tables and on changed scenes."""

from collections import Counter

import numpy as np
import pandas as pd
import pytest
import second_judge
from by_keywords import compare
from judged_runs import CASES, changed_scene, comparison_of, frames, random_tables

from comparison.accuracy.levels import thresholds
from comparison.accuracy.uncertainty import Runs
from comparison.metrics import WINDOW, begin_where, compare_impacts
from comparison.tables.channels import channels
from comparison.verdict.channel import Criteria, Samples, compare_channel
from comparison.verdict.compare import scene_verdict

EXACT_KEYS = ("verdict", "outside")
# Numbers of the same few operations in another order.
ROUNDED_KEYS = (
    "coverage", "explained", "worst_time", "worst_difference", "worst_threshold", "max_difference",
    "rms_difference", "scale",
)  # fmt: skip


def assert_same(result, channels):
    assert set(result.channels) == set(channels)
    for name, second in channels.items():
        channel = result.channels[name]
        for key in EXACT_KEYS:
            assert getattr(channel, key) == getattr(second, key), (name, key)
        for key in ROUNDED_KEYS:
            expected = pytest.approx(getattr(second, key), rel=1e-12, abs=0, nan_ok=True)
            assert getattr(channel, key) == expected, (name, key)
        for key in ("max", "rms"):
            size = getattr(second, f"{key}_difference")
            expected = size / second.scale if second.scale else np.nan
            assert getattr(channel, f"{key}_scaled") == pytest.approx(expected, rel=1e-12, nan_ok=True)
        if channel.u is not None:
            np.testing.assert_allclose(channel.u, second.u, rtol=1e-12)
            np.testing.assert_array_equal(channel.predictable, second.predictable)


def second_opinion(pair):
    refinements = pair.a.refinement, pair.b.refinement
    return second_judge.judge(frames(pair.a), frames(pair.b), pair.scene.data, pair.tier, refinements)


def test_random_tables_are_judged_alike_in_every_branch():
    verdicts = Counter()
    for seed in range(60):
        pair = random_tables(seed)
        result, other = comparison_of(pair), second_opinion(pair)
        assert_same(result, other.channels)
        assert result.verdict == other.verdict, seed
        assert result.coverage == pytest.approx(other.coverage, rel=1e-12)
        verdicts[f"scene {result.verdict}"] += 1
        for channel in result.channels.values():
            verdicts[channel.verdict] += 1
            verdicts[f"little {channel.verdict}"] += channel.coverage < channel.limits.coverage
            verdicts["agree with some outside"] += channel.verdict == "agree" and channel.outside > 0
    branches = {"agree", "differ", "indeterminate", "unexcited", "little differ", "agree with some outside"}
    assert all(verdicts[name] >= 5 for name in branches), verdicts
    assert all(verdicts[f"scene {name}"] >= 5 for name in ("agree", "differ", "indeterminate")), verdicts


@pytest.mark.parametrize("share", [1.0, 0.99, 0.9])
def test_random_tables_are_judged_alike_by_a_tolerance(share):
    verdicts = Counter()
    for seed in range(26):
        pair = random_tables(seed)
        a, b = pair.a.base, pair.b.base
        tolerance = 10 ** np.random.default_rng(seed).uniform(-5, 0)
        runs = (Runs(a), Runs(b))
        result = compare(*runs, scene=pair.scene, tolerance=tolerance, share=share, only=a.channels)
        other = {}
        for name in a.channels:
            values = a.values(name)
            scale = second_judge.scale_of(name, pair.scene.data, values.min(), values.max())  # the first's
            threshold = np.full(a.time.size, tolerance * scale)
            other[name] = second_judge.judge_channel(
                name, a.time, values, b.values(name), scale, threshold, share
            )
        assert_same(result, other)
        verdicts += Counter(channel.verdict for channel in result.channels.values())
    assert min(verdicts["agree"], verdicts["differ"]) >= 20


def assert_same_impacts(result, expected):
    assert [tuple(pair) for pair in result.pairs] == expected.pop("pairs")
    for name, value in expected.items():
        # Sums of hundreds of terms.
        assert getattr(result, name) == pytest.approx(value, rel=1e-12, abs=1e-14, nan_ok=True), name


@pytest.mark.parametrize(("name", "fault"), CASES)
def test_changed_scenes_and_their_impacts_are_judged_alike(name, fault):
    pair = changed_scene(name, fault=fault)
    result, other = comparison_of(pair), second_opinion(pair)
    assert_same(result, other.channels)
    assert (result.verdict, result.coverage) == (other.verdict, pytest.approx(other.coverage, rel=1e-12))
    assert (result.verdict == "differ") == bool(fault)
    a, b = result.events
    assert WINDOW == 1 / 5000
    masks = {place: result.channels[f"corner_{place}_gap"].predictable for place in ("ll", "lr", "ul", "ur")}
    within = [second_judge.begins_in(events, result.time, masks) for events in (a, b)]
    for part, of in (("all", (None, None)), ("predictable", within)):
        assert len(result.impacts[part].pairs) >= 5
        assert_same_impacts(result.impacts[part], second_judge.impacts(a, b, WINDOW * pair.scene.period, *of))


@pytest.mark.parametrize("seed", range(40))
def test_the_impacts_of_random_tables_are_compared_alike(seed):
    """Starts lie on a grid of eighths, many of them equally near; one table may lack their place."""
    rng = np.random.default_rng(seed)

    def events(places):
        count = int(rng.integers(0, 30))
        rows = pd.DataFrame({"corner": rng.choice(places, count), "start": rng.integers(0, 120, count) / 8})
        rows = rows.drop_duplicates().reset_index(drop=True)
        values = {name: rng.exponential(size=len(rows)) for name in ("normal_speed", "impulse", "peak_force")}
        return rows.assign(**values)

    a, b = events(["ll", "ur", "pin"]), events(["ll", "ur", "lr"])
    window = rng.choice([0.125, 0.25, 1.0])
    time = np.linspace(0, 15, 41)
    masks = {place: rng.random(41) < 0.7 for place in ("ll", "ur", "lr")}
    within = [second_judge.begins_in(table, time, masks) for table in (a, b)]
    starts = begin_where(a, time, masks), begin_where(b, time, masks)
    assert_same_impacts(compare_impacts(a, b, window), second_judge.impacts(a, b, window))
    assert_same_impacts(compare_impacts(a, b, window, starts), second_judge.impacts(a, b, window, *within))


@pytest.mark.parametrize(
    ("beyond", "predictable", "verdict"),
    [(0, 200, "agree"), (2, 200, "agree"), (3, 200, "differ"), (1, 100, "agree"), (0, 99, "indeterminate")],
)
def test_what_is_met_exactly_is_met(beyond, predictable, verdict):
    """Numbers of few binary digits: u = 5 of 3 and 4, differences of 2 u, 99 % of samples, half of all."""
    time, digit = np.arange(200) / 128, 2.0**-20
    a = np.where(np.arange(200) % 2, 1.0, -1.0)
    b = a - 10 * digit
    b[:beyond] -= digit
    u = np.where(np.arange(200) < predictable, digit, 1.0)
    result = compare_channel(
        channels()["slider_ax"], Samples(time, a, b, 3 * u, 4 * u), scene=None, limits=thresholds()
    )
    assert (result.verdict, result.coverage, result.outside) == (verdict, predictable / 200, beyond)
    assert result.worst_threshold == 10 * digit
    assert scene_verdict({"slider_ax": result}, thresholds().coverage) == verdict
    by_tolerance = compare_channel(
        channels()["slider_ax"],
        Samples(time, a, b),
        scene=None,
        criteria=Criteria(tolerance=5 * digit),
        limits=thresholds(),
    )
    assert by_tolerance.outside == beyond  # of a range of 2
