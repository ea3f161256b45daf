"""Decide with certainty whether a smooth function turns negative in an interval, from nine values of it.

The values at the Chebyshev-Lobatto points determine the interpolant of degree 8. Its last two Chebyshev
coefficients say how far the function may be from it; its Bernstein coefficients bound it from below, and
their changes of sign bound the number of its zeros (Descartes' rule; G. Farin, "Curves and Surfaces for
CAGD", 5th ed., Sec. 5.2-5.3). An interval on which this decides nothing has to be halved.
"""

from math import comb

import numpy as np
from numpy.polynomial import chebyshev

from reference_model.compiled import inlined, inner
from reference_model.linkage import Array

DEGREE = 8
POINTS = DEGREE + 1
ABSCISSAE = 0.5 - 0.5 * np.cos(np.pi * np.arange(POINTS) / DEGREE)
"""Shares of the interval, ascending, both ends included."""

RESOLUTION = 1.0e-13
"""Values up to this count as zero, m or m/s. Gaps are differences of coordinates near 0.55 m and round at
1e-16 m, slips of some m/s alike; the Bernstein coefficients multiply that by up to 300."""
NARROWEST = 2.0**-40
"""Narrowest interval, as a share of a step: within it coordinates change by less than their rounding."""

SETTLED, CROSSES, BELOW, UNCLEAR = range(4)
"""The function is not negative; turns negative exactly once; is nowhere positive; nothing is certain."""

_POWERS = np.arange(POINTS)
_BINOMIALS = np.array([float(comb(DEGREE, power)) for power in _POWERS])
_BERNSTEIN = _BINOMIALS * ABSCISSAE[:, None] ** _POWERS * (1.0 - ABSCISSAE[:, None]) ** (DEGREE - _POWERS)
_TO_BERNSTEIN = np.linalg.inv(_BERNSTEIN)
_WEIGHTS = (-1.0) ** _POWERS * np.where(_POWERS % DEGREE == 0, 0.5, 1.0)
_TO_LAST = np.linalg.inv(chebyshev.chebvander(2.0 * ABSCISSAE - 1.0, DEGREE))[-2:]


@inlined
def classify(values: Array, starting: bool) -> int:
    """Return SETTLED, CROSSES, BELOW or UNCLEAR, from the values (m or m/s) at `ABSCISSAE`, shape (POINTS,).

    With `starting` the mode starts with the interval, at zero within rounding or the error of its location,
    and may turn positive first.
    """
    error = 0.0
    for i in range(2):
        last = 0.0
        for j in range(POINTS):
            last += _TO_LAST[i, j] * values[j]
        error += abs(last)
    least, sign, first, changes = np.inf, 0.0, 0.0, 0
    for i in range(POINTS):
        b = 0.0
        for j in range(POINTS):
            b += _TO_BERNSTEIN[i, j] * values[j]
        least = min(least, b)
        if abs(b) > RESOLUTION:
            here = 1.0 if b > 0.0 else -1.0
            if first == 0.0:
                first = here
            elif here != sign:
                changes += 1
            sign = here
    if not error <= RESOLUTION:
        return SETTLED if least > error else UNCLEAR
    if least >= -RESOLUTION or (starting and first < 0.0 and changes == 1):
        return SETTLED
    if changes == 0 and first < 0.0 and values[0] <= RESOLUTION:
        # The margin of a mode that was located a little too early turns positive later.
        return SETTLED if starting and values[POINTS - 1] > values[0] else BELOW
    if changes == 1 and first > 0.0 and values[POINTS - 1] < 0.0 and last_positive(values) >= 0:
        return CROSSES
    return UNCLEAR


@inlined
def dips(values: Array, depth: float) -> bool:
    """Return whether a function at `ABSCISSAE` is anywhere more than `depth` below zero."""
    least = 0.0
    for j in range(POINTS):
        least = min(least, values[j])
    return least < -depth


@inner
def last_positive(values: Array) -> int:
    """Return the last point at which a function is certainly positive; -1: there is none.

    A function that crosses zero once does so behind that point. At the interval's start it may be zero.
    """
    for j in range(POINTS - 1, -1, -1):
        if values[j] > RESOLUTION:
            return j
    return -1


@inner
def interpolated(values: Array, x: float) -> float:
    """Evaluate the interpolant of `values` at `ABSCISSAE`, shape (POINTS,), at a share of the interval.

    By the barycentric formula (J.-P. Berrut, L. N. Trefethen, SIAM Rev. 46, 2004, 501-517, Eqs. 4.2, 5.4).
    """
    above = below = 0.0
    for j in range(POINTS):
        if x == ABSCISSAE[j]:
            return float(values[j])
        weight = _WEIGHTS[j] / (x - ABSCISSAE[j])
        above += weight * values[j]
        below += weight
    return above / below


@inlined
def crossing(values: Array) -> float:
    """Return the share of the interval at which a function that `classify` says CROSSES is zero.

    The regula falsi (Illinois form) finds it on the interpolant, which is within RESOLUTION of the function.
    """
    lo, hi = float(ABSCISSAE[last_positive(values)]), 1.0
    f_lo, f_hi = interpolated(values, lo), float(values[POINTS - 1])
    side = 0
    for _ in range(60):
        x = (lo * f_hi - hi * f_lo) / (f_hi - f_lo)
        if not lo < x < hi:
            break
        value = interpolated(values, x)
        if abs(value) <= 0.01 * RESOLUTION:
            return x
        if value <= 0.0:
            hi, f_hi = x, value
            f_lo *= 0.5 if side == 1 else 1.0
            side = 1
        else:
            lo, f_lo = x, value
            f_hi *= 0.5 if side == -1 else 1.0
            side = -1
    return hi
