"""One channel's verdict: what it says of signals whose difference and uncertainty are known."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from judged_runs import decided

from comparison.accuracy.thresholds import thresholds
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


def judge(a, b, u=None, tolerance=None, channel="slider_ax", scene=None, known: Channel | None = None):
    """Compare with the same uncertainty in both; None: none."""
    both = (None, None) if u is None else tuple(np.broadcast_to(np.asarray(u, float), a.shape) for _ in "ab")
    return compare_channel(
        known or channels()[channel], TIME, a, b, scene=scene, u=both, tolerance=tolerance, limits=LIMITS
    )


def test_the_tiers_are_those_of_the_method():
    assert (LIMITS.k, LIMITS.share, LIMITS.alpha, LIMITS.coverage) == (2.0, 0.99, 0.01, 0.5)
    tight = thresholds("tight")
    assert (tight.k, tight.share, tight.alpha, tight.coverage) == (2.0, 0.99, 5e-5, 0.25)


@pytest.mark.parametrize(("times_u", "verdict"), [(1.99, "agree"), (2.01, "differ")])
def test_a_difference_is_explained_up_to_twice_the_combined_uncertainty(times_u, verdict):
    u = 1e-5
    result = judge(WAVE, WAVE - times_u * np.sqrt(2) * u, u)
    assert result.verdict == verdict
    assert result.worst_threshold == pytest.approx(2 * np.sqrt(2) * u, rel=1e-12)
    # Differences of numbers around 1 round at 1e-16.
    assert result.worst_difference == pytest.approx(times_u * np.sqrt(2) * u, rel=1e-9)


@pytest.mark.parametrize(("unexplained", "verdict"), [(10, "agree"), (11, "differ")])
def test_one_sample_in_a_hundred_may_be_unexplained(unexplained, verdict):
    b = WAVE.copy()
    b[100 : 100 + unexplained] += 1e-3
    a = WAVE + 1e-9  # no sample is zero in both
    result = judge(a, b, 1e-6)
    assert result.verdict == verdict
    assert result.explained == pytest.approx(1 - unexplained / N, abs=1e-12)
    assert 100 <= np.flatnonzero(result.worst_time == TIME)[0] < 100 + unexplained


@pytest.mark.parametrize(("predictable", "verdict"), [(500, "agree"), (499, "indeterminate")])
def test_half_of_the_samples_must_be_predictable(predictable, verdict):
    scale = float(np.ptp(WAVE))
    u = np.full(N, scale)
    u[:predictable] = 0.01 * scale / np.sqrt(2) * (1 - 1e-12)
    result = judge(WAVE, WAVE, u)
    assert result.verdict == verdict
    assert result.coverage == predictable / N
    assert result.predictable.sum() == predictable


@pytest.mark.parametrize(("unexplained", "verdict"), [(10, "indeterminate"), (11, "differ")])
def test_a_difference_shows_where_little_is_predictable_if_no_other_sample_could_undo_it(
    unexplained, verdict
):
    """A fault after which a motion is chaotic hides in its own uncertainty, but not before."""
    u = np.where(np.arange(N) < 150, 1e-6, 1.0)
    a = WAVE + 1e-9  # no sample is zero in both
    b = WAVE + np.where((np.arange(N) >= 100) & (np.arange(N) < 100 + unexplained), 1e-3, 0.0)
    result = judge(a, b, u)
    assert result.coverage == 0.15
    assert result.verdict == verdict
    assert result.outside == unexplained
    assert "15.0% of the samples are predictable" in reason(result)
    # Ensembles are held against what decided, not against the largest u.
    mask, of = judged_samples(result)
    assert np.flatnonzero(mask).tolist() == list(range(150))
    assert of.max() == pytest.approx(np.sqrt(2) * 1e-6)


def test_the_unpredictable_part_neither_helps_nor_hurts():
    u = np.where(TIME < 0.3, 1e-6, 1.0)
    b = WAVE + np.where(TIME < 0.3, 0.0, 0.7)
    result = judge(WAVE, b, u)
    assert result.verdict == "agree"
    assert result.max_difference == pytest.approx(0.7)  # but it is reported
    assert judge(WAVE, WAVE + np.where(TIME < 0.3, 1e-3, 0.0), u).verdict == "differ"


def test_a_force_that_is_zero_throughout_differs_from_rare_impacts():
    force = np.zeros(N)
    force[[50, 51, 400, 800]] = [
        30.0,
        10.0,
        50.0,
        20.0,
    ]  # 0.4 % of the samples: fewer than may be unexplained
    for a, b in ((force, np.zeros(N)), (np.zeros(N), force)):
        result = judge(a, b, 1e-6, channel="corner_ll_normal", scene=SCENE)
        assert result.verdict == "differ"
        assert result.explained == 0.0
        assert judge(a, b, tolerance=0.01, channel="corner_ll_normal").verdict == "differ"
    # To agree, four samples are too few.
    assert judge(force, force, 1e-6, channel="corner_ll_normal", scene=SCENE).verdict == "indeterminate"


@pytest.mark.parametrize(
    ("judged", "outside", "verdict"),
    [
        (4, 0, "indeterminate"),
        (9, 2, "indeterminate"),
        (9, 3, "differ"),
        (10, 0, "agree"),
        (10, 1, "indeterminate"),
        (250, 2, "agree"),
        (150, 2, "indeterminate"),
        (150, 3, "differ"),
        (400, 4, "agree"),
        (400, 5, "differ"),
    ],
)
def test_one_or_two_samples_decide_nothing(judged, outside, verdict):
    force = np.where(np.arange(N) < judged, 20.0, 0.0)
    other = force + np.where(np.arange(N) < outside, 1.0, 0.0)
    assert judge(force, other, 1e-6, channel="corner_ll_normal", scene=SCENE).verdict == verdict


def test_a_force_of_which_no_impact_is_predictable_is_not_called_agreement():
    force = np.zeros(N)
    force[400:404] = 50.0
    u = np.where(force > 0, 10.0, 1e-9)
    result = judge(force, np.zeros(N), u, channel="corner_ll_normal", scene=SCENE)
    assert result.coverage > 0.99
    assert result.verdict == "indeterminate"
    assert np.isnan(result.explained)
    assert np.isnan(result.worst_time)


def test_nothing_happening_in_both_is_unexcited_and_not_agreement():
    quiet = np.full(N, -0.55)
    result = judge(quiet, quiet + 1e-14, 1e-16, channel="slider_x", scene=SCENE)
    assert result.verdict == "unexcited"
    assert judge(quiet, quiet, channel="slider_x").verdict == "unexcited"


@pytest.mark.parametrize("other", [np.full(N, -0.5499), -0.55 + 1e-6 * WAVE])
def test_a_quiet_channel_against_another_place_or_an_excited_one_differs(other):
    quiet = np.full(N, -0.55)
    assert judge(quiet, other, 1e-12, channel="slider_x", scene=SCENE).verdict == "differ"
    assert judge(other, quiet, 1e-12, channel="slider_x", scene=SCENE).verdict == "differ"


def test_without_uncertainty_and_tolerance_there_are_metrics_and_no_verdict():
    result = judge(WAVE, 1.001 * WAVE)
    assert result.verdict == "indeterminate"
    assert result.u is None
    assert result.predictable.all()
    assert result.max_scaled == pytest.approx(1e-3 / 2, rel=1e-4)  # of the peak-to-peak of the first


@pytest.mark.parametrize(("tolerance", "verdict"), [(5.01e-4, "agree"), (4.9e-4, "differ")])
def test_the_tolerance_is_a_share_of_the_scale(tolerance, verdict):
    # A constant difference of 5e-4 of the scale 2.
    b = WAVE + 1e-3
    scale = float(max(WAVE.max(), b.max()) - min(WAVE.min(), b.min()))
    assert judge(WAVE, b, tolerance=tolerance * 2 / scale).verdict == verdict


def test_one_table_with_uncertainty_is_not_enough():
    result = compare_channel(
        channels()["slider_ax"], TIME, WAVE, WAVE, scene=None, u=(np.full(N, 1e-6), None), tolerance=None,
        limits=LIMITS,
    )  # fmt: skip
    assert result.verdict == "indeterminate"


@given(
    unit=st.sampled_from([1e-9, 1e-3, 2.0, 25.4, 1e3, 1e12]),
    shift=st.floats(0, 3e-5),
    level=st.floats(1e-7, 0.02),
    share=st.floats(0, 1),
)
def test_the_verdict_does_not_change_with_the_unit(unit, shift, level, share):
    u = np.where(np.linspace(0, 1, N) < share, level, 1e-6)
    metre = channels()["slider_ax"]
    other = Channel(**(vars(metre) | {"floor": metre.floor * unit, "round_off": metre.round_off * unit}))
    # Not where a threshold is met exactly: there the last digit decides.
    first = judge(WAVE, WAVE + shift, u)
    second = judge(unit * WAVE, unit * (WAVE + shift), u * unit, known=other)
    near = min(
        abs(np.abs(first.difference) / (2 * first.u) - 1).min(), abs(first.u / (0.01 * first.scale) - 1).min()
    )
    if near > 1e-9:
        assert (first.verdict, first.coverage) == (second.verdict, second.coverage)
        np.testing.assert_allclose(
            [first.max_scaled, first.rms_scaled, first.explained],
            [second.max_scaled, second.rms_scaled, second.explained],
            rtol=1e-9,
            atol=1e-15,
        )


@pytest.mark.parametrize("level", [1e-9, 1e-6, 1e-2])
@pytest.mark.parametrize(("shift", "verdict"), [(1e-9, "agree"), (1e-6, "differ")])
@pytest.mark.parametrize("name", ["slider_x", "slider_y", "slider_angle", "slider_vx", "slider_omega"])
def test_nor_when_a_channel_and_the_clearance_that_is_its_scale_are_a_thousand_times_larger(
    name, shift, verdict, level
):
    channel = channels()[name]
    large = SCENE | {"clearance": {joint: 1000 * size for joint, size in SCENE["clearance"].items()}}
    other = Channel(
        **(vars(channel) | {"floor": channel.floor * 1000, "round_off": channel.round_off * 1000})
    )
    scale = channel.scale_value(SCENE, 0.0)
    signal, u = scale * WAVE, np.where(TIME < 0.25, 1e-9, level) * scale
    first = judge(signal, signal + shift * scale, u, channel=name, scene=SCENE)
    second = judge(1000 * signal, 1000 * (signal + shift * scale), 1000 * u, known=other, scene=large)
    # Where u is least the threshold is 2.8e-9 of the scale.
    assert first.verdict == verdict
    assert (first.verdict, first.coverage, first.explained) == (
        second.verdict,
        second.coverage,
        second.explained,
    )
    # The signals round at 1e-16 of the scale, and their difference is at least 1e-9 of it.
    assert second.max_scaled == pytest.approx(first.max_scaled, rel=1e-6)
    assert second.metrics == pytest.approx(first.metrics, abs=1e-9)


@given(st.integers(0, 2**32 - 1))
def test_exchanging_the_two_changes_nothing_but_the_sign(seed):
    rng = np.random.default_rng(seed)
    a, b = WAVE + 1e-5 * rng.normal(size=(2, N))
    u = 10 ** rng.uniform(-7, -1, N)
    first, second = judge(a, b, u), judge(b, a, u)
    np.testing.assert_array_equal(first.difference, -second.difference)
    assert (first.verdict, first.explained, first.coverage) == (
        second.verdict,
        second.explained,
        second.coverage,
    )


def test_a_force_is_predictable_only_where_its_position_is():
    """All runs of one model may have a force of zero although nobody knows where the corner is."""
    force, known = np.where(np.abs(np.arange(N) - 20) < 5, 1.0, 0.0), np.arange(N) > 50
    options = {"scene": SCENE, "u": (np.full(N, 1e-9), np.full(N, 1e-9)), "tolerance": None, "limits": LIMITS}
    channel = channels()["corner_ll_normal"]
    assert channel.follows == "corner_ll_gap"
    alone = compare_channel(channel, TIME, force, 0 * force, **options)
    assert alone.verdict == "differ"
    masked = compare_channel(channel, TIME, force, 0 * force, within=known, **options)
    np.testing.assert_array_equal(masked.predictable, known)
    assert masked.verdict == "indeterminate"


def test_the_scene_takes_the_worst_verdict_and_nothing_excited_is_not_agreement():
    agree, differ = judge(WAVE, WAVE + 1e-7, 1e-6), judge(WAVE, WAVE + 1e-3, 1e-6)
    open_, quiet = judge(WAVE, WAVE), judge(0 * WAVE, 0 * WAVE)
    assert [c.verdict for c in (agree, differ, open_, quiet)] == [
        "agree",
        "differ",
        "indeterminate",
        "unexcited",
    ]
    assert scene_verdict({"a": agree, "q": quiet}, 0.5) == "agree"
    assert scene_verdict({"a": agree, "o": open_, "p": open_, "q": quiet}, 0.5) == "indeterminate"
    assert scene_verdict({"o": open_, "q": quiet}, 0.5) == "indeterminate"
    assert scene_verdict({"a": agree, "o": open_, "d": differ}, 0.5) == "differ"
    verdict, why = decided({"a": agree, "b": agree, "o": open_})
    assert verdict == "agree"
    assert "; indeterminate: " in why
    # The third has no uncertainty to judge by: it covers nothing.
    assert "66.66% of all samples are predictable" in why
    assert scene_coverage({"a": agree, "b": agree, "o": open_, "q": quiet}) == pytest.approx(2 / 3)
    verdict, why = decided({"q": quiet})
    assert verdict == "indeterminate"
    assert "nothing was compared" in why


@pytest.mark.parametrize("channel", ["slider_x", "slider_vx"])
def test_a_unit_that_leaves_nothing_predictable_differs_and_a_motion_that_does_so_does_not(channel):
    """Metres against millimetres: the uncertainty, in millimetres as well, exceeds alpha everywhere."""
    position = -0.55 + 1e-4 * WAVE if channel == "slider_x" else 0.1 * WAVE
    scale = channels()[channel].scale_value(SCENE, np.nan)
    small = 1e-4 * scale
    u = (np.full(N, small), np.full(N, 1e3 * small))
    options = {"scene": SCENE, "tolerance": None, "limits": LIMITS}
    result = compare_channel(channels()[channel], TIME, position, 1e3 * position, u=u, **options)
    assert result.coverage == 0.0
    assert result.verdict == "differ"
    assert abs(result.worst_difference) > result.worst_threshold == pytest.approx(2e3 * small, rel=1e-6)
    assert scene_verdict({channel: result, "other": judge(WAVE, WAVE, 1e-6)}, 0.5) == "differ"
    # Neighbours that have spread by as much as the motion itself: its largest uncertainty explains them.
    spread = np.where(TIME < 0.1, small, 3 * np.ptp(position))
    apart = np.where(TIME < 0.1, position, position[::-1]) + small
    unknown = compare_channel(channels()[channel], TIME, position, apart, u=(spread, spread), **options)
    assert unknown.verdict == "indeterminate"
