"""The first zero of a distance in a step of a tree is found, however often the distance turns."""

import numba
import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numpy.polynomial import Chebyshev, Polynomial

from exudyn_model.tree.motion import DISTANCE
from exudyn_model.tree.steps import NEVER, bernstein, first_change


@numba.njit
def search(ends):
    """Fraction of a step of 1 at which a distance vanishes, from its records at both ends."""
    coefficients, room = np.zeros(6), np.zeros(6)
    bernstein(ends[0], ends[1], 1.0, 1.0, coefficients)
    return first_change(coefficients, room)


def search_polynomial(polynomial):
    return search(np.array([tuple(polynomial.deriv(k)(at) for k in range(3)) for at in (0.0, 1.0)], DISTANCE))


def first_stop(polynomial):
    """Fraction at which an integration stops that takes the recommended step again and again."""
    until = 1.0
    for _ in range(60):
        fraction = search_polynomial(polynomial(Polynomial([0.0, until])))
        if fraction == NEVER or fraction >= 1 - 1e-9:
            return until
        until *= fraction
    raise AssertionError(until)


@given(
    thousandths=st.tuples(*(st.integers(-200, 200) for _ in range(6))),
    lift=st.sampled_from([1e-13, 1e-9, 1e-3]),
    side=st.sampled_from([-1.0, 1.0]),
)
def test_what_stays_away_from_the_wall_is_settled_and_what_passes_is_stopped_before(thousandths, lift, side):
    """A distance of a millimetre is lifted so that its least value is above the wall, or below; in m."""
    wave = Chebyshev(np.array(thousandths) / 1e6, domain=[0.0, 1.0])
    polynomial = wave.convert(kind=Polynomial)
    turns = [root.real for root in polynomial.deriv().roots() if abs(root.imag) < 1e-6 and 0 < root.real < 1]
    distance = polynomial - min(polynomial(np.array([0.0, 1.0, *turns]))) + side * lift
    if distance(0.0) > 1e-12:
        stop = first_stop(distance)
        assert stop == 1.0 or side < 0.0
        assert stop == 1.0 or abs(distance(stop)) <= 2.2e-11  # 1e-9 of a step, at rates of up to 22e-3
        # Nothing lies behind the wall up to there
        assert distance(np.linspace(0.0, stop, 2001)).min() >= -2.2e-11
