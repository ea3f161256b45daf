"""One channel's verdict: what it says of signals whose difference and uncertainty are known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from judged_runs import decided

from comparison.accuracy.levels import thresholds
from comparison.scene import load_scene
from comparison.tables.channels import Channel, channels
from comparison.verdict.channel import compare_channel
from comparison.verdict.compare import scene_verdict
from comparison.verdict.confirmation import judged_samples
from comparison.verdict.results import scene_coverage
from comparison.words.verdicts import reason

N = 1000
TIME = np.linspace(0, 0.4, N)
WAVE = np.sin(2 * np.pi * TIME / 0.4)
LIMITS = thresholds()
SCENE = load_scene("150rpm-0.2mm").data
PARTS = np.arange(N)


def judge(a, b, u=None, channel="slider_ax", tolerance=None, **options):
    """Compare with these uncertainties, or with the same in both; None: none."""
    both = (
        u if isinstance(u, tuple) else (None if u is None else np.broadcast_to(u, a.shape).astype(float),) * 2
    )
    known = channel if isinstance(channel, Channel) else channels()[channel]
    usual = {"scene": None, "u": both, "tolerance": tolerance, "limits": LIMITS} | options
    return compare_channel(known, np.linspace(0, 0.4, a.size), a, b, **usual)


def test_the_tiers_are_those_of_the_method():
    for tier, alpha, coverage in (("standard", 0.01, 0.5), ("tight", 5e-5, 0.25)):
        of = thresholds(tier)
        assert (of.k, of.share, of.alpha, of.coverage) == (2.0, 0.99, alpha, coverage)


@pytest.mark.parametrize(
    ("known", "outside", "verdict"),
    [
        # One sample in a hundred may be unexplained
        (1000, 10, "agree"),
        (1000, 11, "differ"),
        # Half of the samples must be predictable
        (500, 0, "agree"),
        (499, 0, "indeterminate"),
        # With less a difference shows if no other sample could undo it: the motion is chaotic after a fault,
        # which hides in its own uncertainty, but not before.
        (150, 10, "indeterminate"),
        (150, 11, "differ"),
    ],
)
def test_the_share_that_is_explained_and_the_one_that_is_predictable_decide(known, outside, verdict):
    a = WAVE + 1e-9  # no sample is zero in both
    b = a + np.where((PARTS >= 100) & (100 + outside > PARTS), 1e-3, 0.0)
    result = judge(a, b, np.where(known > PARTS, 1e-6, 1.0))
    assert (result.verdict, result.coverage, result.outside) == (verdict, known / N, outside)
    assert result.explained == pytest.approx(1 - outside / known, abs=1e-12)
    if outside:
        assert 100 <= np.flatnonzero(result.worst_time == TIME)[0] < 100 + outside
    assert (f"{known / N:.1%} of the samples are predictable" in reason(result)) == (known < 500)
    # Ensembles are held against what decided, not against the largest u.
    mask, of = judged_samples(result)
    assert np.flatnonzero(mask).tolist() == list(range(known))
    assert of.max() == pytest.approx(np.sqrt(2) * 1e-6)


FORCE = np.zeros(N)
FORCE[[50, 51, 400, 800]] = (30.0, 10.0, 50.0, 20.0)  # 0.4 % of the samples: fewer than may be unexplained
OF_FORCE = {"channel": "corner_ll_normal", "scene": SCENE}


def test_a_force_that_is_zero_throughout_differs_from_rare_impacts():
    for a, b in ((FORCE, 0 * FORCE), (0 * FORCE, FORCE)):
        result = judge(a, b, 1e-6, **OF_FORCE)
        assert (result.verdict, result.explained) == ("differ", 0.0)
        assert judge(a, b, tolerance=0.01, channel="corner_ll_normal").verdict == "differ"
    # Where none of them is predictable it is not called agreement either.
    result = judge(FORCE, 0 * FORCE, np.where(FORCE > 0, 10.0, 1e-9), **OF_FORCE)
    assert (result.verdict, result.coverage > 0.99) == ("indeterminate", True)
    assert np.isnan([result.explained, result.worst_time, result.ratio]).all()


@pytest.mark.parametrize(
    ("judged", "outside", "verdict"),
    [
        (4, 0, "indeterminate"), (9, 2, "indeterminate"), (9, 3, "differ"), (10, 0, "agree"),
        (10, 1, "indeterminate"), (250, 2, "agree"), (150, 2, "indeterminate"), (150, 3, "differ"),
        (400, 4, "agree"), (400, 5, "differ"),
    ],
)  # fmt: skip
def test_one_or_two_samples_decide_nothing(judged, outside, verdict):
    force = np.where(judged > PARTS, 20.0, 0.0)
    assert judge(force, force + np.where(outside > PARTS, 1.0, 0.0), 1e-6, **OF_FORCE).verdict == verdict


@pytest.mark.parametrize("name", ["slider_x", "slider_vx"])
def test_a_unit_that_leaves_nothing_predictable_differs_and_a_motion_that_does_so_does_not(name):
    """Metres against millimetres: the uncertainty, in millimetres as well, exceeds alpha everywhere."""
    position = -0.55 + 1e-4 * WAVE if name == "slider_x" else 0.1 * WAVE
    small = 1e-4 * channels()[name].scale_value(SCENE, np.nan)
    of = {"channel": name, "scene": SCENE}
    result = judge(position, 1e3 * position, (np.full(N, small), np.full(N, 1e3 * small)), **of)
    assert (result.verdict, result.coverage) == ("differ", 0.0)
    assert abs(result.worst_difference) > result.worst_threshold == pytest.approx(2e3 * small, rel=1e-6)
    assert scene_verdict({name: result, "other": judge(WAVE, WAVE, 1e-6)}, 0.5) == "differ"
    # Neighbours that have spread by as much as the motion itself: its largest uncertainty explains them.
    spread = np.where(TIME < 0.1, small, 3 * np.ptp(position))
    apart = np.where(TIME < 0.1, position, position[::-1]) + small
    assert judge(position, apart, spread, **of).verdict == "indeterminate"


def test_the_scene_takes_the_worst_verdict_and_nothing_excited_is_not_agreement():
    agree, differ = judge(WAVE, WAVE + 1e-7, 1e-6), judge(WAVE, WAVE + 1e-3, 1e-6)
    open_, quiet = judge(WAVE, WAVE), judge(0 * WAVE, 0 * WAVE)
    of = {"a": agree, "d": differ, "o": open_, "p": open_, "q": quiet}
    assert [c.verdict for c in of.values()] == ["agree", "differ", *["indeterminate"] * 2, "unexcited"]
    for names, verdict in (
        ("aq", "agree"), ("aopq", "indeterminate"), ("oq", "indeterminate"), ("aod", "differ")
    ):  # fmt: skip
        assert scene_verdict({name: of[name] for name in names}, 0.5) == verdict
    verdict, why = decided({"a": agree, "b": agree, "o": open_})
    # The third has no uncertainty to judge by: it covers nothing.
    assert (verdict, "66.66% of all samples are predictable; indeterminate: " in why) == ("agree", True)
    assert scene_coverage({"a": agree, "b": agree, "o": open_, "q": quiet}) == pytest.approx(2 / 3)
    verdict, why = decided({"q": quiet})
    assert (verdict, "nothing was compared" in why) == ("indeterminate", True)


# The one number of a channel


def apart(times, name="slider_vx", tolerance=None, limits=LIMITS, u=1e-6):
    """A channel whose difference is ``times`` its threshold, by sample."""
    times = np.asarray(times, float)
    a = 0.5 + np.sin(15.7 * np.linspace(0.0, 0.4, times.size))
    size = 2.0 * u if tolerance is None else tolerance * np.ptp(a)
    of_each = u / np.sqrt(2.0) if tolerance is None else None
    return judge(a, a - times * size, of_each, name, tolerance, limits=limits)


@given(st.integers(2, 3000), st.integers(0, 40), st.sampled_from([0.99, 0.95, 0.9995, 1.0]))
def test_the_ratio_is_at_most_one_exactly_where_the_share_of_the_rule_is_within(count, outside, share):
    outside = min(outside, count - 1)
    times = np.r_[np.full(outside, 3.0), np.full(count - outside, 0.5)]
    channel = apart(times, limits=replace(LIMITS, share=share))
    if channel.verdict == "indeterminate":  # too few samples
        assert outside < LIMITS.least_outside
        assert np.isnan(channel.ratio)
    else:
        assert (channel.ratio <= 1.0) == (channel.verdict == "agree") == (channel.explained >= share)
    assert channel.largest_ratio == pytest.approx(3.0 if outside else 0.5, rel=1e-6)


def test_the_channel_with_the_largest_ratio_is_named_of_equal_ones_that_with_the_largest_maximum():
    largest = {"slider_x": 0.1, "slider_vx": 0.3, "slider_omega": 0.8, "slider_y": 0.2}
    results = {name: apart(np.full(300, times), name) for name, times in largest.items()}
    verdict, why = decided(results)
    assert verdict == "agree"
    assert why.startswith(
        "4 of 4 excited channels agree, nearest to its limit slider_omega, |E|/2u (99%) = 0.80"
    )
    spiked = np.full(300, 0.8)
    spiked[7] = 0.9
    assert "limit slider_y" in decided(results | {"slider_y": apart(spiked, "slider_y")})[1]
    spiked = np.full(300, 1.1)
    spiked[0] = 50.0  # a single sample decides nothing
    verdict, why = decided({"slider_x": apart(spiked, "slider_x"), "slider_vx": apart(np.full(300, 4.0))})
    assert (verdict, "most of all slider_vx, |E|/2u (99%) = 4.0" in why) == ("differ", True)
    # Where all lack the same none is singled out.
    assert decided({name: apart([0.5] * 9, name, u=1.0) for name in ("slider_x", "slider_vx")}) == (
        "indeterminate",
        "2 of 2 channels are indeterminate: 0.0% of the samples are predictable, required: at least 50%",
    )
