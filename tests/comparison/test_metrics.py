"""The metrics are norms, and pure numbers do not change with the unit."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from comparison.metrics import maximum, rms, scaled, time_of_worst

signal = arrays(np.float64, 12, elements=st.floats(-1e100, 1e100))
factor = st.floats(1e-150, 1e150)


def test_values_of_a_known_difference():
    time, difference = np.array([0.0, 0.1, 0.2, 0.3]), np.array([3.0, -4.0, 0.0, 4.0])
    assert maximum(difference) == 4.0
    assert rms(difference) == pytest.approx(np.sqrt(41 / 4), rel=1e-15)
    assert time_of_worst(time, difference) == 0.1  # the first of two
    assert scaled(4.0, 8.0) == 0.5


@pytest.mark.parametrize("norm", [maximum, rms])
@given(a=signal, b=signal)
def test_norms(norm, a, b):
    assert norm(a) >= 0
    assert (norm(a) == 0) == (not a.any())
    assert norm(a) == norm(-a)
    # Round-off of twelve terms.
    assert norm(a + b) <= (norm(a) + norm(b)) * (1 + 1e-14)


@given(signal)
def test_rms_is_at_most_the_maximum_and_at_least_its_share_of_one_sample(a):
    assert maximum(a) / np.sqrt(12) * (1 - 1e-14) <= rms(a) <= maximum(a) * (1 + 1e-14)


@pytest.mark.parametrize("norm", [maximum, rms])
@given(a=arrays(np.float64, 12, elements=st.floats(1e-3, 1e3)), unit=factor)
def test_units_cancel(norm, a, unit):
    # Squares of 1e-150 or 1e150 would under- or overflow.
    assert scaled(norm(a * unit), 2.0 * unit) == pytest.approx(scaled(norm(a), 2.0), rel=1e-13)
    assert time_of_worst(np.arange(12.0), a * 2.0**40) == time_of_worst(np.arange(12.0), a)


@given(signal)
def test_nothing_to_measure_by_is_not_a_number(a):
    assume(a.any())
    assert np.isnan(scaled(maximum(a), 0.0))
