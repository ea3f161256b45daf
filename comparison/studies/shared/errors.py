"""Errors of the slider against the ideal mechanism at the samples, for drawings.

Their peaks and averages are those of `comparison.reliability`.
"""

from __future__ import annotations

import numpy as np

from comparison.tables.arrays import Array, BoolArray
from comparison.tables.table import Table


def error(actual: Table, ideal: Table, channel: str) -> Array:
    """Return actual - ideal of a channel, shape (n,).

    Raises
    ------
    ValueError
        If the two have not the same times.
    """
    if not np.allclose(actual.time, ideal.time, rtol=0, atol=1e-9):
        raise ValueError("the ideal run has other times")
    return actual.values(channel) - ideal.values(channel)


def second_cycle(time: Array, period: float) -> BoolArray:
    """Return where the time is in [T, 2T], up to its rounding: there the paper takes its peaks."""
    slack = 1e-9 * period
    return (time >= period - slack) & (time <= 2 * period + slack)


def shift_bound(radial: tuple[Array, Array], turned: tuple[Array, Array], step: float, reach: float) -> Array:
    """Return how far the slider moves at most when the crank pin moves by ``reach``, m, shape (n,).

    The gradient of the slider's position in the pin's, from central differences of an ideal mechanism, times
    the reach: to first order, as a rigid link in place of the clearance would do it.

    Parameters
    ----------
    radial
        Slider positions (m) with a crank longer and shorter by ``step``.
    turned
        The same with the crank pin ahead and behind by ``step`` along its circle.
    step, reach
        m.
    """
    along, across = ((ahead - behind) / (2 * step) for ahead, behind in (radial, turned))
    return np.asarray(reach * np.hypot(along, across))
