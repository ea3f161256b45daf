"""Where in a step of a tree a distance first vanishes: found for certain, however often it turns."""

import numba
import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from exudyn_model.tree.isolation import NEVER, bernstein, first_change


@numba.njit
def search(first, last, step):
    """What the model says of a step, from distance, rate and second derivative at both ends."""
    coefficients, room = np.zeros(6), np.zeros(6)
    bernstein(first, last, 1.0, step, coefficients)
    return first_change(coefficients, room), coefficients


def hermite(first, last, step):
    """The quintic polynomial through both ends, by the fraction of the step."""
    powers = [np.polynomial.Polynomial.basis(k) for k in range(6)]
    rows = [[p.deriv(k)(at) for p in powers] for at in (0.0, 1.0) for k in range(3)]
    right = np.concatenate([first, last]) * np.tile([1.0, step, step**2], 2)
    return np.polynomial.Polynomial(np.linalg.solve(rows, right))


def ends(polynomial):
    """Distance, rate and second derivative at the start and at the end of a step of 1."""
    return [np.array([polynomial.deriv(k)(at) for k in range(3)]) for at in (0.0, 1.0)]


def first_stop(polynomial):
    """Fraction up to which an integration goes that takes, time and again, what is said of its step."""
    until = 1.0
    for _ in range(60):
        part = polynomial(np.polynomial.Polynomial([0.0, until]))
        computed, _ = search(*ends(part), 1.0)
        if computed == NEVER or computed * until >= until * (1 - 1e-9):
            return until
        until *= computed
    raise AssertionError(until)


NUMBERS = st.tuples(*(st.floats(-1.0, 1.0) for _ in range(6)))


@given(numbers=NUMBERS, step=st.sampled_from([1e-6, 1e-4, 1.0]))
def test_the_coefficients_are_those_of_the_quintic_hermite_polynomial(numbers, step):
    scale = np.array([1.0, 1 / step, 1 / step**2])
    first, last = np.array(numbers[:3]) * scale, np.array(numbers[3:]) * scale
    _, coefficients = search(first, last, step)
    at = np.linspace(0.0, 1.0, 11)
    basis = [c * at**k * (1 - at) ** (5 - k) for k, c in enumerate((1, 5, 10, 10, 5, 1))]
    np.testing.assert_allclose(coefficients @ basis, hermite(first, last, step)(at), atol=1e-13)


@given(numbers=NUMBERS, lift=st.sampled_from([1e-14, 1e-9, 1e-3]))
def test_what_stays_away_from_the_wall_is_settled_and_what_passes_is_stopped_before(numbers, lift):
    """Lifted so that its least value is above the wall, or below."""
    polynomial = hermite(numbers[:3], numbers[3:], 1.0)
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


@pytest.mark.parametrize("dips", [(0.3,), (0.01, 0.5), (0.2, 0.999)])
@pytest.mark.parametrize("depth", [1e-12, 1e-6])
def test_the_first_dip_stops_the_step(dips, depth):
    """Of one or two that touch the wall, pressed into it by ``depth`` of their scale."""
    polynomial = np.polynomial.Polynomial([1.0])
    for dip in dips:
        polynomial *= np.polynomial.Polynomial([-dip, 1.0]) ** 2
    polynomial -= depth
    stop = first_stop(polynomial)
    roots = sorted(root.real for root in polynomial.roots() if abs(root.imag) < 1e-4 and root.real > 0)
    assert stop == pytest.approx(roots[0], abs=1e-6)
    assert stop < dips[0]


@example(curvature=1e-4)
@given(curvature=st.floats(1e-9, 1.0))
def test_what_rests_at_the_wall_and_is_pressed_touches_at_once_and_what_leaves_does_not(curvature):
    pressed = np.polynomial.Polynomial([0.0, 0.0, -curvature])
    assert search(*ends(pressed), 1.0)[0] == 0.0
    assert search(*ends(-pressed), 1.0)[0] == NEVER
    # It leaves, and comes back inside the step
    thrown = np.polynomial.Polynomial([0.0, curvature, -2 * curvature])
    assert search(*ends(thrown), 1.0)[0] == pytest.approx(
        0.5,
        abs=1e-9 + 1e-16 / curvature,  # a distance of 1e-16 m is none
    )


def test_a_gap_at_rest_near_the_wall_needs_no_shorter_step():
    """1e-13 m over the whole step of free flight, at 10 m/s^2 up and down."""
    for step, second in ((1e-6, 10.0), (1e-4, 10.0), (1e-4, 0.0)):
        still = np.array([1e-13, 0.0, second])
        assert search(still, still, step)[0] == NEVER
