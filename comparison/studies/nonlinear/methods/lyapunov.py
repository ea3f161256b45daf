r"""The largest Lyapunov exponent from perturbed orbits: the mean logarithm of their growth.

Which distance is right is not known beforehand: too small, and it drowns in the errors; too large, and the
perturbed orbits are no neighbours. Several are followed along one orbit; where the exponent does not depend
on the distance it is one. Collapsed stages (see `comparison.studies.nonlinear.methods.perturbed_orbits`) make
it an upper bound.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from comparison.studies.nonlinear.methods.perturbed_orbits import PerturbedOrbits
from comparison.tables.arrays import Array

CONFIDENCE = 0.95
RESAMPLES = 2000
FEW = 0.1
"""Share of periods with a collapsed stage that is passed over."""


@dataclass(frozen=True)
class Exponent:
    """A largest Lyapunov exponent per period, with its confidence interval."""

    value: float
    low: float
    high: float
    collapsed: float
    """Share of the periods that give a bound only."""

    @property
    def measured(self) -> bool:
        """Whether few enough periods collapsed for ``value`` to be more than an upper bound."""
        return self.collapsed <= FEW

    @property
    def sign(self) -> int:
        """1 or -1 where the interval excludes 0; a bound can only tell that it is negative."""
        if self.high < 0.0:
            return -1
        return 1 if self.low > 0.0 and self.measured else 0


def exponents(orbits: PerturbedOrbits, period: int, skip: int = 0) -> list[Exponent]:
    """Return the exponent of each distance, smallest first, per period of the drive, counted as by `Orbit`.

    A stage belongs to the period in which it begins. The first ``skip`` periods are left out: until then the
    directions have not settled.

    Notes
    -----
    Circular blocks of n^(1/3) periods keep the correlation of neighbours (D. N. Politis and J. P. Romano, in
    Exploring the Limits of Bootstrap, 1992, 263-270; the rate of the length: P. Hall, J. L. Horowitz and
    B.-Y. Jing, Biometrika 82 (1995) 561-574).
    """
    of_period = orbits.times[:, 0] // period
    of_period -= of_period[0]
    found = []
    for logs, collapsed in zip(orbits.logs, orbits.collapsed, strict=True):
        grown = np.bincount(of_period, weights=logs)[skip:].astype(np.float64)
        lost = np.bincount(of_period, weights=collapsed)[skip:] > 0
        low, high = mean_interval(grown)
        found.append(Exponent(float(np.mean(grown)), low, high, float(np.mean(lost))))
    return found


def closest_measured(exponents: Sequence[Exponent]) -> int:
    """Return the index of the exponent to believe, of several with growing distance.

    The smallest distance at which the exponent is measured; where it is nowhere, the lowest bound.
    """
    for index, found in enumerate(exponents):
        if found.measured:
            return index
    return int(np.argmin([found.value for found in exponents]))


def mean_interval(values: Array, seed: int = 0) -> tuple[float, float]:
    """Return the confidence interval of the mean of a stationary series, shape (n,)."""
    n = values.size
    length = max(1, round(n ** (1 / 3)))
    blocks = -(-n // length)
    starts = np.random.default_rng(seed).integers(n, size=(RESAMPLES, blocks))
    rows = (starts[:, :, None] + np.arange(length)).reshape(RESAMPLES, -1)[:, :n] % n
    tail = 0.5 * (1.0 - CONFIDENCE)
    low, high = np.quantile(np.mean(values[rows], axis=1), (tail, 1.0 - tail))
    return float(low), float(high)
