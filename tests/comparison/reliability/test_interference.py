"""Stress-strength reliability: its cap, a Gaussian error in closed form, its inverse, what moves it."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import ndtr
from scipy.stats import norm

from comparison.reliability.interference import (
    cap,
    implied_limit,
    reliability,
    reliability_index,
    sensitivity,
)
from comparison.scene.schema import Limits

PHI_3 = 0.9986501020


def test_without_error_the_reliability_is_phi_of_3_whatever_the_upper_limit():
    for upper in (1e-6, 80.0, 1e3):
        # Ten digits of Phi(3), as printed in tables.
        assert cap(Limits(upper=upper)) == pytest.approx(PHI_3, abs=5e-11)
    # A lower limit raises it: (1 + 1/2) / (1 - 1/2) * 3.
    assert cap(Limits(lower=1.0, upper=2.0)) == pytest.approx(ndtr(9.0), rel=1e-15)


def test_a_normal_error_of_known_moments_gives_the_probability_that_strength_exceeds_it():
    limits, mean, deviation = Limits(lower=0.5, upper=6.5), 1.5, 0.8
    # Quantiles at the midpoints of equal shares: a normal sample without chance.
    count = 200_000
    errors = mean + deviation * norm.ppf((np.arange(count) + 0.5) / count)
    found = float(reliability(limits, errors.mean(), errors.std()))
    strength, spread = 3.5, 1.0
    exact = float(norm.cdf((strength - mean) / np.hypot(spread, deviation)))
    # The tails beyond the outermost midpoints lack some 1e-5 of the variance.
    assert found == pytest.approx(exact, abs=1e-5)
    # And it is a probability: the share of pairs in which the strength is the larger.
    rng = np.random.default_rng(2)
    drawn = rng.normal(strength, spread, count) > rng.normal(mean, deviation, count)
    assert drawn.mean() == pytest.approx(exact, abs=4 * np.sqrt(exact * (1 - exact) / count))


def test_a_change_of_unit_changes_nothing():
    one = reliability(Limits(lower=1e-5, upper=2e-4), 2e-5, 1e-5)
    other = reliability(Limits(lower=1e-2, upper=0.2), 2e-2, 1e-2)
    assert one == pytest.approx(other, rel=1e-14)


@pytest.mark.parametrize(("mean", "deviation"), [(2.0, 1.0), (0.3, 5.0), (0.0, 4.0), (-0.5, 3.0)])
def test_the_implied_limit_gives_the_reliability_back(mean, deviation):
    for upper in (3.0, 5.0, 20.0, 500.0):  # from below the mean error to far above it
        known = float(reliability(Limits(upper=upper), mean, deviation))
        if mean >= 0 or known < PHI_3:
            # Close to the cap the limit is 1 / (3 - beta) times as sensitive as R: 1e-15 * 500 / 0.01.
            assert implied_limit(known, mean, deviation) == pytest.approx(upper, rel=1e-9)


def test_from_the_cap_on_no_limit_is_large_enough():
    assert implied_limit(0.99866, 1.0, 1.0) == float("inf")
    assert np.isnan(implied_limit(0.9, 0.0, 0.0))


@pytest.mark.parametrize(("mean", "deviation"), [(2.0, 1.0), (0.1, 3.0), (-1.0, 0.5)])
def test_the_sensitivity_is_the_derivative_in_the_averages_of_errors_and_of_their_squares(mean, deviation):
    limits, h = Limits(lower=-1.0, upper=8.0), 1e-5

    def index(by_mean, by_square):
        square = mean**2 + deviation**2 + by_square
        return float(reliability_index(limits, mean + by_mean, np.sqrt(square - (mean + by_mean) ** 2)))

    found = sensitivity(limits, mean, deviation)
    # Central differences leave h^2; round-off 1e-16 / h.
    assert found[0] == pytest.approx((index(h, 0) - index(-h, 0)) / (2 * h), rel=1e-8)
    assert found[1] == pytest.approx((index(0, h) - index(0, -h)) / (2 * h), rel=1e-8)
