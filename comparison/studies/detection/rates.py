"""How sure a counted rate is, after C. J. Clopper and E. S. Pearson (Biometrika 26, 1934, 404-413)."""

from __future__ import annotations

from scipy.stats import binomtest


def interval(count: int, trials: int) -> tuple[float, float]:
    """Return the two-sided exact 95 % interval of a rate; 0 to 1 without a trial."""
    if not trials:
        return 0.0, 1.0
    bounds = binomtest(count, trials).proportion_ci(0.95, method="exact")
    return float(bounds.low), float(bounds.high)


def upper_limit(count: int, trials: int) -> float:
    """Return the one-sided exact 95 % upper limit of a rate: what it is below with that confidence."""
    if not trials:
        return 1.0
    return float(binomtest(count, trials, alternative="less").proportion_ci(0.95, method="exact").high)


def share(rate: float) -> str:
    """Return a rate as percent with two digits."""
    return f"{100 * rate:.2g}\u00a0%" if rate < 0.995 else f"{100 * rate:.3g}\u00a0%"
