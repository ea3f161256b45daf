"""Interpolation within a step of a tree."""

import numpy as np
import pytest

from exudyn_model.tree.motion import quintic


def test_quintic_interpolation_is_exact_for_degree_five():
    coefficients = np.array([0.3, -1.2, 2.0, 0.7, -0.4, 1.1])
    curve = np.polynomial.Polynomial(coefficients)
    begin, step = 0.2, 0.7
    ends = [
        derivative(t) for t in (begin, begin + step) for derivative in (curve, curve.deriv(), curve.deriv(2))
    ]
    for fraction in (0.0, 0.13, 0.5, 0.97, 1.0):
        value, rate = quintic(*ends, step, fraction)
        assert value == pytest.approx(curve(begin + fraction * step), rel=1e-13)
        assert rate == pytest.approx(curve.deriv()(begin + fraction * step), rel=1e-13)


def test_round_off_of_the_angle_is_no_rate():
    """A steady rotation in steps as short as those that end at a touch; 5 rad are rounded to 9e-16."""
    for step in (1e-6, 1e-9, 1e-12):
        ends = [5.0, 3.0, 0.0, 5.0 + 3.0 * step, 3.0, 0.0]
        for fraction in (0.2, 0.5, 0.9):
            assert quintic(*ends, step, fraction)[1] == pytest.approx(3.0, abs=1e-14)
        # The value still ends where the step does
        assert quintic(*ends, step, 1.0)[0] == pytest.approx(ends[3], abs=1e-15)
