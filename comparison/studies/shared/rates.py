"""Observed rates: the slope of a line through logarithms, exact limits of a counted share."""

from collections.abc import Sequence

import numpy as np
from scipy.stats import binomtest


def rate(x: Sequence[float], y: Sequence[float]) -> float:
    """Return p of y ~ x^p by least squares of the positive, finite pairs; nan of less than two."""
    pairs = np.array([x, y], dtype=np.float64)
    log_x, log_y = np.log(pairs[:, np.all(np.isfinite(pairs) & (pairs > 0), axis=0)])
    return float(np.polyfit(log_x, log_y, 1)[0]) if log_x.size >= 2 else float("nan")


def interval(count: int, trials: int) -> tuple[float, float]:
    """Return the two-sided 95 % interval of Clopper and Pearson of a rate; 0 to 1 without a trial."""
    if not trials:
        return 0.0, 1.0
    bounds = binomtest(count, trials).proportion_ci(0.95, method="exact")
    return float(bounds.low), float(bounds.high)


def upper_limit(count: int, trials: int) -> float:
    """Return the one-sided 95 % upper limit of Clopper and Pearson of a rate; 1 without a trial."""
    if not trials:
        return 1.0
    return float(binomtest(count, trials, alternative="less").proportion_ci(0.95, method="exact").high)


def share(rate: float) -> str:
    """Return a rate as percent with two digits."""
    return f"{100 * rate:.2g}\u00a0%" if rate < 0.995 else f"{100 * rate:.3g}\u00a0%"
