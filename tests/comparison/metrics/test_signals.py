"""Measures of two signals: closed forms, and what must not change them (tests/judge has second ones)."""

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from comparison.metrics import (
    correlation,
    measures,
    peaks,
    rms,
)

seeds = st.integers(0, 2**32 - 1)
# Whole periods, so that the trapezoidal rule is exact for squares of sines.
TIME = np.linspace(0, 0.8, 2001)
PHASE = 2 * np.pi * TIME / 0.4


def noise(seed, size=50):
    """Increasing times and two signals."""
    rng = np.random.default_rng(seed)
    return np.cumsum(rng.uniform(0.1, 1, size)), rng.normal(size=size), rng.normal(size=size)


def test_the_rms_of_known_values_counts_time_and_not_samples():
    assert rms(np.arange(4), np.array([3.0, -4.0, 0.0, 4.0])) == pytest.approx(np.sqrt(41 / 4), rel=1e-15)
    # Ten times as many samples where the signal is 2, for half of the time; the edge between is an interval.
    time = np.concatenate([np.linspace(0, 1, 1001), np.linspace(1, 2, 101)[1:]])
    assert rms(time, np.where(time <= 1, 2.0, 0.0)) == pytest.approx(np.sqrt(2), rel=5e-3)


def test_a_peak_that_is_late_has_its_delay_and_both_are_sought_on_one_side():
    half_wave = np.maximum(0.0, np.sin(PHASE))
    late = 0.9 * np.roll(half_wave, 25)
    (value, at), (other, after) = peaks(TIME, half_wave, late)
    assert (other - value, after - at) == pytest.approx((-0.1, 25 * 0.0004), rel=1e-12)
    # A wave as high as it is deep, seen through errors that make the one higher and the other deeper.
    wave = np.sin(PHASE)
    a, b = wave + 1e-6 * (wave > 0.999), wave - 1e-6 * (wave < -0.999)
    (value, at), (other, after) = peaks(TIME, a, b)
    assert (value, other) == pytest.approx((1.0, 1.0), abs=2e-6)
    assert at == after
    # Periods that differ by round-off: the first counts, in both.
    higher = wave * np.where(TIME > 0.4, 1 + 1e-15, 1.0)
    assert [at for _, at in peaks(TIME, wave, higher)] == pytest.approx([0.1, 0.1], abs=1e-15)
    # What goes below its zero has its peak there, and keeps its own value.
    (value, _), (other, _) = peaks(TIME, -0.55 - half_wave, -0.55 - late, zero=-0.55)
    assert (value, other) == pytest.approx((-1.55, -1.45), rel=1e-15)


def test_a_peak_between_the_samples_counts_where_it_goes_farther():
    half_wave = np.maximum(0.0, np.sin(PHASE))
    between = [(0.05, -1e-3), (0.123, 1.5)], [(0.321, 1.25)]
    assert peaks(TIME, half_wave, half_wave, between=between) == ((1.5, 0.123), (1.25, 0.321))
    lower = [(0.05, 0.9)], [(0.321, 0.9)]
    assert peaks(TIME, half_wave, half_wave, between=lower) == peaks(TIME, half_wave, half_wave)


@given(seeds, st.floats(1e-150, 1e150), st.sampled_from([1e-3, 60.0, 1e6]))
@example(0, 1e-300, 1.0)
@example(0, 1e300, 1.0)
def test_pure_numbers_do_not_change_with_the_units_of_signal_and_time(seed, unit, second):
    time, m, c = noise(seed)
    scaled_pair = second * time, unit * m, unit * c
    # The products with the units round at 1e-16.
    assert correlation(*scaled_pair) == pytest.approx(correlation(time, m, c), rel=1e-10, abs=1e-12)
    expected = [(unit * value, second * at) for value, at in peaks(time, m, c)]
    assert np.array(peaks(*scaled_pair)) == pytest.approx(np.array(expected), rel=1e-15)


def test_a_constant_has_no_correlation():
    zero = np.zeros(TIME.shape)
    for pair in ((zero, PHASE), (PHASE, zero), (zero, zero)):
        assert np.isnan(correlation(TIME, pair[0] + 3.0, pair[1] + 3.0))


def test_the_peak_of_a_position_is_sought_from_its_mean():
    a, b = -0.55 + 2e-4 * np.sin(PHASE), -0.55 + 2e-4 * np.sin(PHASE - 1.0)
    result = measures(TIME, a, b, position=True)
    # The last sample repeats the first, which moves the mean by 1 / 2001 of it.
    assert result["correlation"] == pytest.approx(np.cos(1.0), abs=1e-6)
    # The peak has its own value, and its delay is that of the wave, to half a sample.
    assert result["peak_a"] == pytest.approx(-0.5498, abs=1e-9)
    assert result["peak_time_difference"] == pytest.approx(0.4 / 2 / np.pi, abs=0.0002)
    assert measures(TIME, a, b, position=False)["peak_a"] == pytest.approx(-0.5502, abs=1e-9)
