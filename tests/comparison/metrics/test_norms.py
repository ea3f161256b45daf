"""The metrics are norms, and pure numbers do not change with the unit."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from comparison.metrics.iso18571 import MOST_POINTS
from comparison.metrics.norms import (
    TUBE,
    maximum,
    resampled,
    rms,
    scaled,
    sprague_geers,
    tube_share,
)
from comparison.metrics.signal_ratings import information

# No subnormals: the root mean square of one 5e-324 among eleven zeros, 1.4e-324, is nearest to 0.
signal = arrays(np.float64, 12, elements=st.floats(-1e100, 1e100, allow_subnormal=False))
factor = st.floats(1e-150, 1e150)
seeds = st.integers(0, 2**32 - 1)
# Whole periods, so that the trapezoidal rule is exact for squares of sines.
TIME = np.linspace(0, 0.8, 2001)
PHASE = 2 * np.pi * TIME / 0.4


def noise(seed: int, size: int = 50) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Increasing times and two signals."""
    rng = np.random.default_rng(seed)
    return np.cumsum(rng.uniform(0.1, 1, size)), rng.normal(size=size), rng.normal(size=size)


def uniform(difference: np.ndarray) -> float:
    """The RMS of samples at equal distances."""
    return rms(np.arange(difference.size), difference)


def test_values_of_a_known_difference():
    difference = np.array([3.0, -4.0, 0.0, 4.0])
    assert maximum(difference) == 4.0
    assert uniform(difference) == pytest.approx(np.sqrt(41 / 4), rel=1e-15)
    assert scaled(4.0, 8.0) == 0.5


@pytest.mark.parametrize("norm", [maximum, uniform])
@given(a=signal, b=signal)
def test_norms(norm, a, b):
    assert norm(a) >= 0
    assert (norm(a) == 0) == (not a.any())
    assert norm(a) == norm(-a)
    # Round-off of twelve terms.
    assert norm(a + b) <= (norm(a) + norm(b)) * (1 + 1e-14)


@given(signal)
def test_rms_is_at_most_the_maximum_and_at_least_its_share_of_one_sample(a):
    assert maximum(a) / np.sqrt(12) * (1 - 1e-14) <= uniform(a) <= maximum(a) * (1 + 1e-14)


@pytest.mark.parametrize("norm", [maximum, uniform])
@given(a=arrays(np.float64, 12, elements=st.floats(1e-3, 1e3)), unit=factor)
def test_units_cancel(norm, a, unit):
    # Squares of 1e-150 or 1e150 would under- or overflow.
    assert scaled(norm(a * unit), 2.0 * unit) == pytest.approx(scaled(norm(a), 2.0), rel=1e-13)


@given(signal)
def test_nothing_to_measure_by_is_not_a_number(a):
    assume(a.any())
    assert np.isnan(scaled(maximum(a), 0.0))


@pytest.mark.parametrize("amplitude", [0.5, 0.999999, 1.0, 1.1, 3.0])
def test_the_magnitude_error_of_a_sine_is_that_of_its_amplitude(amplitude):
    errors = sprague_geers(TIME, np.sin(PHASE), amplitude * np.sin(PHASE))
    # Sums of 2001 terms.
    assert errors.magnitude == pytest.approx(amplitude - 1, abs=1e-14)
    assert errors.phase == pytest.approx(0, abs=1e-15)
    assert errors.combined == pytest.approx(abs(amplitude - 1), abs=1e-14)


@pytest.mark.parametrize("angle", [0.0, 1e-9, 1e-4, 0.5, 2.0, np.pi])
def test_the_phase_error_of_a_sine_is_its_shift_over_pi_down_to_the_smallest(angle):
    errors = sprague_geers(TIME, np.sin(PHASE), 1.3 * np.sin(PHASE - angle))
    # By the arc cosine 1e-9 would be 0 or 7e-9.
    assert errors.phase == pytest.approx(angle / np.pi, abs=1e-14)
    assert errors.magnitude == pytest.approx(0.3, abs=1e-14)
    assert errors.combined == pytest.approx(np.hypot(0.3, angle / np.pi), abs=1e-14)


def test_the_phase_error_grows_with_the_shift_and_not_with_the_amplitude():
    phases = [sprague_geers(TIME, np.sin(PHASE), np.sin(PHASE - angle)).phase for angle in (0.1, 0.2, 0.4)]
    assert np.all(np.diff(phases) > 0)


@given(seeds)
def test_the_errors_are_those_of_the_formulas(seed):
    time, m, c = noise(seed)
    mm, cc, mc = (np.trapezoid(product, time) for product in (m * m, c * c, m * c))
    errors = sprague_geers(time, m, c)
    # An arc cosine near 0 or pi keeps half of the digits.
    assert errors.magnitude == pytest.approx(np.sqrt(cc / mm) - 1, abs=1e-12)
    assert errors.phase == pytest.approx(np.arccos(mc / np.sqrt(mm * cc)) / np.pi, abs=1e-7)


@given(seeds)
def test_exchanging_the_signals_keeps_the_phase_and_inverts_the_magnitude(seed):
    time, m, c = noise(seed)
    there, back = sprague_geers(time, m, c), sprague_geers(time, c, m)
    assert there.phase == pytest.approx(back.phase, abs=1e-14)
    assert (1 + there.magnitude) * (1 + back.magnitude) == pytest.approx(1, abs=1e-13)


@given(seeds)
def test_a_signal_against_itself_has_no_error_and_against_its_negative_half_a_turn(seed):
    time, m, _ = noise(seed)
    assert sprague_geers(time, m, m) == (0.0, 0.0, 0.0)
    assert sprague_geers(time, m, -m) == pytest.approx((0.0, 1.0, 1.0), abs=1e-15)
    assert tube_share(time, m, m) == 1.0


@given(seeds, factor, st.sampled_from([1e-3, 60.0, 1e6]))
@example(0, 1e-300, 1.0)
@example(0, 1e300, 1.0)
def test_pure_numbers_do_not_change_with_the_units_of_signal_and_time(seed, unit, second):
    time, m, c = noise(seed)
    # The products with the units round at 1e-16.
    assert sprague_geers(second * time, unit * m, unit * c) == pytest.approx(
        sprague_geers(time, m, c), rel=1e-10, abs=1e-12
    )


def test_a_zero_signal_has_no_sprague_geers_errors():
    zero = np.zeros(TIME.shape)
    for pair in ((zero, PHASE), (PHASE, zero), (zero, zero)):
        assert np.isnan(sprague_geers(TIME, *pair)).all()


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
    assert tube_share(np.arange(400), step, step + excess * TUBE) == share


@pytest.mark.parametrize(("late", "share"), [(4, 1.0), (5, 2000 / 2001)])
def test_the_tube_is_as_wide_as_its_share_of_the_duration(late, share):
    # 0.002 of 2000 intervals are 4; the sample of a step that is later by one more is outside.
    step = (np.arange(2001) >= 1000).astype(float)
    assert tube_share(np.arange(2001), step, np.roll(step, late) * (np.arange(2001) >= 500)) == share


@given(seeds, st.sampled_from([1e-9, 1e-3, 1e3]))
def test_the_tube_does_not_change_with_the_unit(seed, unit):
    _, m, c = noise(seed, 600)
    c = m + 0.01 * c
    # Nobody is on the tube's edge to the last digit.
    time = np.arange(600)
    assert tube_share(time, unit * m, unit * c) == tube_share(time, m, c)


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
    assert found["sprague_geers_phase"] == pytest.approx(1 / np.pi, rel=1e-6)
    assert found["iso18571"] < 0.9
    assert hidden["sprague_geers_phase"] < 1e-3
    assert hidden["iso18571_corridor"] == 1.0


@given(seeds, st.floats(-1e3, 1e3))
def test_the_origin_of_a_position_does_not_matter(seed, origin):
    a = np.sin(PHASE[:200] + seed % 7)
    b = a + 0.1 * np.cos(3 * PHASE[:200])
    plain = information(TIME[:200], a, b, position=True)
    moved = information(TIME[:200], a + origin, b + origin, position=True)
    # The sum with the origin rounds at 1e-13, samples near the tube's edge may change sides.
    for name in set(plain) - {"tube_share"}:
        assert moved[name] == pytest.approx(plain[name], abs=1e-8)


def test_a_long_table_is_measured_on_five_thousand_points():
    time = np.linspace(0, 1, 200_001)
    a, b = np.sin(9 * time), 1.1 * np.sin(9 * time - 0.1)
    grid = np.linspace(0, 1, MOST_POINTS)
    short = information(grid, np.interp(grid, time, a), np.interp(grid, time, b), position=False)
    assert information(time, a, b, position=False) == short
