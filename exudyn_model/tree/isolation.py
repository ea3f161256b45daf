"""Zeros of a distance in a step of a tree, isolated for certain, so that the step ends there.

The same search finds kinks of a workpiece's force, which may be too short for the error control to see.

Over a step the distance of a contact (``motion``) is the quintic Hermite polynomial through both ends. A
polynomial lies between the least and the greatest of its Bernstein coefficients [1]_: if none is negative,
neither is the polynomial, however often it turns. Most steps are settled by that; else the step is searched
from its start on, in parts short enough to be settled each.

References
----------
.. [1] Farouki, The Bernstein polynomial basis: a centennial retrospective, Comput. Aided Geom. Des. 29 (2012)
   379-419, sections 5 and 6.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from exudyn_model.clearances import ROUNDED
from exudyn_model.kernels import kernel

Array = NDArray[np.float64]


# Stands for the fraction of a step at which a distance vanishes, where it does not
NEVER = 2.0
# Parts of one step that are searched before a shorter step is required. A gap of 1e-13 m at rest over
# a step of free flight takes some 100
_SEARCH_LIMIT = 1000
_DEGREE = 5
# Distance beyond a kink of a workpiece's force at which a step ends, m: too short for any slope to matter
_BEYOND = 1e-9


@kernel
def bernstein(first: Any, last: Any, sign: float, step: float, coefficients: Array) -> float:
    """Fill the six coefficients of ``sign`` times a distance over a step (s) from its values at both ends.

    Return the least of them.
    """
    rate0, rate1 = step * first.rate / 5.0, step * last.rate / 5.0
    bend0, bend1 = step * step * first.second / 20.0, step * step * last.second / 20.0
    coefficients[0], coefficients[5] = sign * first.value, sign * last.value
    coefficients[1], coefficients[4] = sign * (first.value + rate0), sign * (last.value - rate1)
    coefficients[2] = sign * (first.value + 2.0 * rate0 + bend0)
    coefficients[3] = sign * (last.value - 2.0 * rate1 + bend1)
    least = np.inf
    for k in range(_DEGREE + 1):
        least = min(least, coefficients[k])
    return least


@kernel
def restrict(coefficients: Array, low: float, high: float, inner: Array) -> float:
    """Fill the coefficients of the part from ``low`` to ``high`` of a step; return the least of them.

    De Casteljau's algorithm cuts the step at ``high``, then at ``low``.
    """
    for k in range(_DEGREE + 1):
        inner[k] = coefficients[k]
    for level in range(1, _DEGREE + 1):
        for k in range(_DEGREE, level - 1, -1):
            inner[k] = (1.0 - high) * inner[k - 1] + high * inner[k]
    share, least = low / high, np.inf
    for level in range(1, _DEGREE + 1):
        for k in range(_DEGREE + 1 - level):
            inner[k] = (1.0 - share) * inner[k] + share * inner[k + 1]
    for k in range(_DEGREE + 1):
        least = min(least, inner[k])
    return least


@kernel
def first_change(coefficients: Array, inner: Array) -> float:
    """Return the fraction of a step at which a distance falls below zero, or ``NEVER``.

    It is not necessarily the first zero in the step: the shorter step is searched again. 0 if the distance
    was zero from the start until it fell; nan if a shorter step must decide. ``coefficients``, shape (6,),
    are those of the distance; ``inner``, of the same shape, is overwritten.
    """
    low, width, high = 0.0, 1.0, 1.0
    passed = coefficients[_DEGREE] < -ROUNDED
    count = 0
    while not passed:
        count += 1
        if count > _SEARCH_LIMIT:
            return np.nan
        high = min(low + width, 1.0)
        if restrict(coefficients, low, high, inner) >= -ROUNDED:
            if high >= 1.0:
                return NEVER
            low, width = high, 2.0 * width
        elif inner[_DEGREE] < -ROUNDED:
            passed = True
        else:
            width *= 0.5
    # Newton's method, safeguarded by bisection; a distance of zero at the start first has to grow
    low, separated, fraction = 0.0, coefficients[0] > ROUNDED, 0.5 * high
    for _ in range(200):
        restrict(coefficients, fraction, 1.0, inner)
        value, slope = inner[0], _DEGREE * (inner[1] - inner[0]) / (1.0 - fraction)
        if not separated and value <= ROUNDED:
            high, fraction = fraction, 0.5 * fraction
            if fraction < 1e-16:
                return 0.0
            continue
        separated = True
        if abs(value) < 1e-16:
            break
        if value > 0.0:
            low = fraction
        else:
            high = fraction
        change = -value / slope if slope != 0.0 else 2.0
        if not low < fraction + change < high:
            change = 0.5 * (low + high) - fraction
        fraction += change
        if abs(change) < 1e-14:
            break
    return fraction


@kernel
def kink_fraction(before: Any, after: Any, step: float, workpiece: NDArray[Any], work: Array) -> float:
    """Return the fraction of a step up to where it has passed a kink of a workpiece's force; 1: none.

    A step passes a kink if it goes twice ``_BEYOND`` beyond it; the fraction is that at ``_BEYOND``. The step
    that ends there passes no kink, and the next one starts on the other side. ``before`` and ``after`` are
    the height, of ``motion.DISTANCE``, at both ends.
    """
    first = 1.0
    for row in range(len(workpiece)):
        height = workpiece[row].height
        if row > 0 and workpiece[row].exponent > 0.0:  # a power law has its only kink at the surface
            break
        sign = 1.0 if before.value >= height else -1.0
        if bernstein(before, after, sign, step, work[0]) - sign * height >= -_BEYOND:
            continue
        for k in range(_DEGREE + 1):
            work[0, k] += 2.0 * _BEYOND - sign * height
        if first_change(work[0], work[1]) == NEVER:
            continue
        for k in range(_DEGREE + 1):
            work[0, k] -= _BEYOND
        fraction = first_change(work[0], work[1])
        first = min(first, 0.5 if np.isnan(fraction) else fraction)
    return first
