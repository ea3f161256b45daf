"""The rating of ISO/TS 18571 against an independent implementation, and in cases whose answer is known."""

import numba
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from objective_rating_metrics.rating import ISO18571

from comparison.metrics import signals
from comparison.metrics.signals import MOST_POINTS, best_shift, rating, warped_difference

SCORES = ("overall", "corridor", "phase", "magnitude", "slope")


def independent(reference, other):
    """The scores by the package of TU Graz, whose time is in samples here."""
    samples = np.arange(reference.size, dtype=float)
    known = ISO18571(np.column_stack([samples, reference]), np.column_stack([samples, other]), dt=1.0)
    return [getattr(known, f"{name}_rating")(ndigits=15) for name in SCORES]


def wave(seed, size):
    """A sum of five sines with random sizes, phases and up to six periods."""
    rng = np.random.default_rng(seed)
    size_, periods, phase = rng.normal(size=5), rng.uniform(0.3, 6, 5), rng.uniform(0, 2 * np.pi, 5)
    return np.sin(2 * np.pi * np.outer(np.linspace(0, 1, size), periods) + phase) @ size_


@pytest.mark.parametrize("size", [20, 33, 99, 200, 401])
@pytest.mark.parametrize("likeness", [0.0, 0.3, 0.9, 0.999])
def test_an_independent_implementation_gives_the_same_scores(size, likeness):
    for seed in range(3):
        reference = wave(seed, size)
        other = likeness * reference + (1 - likeness) * wave(seed + 50, size)
        # Sums of some hundred terms; a cost that both round differently might choose another path, where
        # costs are equal: seldom for sines.
        assert rating(reference, other) == pytest.approx(independent(reference, other), abs=1e-12)


@given(st.integers(0, 2**32 - 2), st.sampled_from([1e-200, 1e-9, 25.4, 1e12, 1e200]))
@settings(max_examples=30)
def test_the_unit_does_not_matter_and_a_signal_against_itself_is_perfect(seed, unit):
    reference, other = wave(seed, 120), wave(seed, 120) + 0.2 * wave(seed + 1, 120)
    # The product with the unit rounds each sample at 1e-16; 0.4 + 0.2 * 3 rounds.
    assert rating(unit * reference, unit * other) == pytest.approx(rating(reference, other), abs=1e-11)
    assert rating(reference, reference) == pytest.approx([1.0] * 5, abs=1e-15)


@pytest.mark.parametrize("late", [-60, -1, 0, 1, 7, 60])
def test_a_shift_is_found_and_costs_its_share_of_a_fifth_of_the_duration(late):
    long = wave(3, 500)
    reference, other = long[100:400], long[100 - late : 400 - late]
    assert best_shift(reference, other) == late
    result = rating(reference, other)
    assert result.phase == pytest.approx(1 - abs(late) / (0.2 * 300), abs=1e-15)
    # The common parts are equal.
    assert (result.magnitude, result.slope) == (1.0, 1.0)


def test_of_equal_shifts_the_smallest_counts():
    # A ramp is fully correlated with itself at every shift, a periodic wave at every period.
    ramp = np.linspace(0, 1, 200)
    assert best_shift(ramp, 3 * ramp + 1) == 0
    period = np.tile(np.sin(2 * np.pi * np.arange(20) / 20), 10)
    assert best_shift(period, np.roll(period, 5)) == 5
    assert best_shift(period, np.roll(period, 10)) == 10  # late before early


@pytest.mark.parametrize("constant", [0.0, -0.55])
def test_a_constant_has_no_rating(constant):
    flat, signal = np.full(50, constant), wave(0, 50)
    for pair in ((flat, signal), (signal, flat), (flat, flat), (signal[:9], signal[:9])):
        assert np.isnan(rating(*pair)).all()


def test_five_thousand_points_are_not_looped_over_and_more_are_refused(lines_run):
    signal, other = wave(0, MOST_POINTS), wave(1, MOST_POINTS)
    rating(signal[:20], other[:20])  # compiles, once
    # 400; the warping alone looks at a million pairs of points.
    assert lines_run(lambda: rating(signal, other)) < 5000
    with pytest.raises(ValueError, match="5001 samples"):
        rating(wave(0, 5001), wave(1, 5001))


@pytest.mark.parametrize("suffix", ["nbi", "nbc"])
def test_a_damaged_file_of_compiled_code_is_not_needed(suffix, tmp_path, monkeypatch):
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    reference, other = np.sin(np.linspace(0, 6, 50)), np.sin(np.linspace(0.1, 6.1, 50))
    try:
        signals._warp.cache_clear()
        first = warped_difference(reference, other)
        (path,) = tmp_path.rglob(f"*.{suffix}")
        path.write_bytes(path.read_bytes()[:100])
        signals._warp.cache_clear()
        assert warped_difference(reference, other) == first
    finally:
        signals._warp.cache_clear()
