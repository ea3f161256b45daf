"""Observed rates: the slope of a straight line through logarithms."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np


def rate(x: Sequence[float], y: Sequence[float]) -> float:
    """Return p of y ~ x^p by least squares; of positive, finite pairs, and nan of less than two.

    Parameters
    ----------
    x, y
        What is made small or large, and what follows; of one length.
    """
    over, what = np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)
    good = np.isfinite(over) & np.isfinite(what) & (over > 0) & (what > 0)
    if good.sum() < 2:
        return float("nan")
    return float(np.polyfit(np.log(over[good]), np.log(what[good]), 1)[0])
