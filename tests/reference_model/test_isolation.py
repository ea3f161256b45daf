"""Zeros within a step are isolated for certain: functions with any number of turning points."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.polynomial import Polynomial

from reference_model.dense_events import end_of_mode
from reference_model.events import DEEPEST
from reference_model.isolation import (
    BELOW,
    CROSSES,
    NODES,
    RESOLUTION,
    SETTLED,
    UNCLEAR,
    classify,
    crossing,
    interpolated,
)


def values(function):
    return np.array([function(x) for x in NODES])


@pytest.mark.parametrize("depth", [1e-6, 1e-9, 1e-12])
@pytest.mark.parametrize("at", [0.05, 0.4142, 0.93])
def test_two_zeros_close_together_between_open_ends_are_found(at, depth) -> None:
    """A dip with both ends open and a second turning point: what a look at the ends cannot see."""
    gap = Polynomial([-at, 1.0]) ** 2 * Polynomial([1.3, -1.0]) - depth
    assert gap(0.0) > 0.0 < gap(1.0)
    found = end_of_mode(gap, 0.0, 1.0, RESOLUTION)
    first = min(root.real for root in gap.roots() if abs(root.imag) < 1e-15 and root.real > 0.0)
    # Beside a double root the zero is as uncertain as the root of a rounding.
    assert found == pytest.approx(first, abs=2e-8 * (1e-12 / depth) ** 0.5 + 1e-13)


@pytest.mark.parametrize("height", [1e-12, 1e-9])
def test_a_minimum_above_zero_is_no_end(height) -> None:
    assert end_of_mode(lambda x: (x - 0.4142) ** 2 + height, 0.0, 1.0, RESOLUTION) is None


@pytest.mark.parametrize("depth", [1e-6, 1e-10, 1e-11])
def test_what_starts_at_zero_and_goes_below_ends_at_once(depth) -> None:
    """Unless it may: a mode located a little too early comes right."""
    dip = lambda x: 16.0 * depth * x * (x - 0.5)  # noqa: E731  deepest at a quarter of the step, open at its end
    assert end_of_mode(dip, 0.0, 1.0, RESOLUTION, DEEPEST) == 0.0
    assert end_of_mode(dip, 0.0, 1.0, RESOLUTION) is None
    assert end_of_mode(lambda x: x - 1e-12, 0.0, 1.0, RESOLUTION, DEEPEST) is None


def test_a_dip_within_the_resolution_is_no_end() -> None:
    """There contact and flight would hand over to each other for ever."""
    assert end_of_mode(lambda x: (x - 0.4142) ** 2 - 0.5 * RESOLUTION, 0.0, 1.0, RESOLUTION) is None


@settings(deadline=None, max_examples=60)
@given(
    roots=st.lists(st.floats(0.02, 0.98), min_size=1, max_size=6, unique=True),
    frequency=st.floats(0.1, 3.0),
)
def test_the_first_of_many_zeros_is_found(roots, frequency) -> None:
    """Products of sines, which are no polynomials; zeros closer than 1e-3 may be within rounding."""
    roots = sorted(roots)
    if len(roots) > 1 and np.diff(roots).min() < 1e-3:
        return

    def gap(x):
        return -np.prod([np.sin(frequency * (x - root)) for root in roots]) * (-1.0) ** (len(roots) + 1)

    assert gap(0.0) > 0.0 or abs(gap(0.0)) < RESOLUTION
    # The product at its first zero is as flat as its other zeros are near.
    slope = frequency * abs(np.prod([np.sin(frequency * (roots[0] - root)) for root in roots[1:]]))
    if slope * roots[0] < 1e3 * RESOLUTION:
        return
    found = end_of_mode(gap, 0.0, 1.0, RESOLUTION)
    assert found == pytest.approx(roots[0], abs=2.0 * RESOLUTION / slope + 1e-12)


def test_classes() -> None:
    assert classify(values(lambda x: 1.0 + x), False, RESOLUTION) == SETTLED
    assert classify(values(lambda x: 0.3 - x), False, RESOLUTION) == CROSSES
    assert classify(values(lambda x: -0.1 - x), False, RESOLUTION) == BELOW
    assert classify(values(lambda x: (x - 0.3) * (x - 0.6)), False, RESOLUTION) == UNCLEAR
    assert (
        classify(values(lambda x: np.sin(40.0 * x) + 1.5), False, RESOLUTION) == UNCLEAR
    )  # nine points cannot tell
    # What starts wrong and turns right has not ended, unless it is not the start.
    assert classify(values(lambda x: x - 1e-3), True, RESOLUTION) == SETTLED
    assert classify(values(lambda x: x - 1e-3), False, RESOLUTION) != SETTLED


@settings(deadline=None, max_examples=60)
@given(root=st.floats(0.01, 0.99), frequency=st.floats(0.1, 2.0), scale=st.sampled_from([1e-9, 1e-5, 1e-2]))
def test_the_zero_of_the_interpolant_is_that_of_the_function(root, frequency, scale) -> None:
    def gap(x):
        return scale * np.sin(frequency * (root - x)) * (1.0 + x)

    found = values(gap)
    assume(classify(found, False, RESOLUTION) == CROSSES)  # else not resolved by nine points, or too flat
    assert abs(gap(crossing(found, RESOLUTION))) <= 2.0 * RESOLUTION
    assert interpolated(found, 0.3) == pytest.approx(gap(0.3), abs=RESOLUTION)
