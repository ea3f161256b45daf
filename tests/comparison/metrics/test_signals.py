"""Measures of two signals: closed forms, the formulas themselves, and what must not change them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from comparison.metrics.iso18571 import MOST_POINTS
from comparison.metrics.signals import (
    TUBE,
    correlation,
    information,
    maximum,
    peaks,
    resampled,
    rms,
    russell,
    scaled,
    sprague_geers,
    tube_share,
)

# No subnormals: the root mean square of one 5e-324 among eleven zeros, 1.4e-324, is nearest to 0.
signal = arrays(np.float64, 12, elements=st.floats(-1e100, 1e100, allow_subnormal=False))
factor = st.floats(1e-150, 1e150)
seeds = st.integers(0, 2**32 - 1)
# Whole periods, so that the trapezoidal rule is exact for squares of sines.
TIME = np.linspace(0, 0.8, 2001)
PHASE = 2 * np.pi * TIME / 0.4
ANGULAR = (sprague_geers, russell)


def noise(seed: int, size: int = 50) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Increasing times and two signals."""
    rng = np.random.default_rng(seed)
    return np.cumsum(rng.uniform(0.1, 1, size)), rng.normal(size=size), rng.normal(size=size)


def uniform(difference: np.ndarray) -> float:
    """The RMS of samples at equal distances."""
    return rms(np.arange(difference.size), difference)


@pytest.mark.parametrize("norm", [maximum, uniform])
@given(a=signal, b=signal)
def test_norms(norm, a, b):
    assert (norm(a) == 0) == (not a.any())
    assert 0 <= norm(a) == norm(-a)
    # Round-off of twelve terms.
    assert norm(a + b) <= (norm(a) + norm(b)) * (1 + 1e-14)
    assert maximum(a) / np.sqrt(12) * (1 - 1e-14) <= uniform(a) <= maximum(a) * (1 + 1e-14)


@pytest.mark.parametrize("norm", [maximum, uniform])
@given(a=arrays(np.float64, 12, elements=st.floats(1e-3, 1e3)), unit=factor)
def test_units_cancel_and_by_nothing_nothing_is_measured(norm, a, unit):
    # Squares of 1e-150 or 1e150 would under- or overflow.
    assert scaled(norm(a * unit), 2.0 * unit) == pytest.approx(scaled(norm(a), 2.0), rel=1e-13)
    assert np.isnan(scaled(norm(a), 0.0))


def test_the_rms_of_known_values_counts_time_and_not_samples():
    assert uniform(np.array([3.0, -4.0, 0.0, 4.0])) == pytest.approx(np.sqrt(41 / 4), rel=1e-15)
    # Ten times as many samples where the signal is 2, for half of the time; the edge between is an interval.
    time = np.concatenate([np.linspace(0, 1, 1001), np.linspace(1, 2, 101)[1:]])
    assert rms(time, np.where(time <= 1, 2.0, 0.0)) == pytest.approx(np.sqrt(2), rel=5e-3)


@pytest.mark.parametrize("amplitude", [0.5, 0.999999, 1.0, 1.1, 3.0])
def test_the_magnitude_errors_of_a_sine_are_those_of_its_amplitude(amplitude):
    pair = TIME, np.sin(PHASE), amplitude * np.sin(PHASE)
    # Sums of 2001 terms.
    assert sprague_geers(*pair) == pytest.approx((amplitude - 1, 0, abs(amplitude - 1)), abs=1e-14)
    excess = amplitude - 1 / amplitude
    expected = np.sign(excess) * np.log10(1 + abs(excess))
    assert russell(*pair) == pytest.approx((expected, 0, np.sqrt(np.pi / 4) * abs(expected)), abs=1e-14)
    assert correlation(*pair) == pytest.approx(1, abs=1e-15)
    (largest, first), (other, second) = peaks(*pair)
    # 0.1 s is a sample.
    assert (largest, other) == pytest.approx((1.0, amplitude), rel=1e-15)
    assert (first, second) == pytest.approx((0.1, 0.1), abs=1e-15)


@pytest.mark.parametrize("angle", [0.0, 1e-9, 1e-4, 0.5, 2.0, np.pi])
def test_the_phase_errors_of_a_sine_are_its_shift_over_pi_down_to_the_smallest(angle):
    pair = TIME, np.sin(PHASE), 1.3 * np.sin(PHASE - angle)
    # By the arc cosine 1e-9 would be 0 or 7e-9.
    phase = angle / np.pi
    assert sprague_geers(*pair) == pytest.approx((0.3, phase, np.hypot(0.3, phase)), abs=1e-14)
    magnitude = np.log10(1 + 1.3 - 1 / 1.3)
    comprehensive = np.sqrt(np.pi / 4 * (magnitude**2 + phase**2))
    assert russell(*pair) == pytest.approx((magnitude, phase, comprehensive), abs=1e-14)
    assert correlation(*pair) == pytest.approx(np.cos(angle), abs=1e-14)


def test_a_peak_that_is_late_has_its_delay_and_both_are_sought_on_one_side():
    half_wave = np.maximum(0.0, np.sin(PHASE))
    late = 0.9 * np.roll(half_wave, 25)
    (value, at), (other, after) = peaks(TIME, half_wave, late)
    assert other - value == pytest.approx(-0.1, rel=1e-13)
    assert after - at == pytest.approx(25 * 0.0004, rel=1e-12)
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


@given(seeds)
def test_the_errors_are_those_of_the_formulas(seed):
    time, m, c = noise(seed)
    mm, cc, mc = (np.trapezoid(product, time) for product in (m * m, c * c, m * c))
    geers, russells = sprague_geers(time, m, c), russell(time, m, c)
    assert geers.magnitude == pytest.approx(np.sqrt(cc / mm) - 1, abs=1e-12)
    # An arc cosine near 0 or pi keeps half of the digits.
    assert geers.phase == russells.phase == pytest.approx(np.arccos(mc / np.sqrt(mm * cc)) / np.pi, abs=1e-7)
    excess = (cc - mm) / np.sqrt(mm * cc)
    assert russells.magnitude == pytest.approx(np.sign(excess) * np.log10(1 + abs(excess)), abs=1e-12)
    # Of a uniform grid whose ends are equal numpy's coefficient is that of all samples but one.
    a, b = (np.append(of, of[0]) for of in (m, c))
    uniform_time = np.arange(a.size)
    assert correlation(uniform_time, a, b) == pytest.approx(np.corrcoef(m, c)[0, 1], abs=1e-13)


@given(seeds, st.floats(-10, 10))
def test_exchange_sign_and_offset(seed, offset):
    time, m, c = noise(seed)
    for measure in ANGULAR:
        there, back = measure(time, m, c), measure(time, c, m)
        assert there[1] == pytest.approx(back[1], abs=1e-14)
        assert measure(time, -m, -c) == there
    geers = [sprague_geers(time, *pair).magnitude for pair in ((m, c), (c, m))]
    assert (1 + geers[0]) * (1 + geers[1]) == pytest.approx(1, abs=1e-13)
    there, back = russell(time, m, c), russell(time, c, m)
    assert back.magnitude == pytest.approx(-there.magnitude, abs=1e-14)
    assert back.comprehensive == pytest.approx(there.comprehensive, rel=1e-13)
    r = correlation(time, m, c)
    assert correlation(time, c, m) == pytest.approx(r, abs=1e-15)
    assert correlation(time, -m, c) == pytest.approx(-r, abs=1e-15)
    # The sum with the offset rounds at 1e-15.
    assert correlation(time, m + offset, 3 * c) == pytest.approx(r, abs=1e-13)
    assert peaks(time, c, m) == peaks(time, m, c)[::-1]
    turned = tuple((-value, at) for value, at in peaks(time, m, c))
    assert peaks(time, -m, -c) == turned
    raised = peaks(time, m + offset, c + offset, zero=offset)
    assert [at for _, at in raised] == [at for _, at in peaks(time, m, c)]


@given(seeds)
def test_a_signal_against_itself_has_no_error_and_against_its_negative_half_a_turn(seed):
    time, m, _ = noise(seed)
    for measure in ANGULAR:
        assert measure(time, m, m) == (0.0, 0.0, 0.0)
    assert sprague_geers(time, m, -m) == pytest.approx((0.0, 1.0, 1.0), abs=1e-15)
    assert russell(time, m, -m) == pytest.approx((0.0, 1.0, np.sqrt(np.pi / 4)), abs=1e-15)
    assert correlation(time, m, m) == pytest.approx(1, abs=1e-15)
    assert correlation(time, m, -2 * m) == pytest.approx(-1, abs=1e-15)
    assert tube_share(time, m, m) == 1.0


@given(seeds, factor, st.sampled_from([1e-3, 60.0, 1e6]))
@example(0, 1e-300, 1.0)
@example(0, 1e300, 1.0)
def test_pure_numbers_do_not_change_with_the_units_of_signal_and_time(seed, unit, second):
    time, m, c = noise(seed)
    # The products with the units round at 1e-16.
    for measure in (*ANGULAR, correlation):
        assert measure(second * time, unit * m, unit * c) == pytest.approx(
            measure(time, m, c), rel=1e-10, abs=1e-12
        )
    for (value, at), (large, later) in zip(
        peaks(time, m, c), peaks(second * time, unit * m, unit * c), strict=True
    ):
        assert (large, later) == pytest.approx((unit * value, second * at), rel=1e-15)


@pytest.mark.parametrize("samples", [101, 401, 5001])
def test_another_sampling_gives_the_same_numbers(samples):
    """Of whole periods the trapezoidal rule is exact, on any uniform grid of more samples than waves."""

    def measured(count: int) -> list[float]:
        time = np.linspace(0, 0.8, count)
        phase = 2 * np.pi * time / 0.4
        a, b = 1 + np.sin(phase), 0.8 * np.cos(phase - 1) + 0.1 * np.sin(3 * phase)
        return [*sprague_geers(time, a, b), *russell(time, a, b), correlation(time, a, b)]

    assert measured(samples) == pytest.approx(measured(2001), abs=1e-13)


def test_what_has_no_direction_has_no_errors():
    zero = np.zeros(TIME.shape)
    for pair in ((zero, PHASE), (PHASE, zero), (zero, zero)):
        assert np.isnan([measure(TIME, *pair) for measure in ANGULAR]).all()
        assert np.isnan(correlation(TIME, pair[0] + 3.0, pair[1] + 3.0))


@given(signal)
def test_the_smallest_and_the_largest_signals_do_not_break_it(a):
    assume(np.ptp(a) > 0)
    assert np.isfinite(peaks(TIME[:12], a, -a)).all()
    assert -1.0 <= correlation(TIME[:12], a, np.arange(12.0)) <= 1.0
    assert np.isfinite(russell(TIME[:12], a, np.arange(12.0))).all()


def test_the_tube_passes_a_contact_force_that_is_missing_altogether():
    """Why it is no gate: its rectangle is wider than an impact is long."""
    force = np.zeros(TIME.shape)
    force[100::200] = 50.0
    force[101::200] = 20.0
    assert tube_share(TIME, force, np.zeros(TIME.shape)) == 1.0
    assert tube_share(TIME, np.zeros(TIME.shape), force) < 1.0  # the other way round it is seen


@pytest.mark.parametrize(("excess", "share"), [(0.99, 1.0), (1.01, 1 / 400)])
def test_the_tube_of_a_signal_is_as_high_as_its_share_of_the_range(excess, share):
    # Steps are as wide as they are high: away from them only the height counts. To 0.8 of an interval beside
    # the step belongs what the line up to it passes, which is more.
    step = np.repeat([0.0, 1.0], 200)
    for unit in (1e-9, 1.0, 1e3):
        assert tube_share(np.arange(400), unit * step, unit * (step + excess * TUBE)) == share


@pytest.mark.parametrize(("late", "share"), [(4, 1.0), (5, 2000 / 2001)])
def test_the_tube_is_as_wide_as_its_share_of_the_duration(late, share):
    # 0.002 of 2000 intervals are 4; the sample of a step that is later by one more is outside.
    step = (np.arange(2001) >= 1000).astype(float)
    assert tube_share(np.arange(2001), step, np.roll(step, late) * (np.arange(2001) >= 500)) == share


def test_resampling_keeps_what_is_on_a_uniform_grid_and_shortens_what_is_long():
    grid, (same,) = resampled(TIME, (np.sin(PHASE),), 5000)
    # Both grids round at 1e-16 s, times the largest rate of 16 /s.
    np.testing.assert_allclose(same, np.sin(PHASE), atol=1e-14)
    grid, (line, other) = resampled(np.arange(10_000.0), (np.arange(10_000.0), np.ones(10_000)), 5000)
    assert grid.size == line.size == other.size == 5000
    assert (grid[0], grid[-1]) == (0.0, 9999.0)
    np.testing.assert_allclose(line, grid, rtol=1e-15)


def test_a_position_is_measured_from_its_mean_lest_a_large_constant_hides_the_difference():
    a, b = -0.55 + 2e-4 * np.sin(PHASE), -0.55 + 2e-4 * np.sin(PHASE - 1.0)
    found, hidden = information(TIME, a, b, position=True), information(TIME, a, b, position=False)
    # The last sample repeats the first, which moves the mean by 1 / 2001 of it.
    for name in ("sprague_geers_phase", "russell_phase"):
        assert found[name] == pytest.approx(1 / np.pi, rel=1e-6)
        assert hidden[name] < 1e-3
    assert found["iso18571"] < 0.9
    assert hidden["iso18571_corridor"] == 1.0
    assert found["correlation"] == pytest.approx(np.cos(1.0), abs=1e-6)
    # The peak has its own value, and its delay is that of the wave, to half a sample.
    assert found["peak_a"] == pytest.approx(-0.5498, abs=1e-9)
    assert found["peak_time_difference"] == pytest.approx(0.4 / 2 / np.pi, abs=0.0002)


@given(st.integers(0, 6), st.floats(-1e3, 1e3))
def test_the_origin_of_a_position_does_not_matter(turn, origin):
    a = np.sin(PHASE[:200] + turn)
    b = a + 0.1 * np.cos(3 * PHASE[:200])
    plain = information(TIME[:200], a, b, position=True)
    moved = information(TIME[:200], a + origin, b + origin, position=True)
    # The sum with the origin rounds at 1e-13, samples near the tube's edge may change sides.
    for name in set(plain) - {"tube_share"}:
        by = origin if name in ("peak_a", "peak_b") else 0.0
        assert moved[name] == pytest.approx(plain[name] + by, abs=1e-8)


def test_a_long_table_is_measured_on_five_thousand_points_and_its_peaks_on_all():
    time = np.linspace(0, 1, 200_001)
    a, b = 2 + np.sin(9 * time), 2.2 + 1.1 * np.sin(9 * time - 0.1)
    grid = np.linspace(0, 1, MOST_POINTS)
    short = information(grid, np.interp(grid, time, a), np.interp(grid, time, b), position=False)
    found = information(time, a, b, position=False)
    of_peaks = {name for name in found if name.startswith("peak")}
    assert {name: found[name] for name in found.keys() - of_peaks} == {
        name: short[name] for name in short.keys() - of_peaks
    }
    # A sample is within half an interval, 2.5e-6 s, of the crest; it is lower by (9 * 2.5e-6)^2 / 2.
    assert found["peak_difference"] == pytest.approx(0.3, abs=1e-9)
    assert found["peak_time_difference"] == pytest.approx(0.1 / 9, abs=5e-6)
