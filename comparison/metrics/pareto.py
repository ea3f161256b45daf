"""Pareto front of two quantities that are both to be small."""

from __future__ import annotations

import numpy as np

from comparison.tables.arrays import Array, BoolArray


def pareto(error: Array, cost: Array) -> BoolArray:
    """Return which points no other one beats: none is as good in one quantity and better in the other.

    Parameters
    ----------
    error, cost
        Shape (n,); of equal points the first is one of the front.

    Returns
    -------
    ndarray
        Shape (n,).
    """
    order = np.lexsort((error, cost))
    best = np.minimum.accumulate(error[order])
    front = np.zeros(error.size, dtype=np.bool_)
    front[order] = np.concatenate(([True], error[order][1:] < best[:-1]))[: error.size]
    return front
