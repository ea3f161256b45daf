"""First-order second moments: a plane's known answer, a rough response, and intervals that cover."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import norm

from comparison.studies.random_inputs.second_moment import (
    counted_probability,
    failure_probability,
    fit_plane,
    paired_change,
)

SLOPES = np.array([3.0, 0.0, -4.0])


def drawn(rng, n, rough=0.0, scale=1.0):
    """A plane with roughness of a wave length far below any scatter of the inputs."""
    u = scale * rng.normal(size=(n, 3))
    return u, 10.0 + u @ SLOPES + rough * np.sqrt(2.0) * np.sin(1e7 * u[:, 0])


def test_a_plane_is_found_with_its_moments_importance_and_probability():
    plane = fit_plane(*drawn(np.random.default_rng(1), 50))
    assert plane.gradient == pytest.approx(SLOPES, abs=1e-12)
    assert plane.mean == pytest.approx(10.0, rel=1e-13)
    assert plane.deviation == pytest.approx(5.0, rel=1e-12)
    assert plane.importance == pytest.approx([0.36, 0.0, 0.64], abs=1e-12)
    value, low, high = failure_probability(plane, 20.0)
    assert value == pytest.approx(norm.sf(2.0), rel=1e-10)
    assert low == pytest.approx(high, rel=1e-9)  # no error is left


def test_roughness_hides_the_slope_over_a_small_scale_only_and_the_error_says_so():
    rng = np.random.default_rng(3)
    wide = fit_plane(*drawn(rng, 400, rough=2.0))
    assert np.abs(wide.gradient - SLOPES).max() < 4 * wide.errors.max()
    # Residuals of deviation 2 over 400 runs: 0.1 a slope.
    assert wide.errors == pytest.approx(0.1, rel=0.2)
    assert wide.rest == pytest.approx(2.0, rel=0.1)
    narrow = fit_plane(*drawn(rng, 400, rough=2.0, scale=1e-3))
    assert narrow.errors == pytest.approx(100.0, rel=0.2)
    assert np.abs(narrow.gradient - SLOPES).max() < 4 * narrow.errors.max()


def test_the_errors_of_slope_and_probability_cover_also_where_the_roughness_grows_with_an_input():
    exact, slopes, shares, trials = norm.sf(2.0), 0, 0, 300
    for seed in range(trials):
        rng = np.random.default_rng([4, seed])
        u = rng.normal(size=(120, 3))
        plane = fit_plane(u, u @ SLOPES + (0.2 + np.abs(u[:, 0])) * rng.normal(size=120))
        slopes += abs(plane.gradient[0] - SLOPES[0]) < 1.96 * plane.errors[0]
        _, low, high = failure_probability(fit_plane(*drawn(rng, 150, rough=2.0)), 20.0)
        shares += low < exact < high
    # 95 % of 300 is 285 +- 3.8; the usual error, of equal roughness everywhere, covers some 80 %.
    assert 270 <= slopes <= 298
    assert 270 <= shares <= 298


def test_the_rest_counts_as_one_more_input_where_asked():
    rng = np.random.default_rng(5)
    plane = fit_plane(*drawn(rng, 4000, rough=5.0))
    with_rest, _, _ = failure_probability(plane, 20.0, with_rest=True)
    # Deviations 5 and 5 together: 7.07; its own error is 1 %, and the probability's ten times that.
    assert with_rest == pytest.approx(norm.sf(10 / np.hypot(5, 5)), rel=0.1)
    _, low, high = failure_probability(plane, 20.0)
    assert low < norm.sf(2.0) < high


def test_a_response_that_does_not_move_fails_surely_or_never_and_few_runs_are_refused():
    plane = fit_plane(np.random.default_rng(6).normal(size=(30, 2)), np.full(30, 7.0))
    assert failure_probability(plane, 8.0) == (0.0, 0.0, 0.0)
    with pytest.raises(ValueError, match="5 runs are too few for a plane over 2 inputs"):
        fit_plane(np.zeros((5, 2)), np.zeros(5))


def test_a_paired_change_counts_only_runs_that_differ():
    failed = np.zeros(1000, dtype=bool)
    # Of 0 in n the upper limit solves (1 - p)^n = 0.025.
    assert counted_probability(failed)[2] == pytest.approx(1 - 0.025 ** (1 / 1000), rel=1e-9)
    failed[:60] = True
    other = failed.copy()
    assert paired_change(failed, other)[0] == 0.0
    assert paired_change(failed, other)[2] == pytest.approx(1 - 0.025 ** (1 / 1000), rel=1e-9)
    other[:20] = False
    value, low, high = paired_change(failed, other)
    assert value == pytest.approx(0.02)
    # All 20 in one direction: at least (0.025)^(1/20) of such changes go there.
    assert low == pytest.approx(0.02 * (2 * 0.025 ** (1 / 20) - 1), rel=1e-9)
    assert high == pytest.approx(0.02)
