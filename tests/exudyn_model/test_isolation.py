"""Where in a step of a tree a distance first vanishes: found for certain, however often it turns."""

import numba
import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from exudyn_model.tree.motion import DISTANCE
from exudyn_model.tree.steps import NEVER, bernstein, first_change


@numba.njit
def search(ends, step):
    """Fraction of a step at which a distance vanishes, from its records at both ends."""
    coefficients, room = np.zeros(6), np.zeros(6)
    bernstein(ends[0], ends[1], 1.0, step, coefficients)
    return first_change(coefficients, room)


def hermite(numbers):
    """The quintic polynomial with these values, rates and second derivatives at 0 and at 1."""
    powers = [np.polynomial.Polynomial.basis(k) for k in range(6)]
    rows = [[p.deriv(k)(at) for p in powers] for at in (0.0, 1.0) for k in range(3)]
    return np.polynomial.Polynomial(np.linalg.solve(rows, numbers))


def searched(polynomial):
    """The same of a polynomial over a step of 1."""
    ends = [tuple(polynomial.deriv(k)(at) for k in range(3)) for at in (0.0, 1.0)]
    return search(np.array(ends, DISTANCE), 1.0)


def first_stop(polynomial):
    """Fraction up to which an integration goes that takes, time and again, the step that it is told."""
    until = 1.0
    for _ in range(60):
        fraction = searched(polynomial(np.polynomial.Polynomial([0.0, until])))
        if fraction == NEVER or fraction >= 1 - 1e-9:
            return until
        until *= fraction
    raise AssertionError(until)


NUMBERS = st.tuples(*(st.floats(-1.0, 1.0) for _ in range(6)))


@given(numbers=NUMBERS, lift=st.sampled_from([1e-14, 1e-9, 1e-3]))
def test_what_stays_away_from_the_wall_is_settled_and_what_passes_is_stopped_before(numbers, lift):
    """Lifted so that its least value is above the wall, or below."""
    polynomial = hermite(numbers)
    turns = [root.real for root in polynomial.deriv().roots() if abs(root.imag) < 1e-6 and 0 < root.real < 1]
    least = min(polynomial(np.array([0.0, 1.0, *turns])))
    for side in (1.0, -1.0):
        shifted = polynomial - least + side * max(lift, 1e-13)
        if shifted(0.0) <= 1e-12:
            continue
        stop = first_stop(shifted)
        before = shifted(np.linspace(0.0, stop, 2001))
        if side > 0.0:
            assert stop == 1.0
        elif stop < 1.0:
            assert abs(shifted(stop)) <= 2e-8  # 1e-9 of a step, at rates of up to 20
        # Nothing lies behind the wall up to there
        assert before.min() >= -2e-8


@example(curvature=1e-4)
@given(curvature=st.floats(1e-9, 1.0))
def test_what_rests_at_the_wall_and_is_pressed_touches_at_once_and_what_leaves_does_not(curvature):
    pressed = np.polynomial.Polynomial([0.0, 0.0, -curvature])
    assert searched(pressed) == 0.0
    assert searched(-pressed) == NEVER
    # It leaves, and comes back inside the step
    thrown = np.polynomial.Polynomial([0.0, curvature, -2 * curvature])
    assert searched(thrown) == pytest.approx(0.5, abs=1e-9 + 1e-16 / curvature)  # 1e-16 m is none


def test_a_gap_at_rest_near_the_wall_needs_no_shorter_step():
    """1e-13 m over the whole step of free flight, at 10 m/s^2 up and down."""
    for step, second in ((1e-6, 10.0), (1e-4, 10.0), (1e-4, 0.0)):
        assert search(np.array([(1e-13, 0.0, second)] * 2, DISTANCE), step) == NEVER
