"""Measures of two signals, and of a run among others: closed forms (tests/judge has second ones)."""

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from comparison.accuracy.levels import thresholds
from comparison.accuracy.uncertainty import ENSEMBLE_FACTOR
from comparison.metrics import correlation, distances, measures, peaks

seeds = st.integers(0, 2**32 - 1)
# Whole periods, so that the trapezoidal rule is exact for squares of sines.
TIME = np.linspace(0, 0.8, 2001)
PHASE = 2 * np.pi * TIME / 0.4


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
    rng = np.random.default_rng(seed)
    time, m, c = np.cumsum(rng.uniform(0.1, 1, 50)), rng.normal(size=50), rng.normal(size=50)
    scaled_pair = second * time, unit * m, unit * c
    # The products with the units round at 1e-16.
    assert correlation(*scaled_pair) == pytest.approx(correlation(time, m, c), rel=1e-10, abs=1e-12)
    expected = [(unit * value, second * at) for value, at in peaks(time, m, c)]
    assert np.array(peaks(*scaled_pair)) == pytest.approx(np.array(expected), rel=1e-15)


def test_the_peak_of_a_position_is_sought_from_its_mean():
    a, b = -0.55 + 2e-4 * np.sin(PHASE), -0.55 + 2e-4 * np.sin(PHASE - 1.0)
    result = measures(TIME, a, b, position=True)
    assert np.isnan(correlation(TIME, np.full(TIME.shape, 3.0), a))  # a constant has none
    # The last sample repeats the first, which moves the mean by 1 / 2001 of it.
    assert result["correlation"] == pytest.approx(np.cos(1.0), abs=1e-6)
    # The peak has its own value, and its delay is that of the wave, to half a sample.
    assert result["peak_a"] == pytest.approx(-0.5498, abs=1e-9)
    assert result["peak_time_difference"] == pytest.approx(0.4 / 2 / np.pi, abs=0.0002)
    assert measures(TIME, a, b, position=False)["peak_a"] == pytest.approx(-0.5502, abs=1e-9)


# ---- runs held against an ensemble


@pytest.mark.parametrize("seed", range(5))
def test_left_out_members_are_held_against_the_others_and_a_run_against_all(seed):
    members, run = np.split(np.random.default_rng(seed).normal(size=(9, 5)) ** 3, [8])
    floor = np.full(5, 0.5)

    def away(one, others):
        return (np.abs(one - others.mean(axis=0)) / np.maximum(others.std(axis=0), floor)).max()

    of_members, of_run = distances(members, run[0], floor)
    expected = [away(members[n], np.delete(members, n, axis=0)) for n in range(8)]
    np.testing.assert_allclose(of_members, expected, rtol=1e-12)
    assert of_run == pytest.approx(away(run[0], members))
    assert distances(members[:, :0], np.empty(0), np.empty(0))[1] == 0.0


@example(members=[1000.0] * 18 + [-1000.0], side=1.0)  # the closest case: all but one on the run's side
@given(
    members=st.lists(st.floats(-1000.0, 1000.0), min_size=19, max_size=30), side=st.sampled_from([-1.0, 1.0])
)
def test_what_an_ensemble_does_not_exclude_its_uncertainty_explains(members, side):
    """A run just outside k u of the base, u the ensemble's, is farther out than every member left out."""
    ensemble = np.array(members)[:, None]
    u = np.maximum(ENSEMBLE_FACTOR * np.abs(ensemble).max(axis=0), 1e-3)
    of_members, of_run = distances(ensemble, side * thresholds().k * u, u)
    assert of_run >= of_members.max() * (1 - 1e-12)
