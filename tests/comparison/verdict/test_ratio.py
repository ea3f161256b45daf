"""The one number of a channel, |E| / threshold, and the channel that a verdict names by it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from judged_runs import decided

from comparison.accuracy.thresholds import thresholds
from comparison.tables.channels import channels
from comparison.verdict.channel import compare_channel
from comparison.verdict.results import decisive

LIMITS = thresholds()


def judged(times, name="slider_vx", tolerance=None, limits=LIMITS, u=1e-6):
    """Judge a channel whose difference is ``times`` its threshold, by sample."""
    times = np.asarray(times, float)
    time = np.linspace(0.0, 0.4, times.size)
    a = 0.5 + np.sin(15.7 * time)
    of_each = u / np.sqrt(2.0)
    size = 2.0 * u if tolerance is None else tolerance * np.ptp(a)
    both = (np.full(times.size, of_each),) * 2 if tolerance is None else (None, None)
    return compare_channel(
        channels()[name], time, a, a - times * size, scene=None, u=both, tolerance=tolerance, limits=limits
    )


@given(st.integers(2, 3000), st.integers(0, 40), st.sampled_from([0.99, 0.95, 0.9995, 1.0]))
def test_the_ratio_is_at_most_one_exactly_where_the_share_of_the_rule_is_within(count, outside, share):
    outside = min(outside, count - 1)
    channel = judged(
        np.r_[np.full(outside, 3.0), np.full(count - outside, 0.5)], limits=replace(LIMITS, share=share)
    )
    if channel.verdict == "indeterminate":  # too few samples
        assert outside < LIMITS.least_outside
        assert np.isnan(channel.ratio)
    else:
        assert (channel.ratio <= 1.0) == (channel.verdict == "agree") == (channel.explained >= share)
    assert channel.largest_ratio == pytest.approx(3.0 if outside else 0.5, rel=1e-6)


def test_the_ratio_is_the_quantile_of_the_rule_and_the_maximum_is_another_number():
    channel = judged(np.linspace(0.01, 2.0, 200))  # 198 of 200 are 99 %
    assert (channel.ratio, channel.largest_ratio) == (pytest.approx(1.98), pytest.approx(2.0))
    assert channel.ratio_name == "|E|/2u (99%)"
    allowed = judged(np.linspace(0.01, 2.0, 200), tolerance=1e-3)
    assert (allowed.ratio, allowed.largest_ratio) == (pytest.approx(2.0), pytest.approx(2.0))
    assert allowed.ratio_name == "|E|/tolerance"


def test_what_is_not_judged_has_no_ratio():
    assert np.isnan(judged([0.5] * 9, u=1.0).ratio)  # nothing is predictable
    assert decisive([judged([0.5] * 9, u=1.0)]) is None


def test_equal_shares_do_not_name_the_first_channel():
    names = ("slider_x", "slider_vx", "slider_omega", "slider_y")
    largest = (0.1, 0.3, 0.8, 0.2)
    results = {name: judged(np.full(100, times), name) for name, times in zip(names, largest, strict=True)}
    assert {channel.explained for channel in results.values()} == {1.0}
    verdict, reason = decided(results)
    assert verdict == "agree"
    assert reason.startswith(
        "4 of 4 excited channels agree, nearest to its limit slider_omega, |E|/2u (99%) = 0.80: 0 of 100 "
    )
    assert "least of all" not in reason
    # Of equal ratios the larger maximum decides.
    spiked = np.full(300, 0.8)
    spiked[7] = 0.9
    assert decided(results | {"slider_y": judged(spiked, "slider_y")})[1].count("limit slider_y") == 1


def test_of_channels_that_differ_the_farthest_by_the_rule_is_named():
    spike = np.full(300, 1.1)
    spike[0] = 50.0  # a single sample decides nothing
    results = {"slider_x": judged(spike, "slider_x"), "slider_vx": judged(np.full(300, 4.0))}
    verdict, reason = decided(results)
    assert (verdict, reason.split(":")[0]) == (
        "differ",
        "2 of 2 channels differ, most of all slider_vx, |E|/2u (99%) = 4.0",
    )


def test_where_all_channels_lack_the_same_none_is_singled_out():
    results = {name: judged([0.5] * 9, name, u=1.0) for name in ("slider_x", "slider_vx")}
    assert decided(results) == (
        "indeterminate",
        "2 of 2 channels are indeterminate: 0.0% of the samples are predictable, required: at least 50%",
    )
