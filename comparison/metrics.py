"""How large a difference is: pure functions on arrays.

All are invariant under a change of unit: scaling difference and scale by one factor scales the first two
results by it and leaves the others.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def maximum(difference: Array) -> float:
    r"""Largest absolute value, :math:`\max_i |E_i|` (the infinity norm); in the unit of the difference.

    Parameters
    ----------
    difference
        Shape (n,), n >= 1.
    """
    return float(np.abs(difference).max())


def rms(difference: Array) -> float:
    r"""Root mean square, :math:`\sqrt{\sum_i E_i^2 / n}`; in the unit of the difference.

    The largest value is taken out before squaring, so that neither overflow nor underflow changes the result
    with the unit (as in LAPACK's dnrm2).

    Parameters
    ----------
    difference
        Shape (n,), n >= 1.
    """
    largest = maximum(difference)
    if largest == 0.0:
        return 0.0
    return largest * float(np.sqrt(np.mean(np.square(difference / largest))))


def scaled(value: float, scale: float) -> float:
    """Value over the channel's scale, a pure number; nan where the scale is zero, i.e. nothing to measure by.

    Parameters
    ----------
    value, scale
        In one unit; scale >= 0.
    """
    return value / scale if scale > 0 else float("nan")


def time_of_worst(time: Array, difference: Array) -> float:
    """First time at which the absolute difference is largest, s.

    Parameters
    ----------
    time, difference
        Shape (n,), n >= 1.
    """
    return float(time[np.abs(difference).argmax()])
