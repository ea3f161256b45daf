"""Estimated error of slider_x in one run, from a finer, a coarser and perturbed runs of the same scene."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf

import numpy as np

from comparison.accuracy.thresholds import thresholds
from comparison.accuracy.uncertainty import Runs, spread, window_samples
from comparison.tables.arrays import Array
from comparison.verdict.compare import model_uncertainty

CHANNEL = "slider_x"
"""Whose error an accuracy means."""
FLOOR = thresholds("tight").coverage
"""Share of the samples on which an error must be known to count, as for a verdict at the tight tier."""


@dataclass(frozen=True)
class Estimate:
    """Estimated error over the time of a run.

    Attributes
    ----------
    time
        Samples, s, shape (n,).
    u
        Numerical uncertainty of slider_x (`comparison.accuracy.uncertainty`), m, shape (n,).
    spread
        The part of u due to neighbouring starts, which no setting removes, m, shape (n,); 0 without any.
    """

    time: Array
    u: Array
    spread: Array

    def coverage(self, error: float) -> float:
        """Return the share of samples whose u is at most an error, m: the predictable part."""
        return float(np.mean(self.u <= error))

    def attainable(self, error: float) -> float:
        """Return the share of samples at which neighbouring starts stay within an error, m."""
        return float(np.mean(self.spread <= error))

    def until(self, error: float) -> float:
        """Return the time at which u first exceeds an error, m, in s; inf if it never does."""
        outside = np.flatnonzero(self.u > error)
        return float(self.time[outside[0]]) if outside.size else inf

    def held(self, share: float) -> float:
        """Return the smallest error that holds on a share of the samples, m."""
        return float(np.quantile(self.u, share, method="higher"))


def estimate(runs: Runs, period: float) -> Estimate:
    """Estimate the error of slider_x in the base of a family of runs.

    Parameters
    ----------
    runs
        With a finer run.
    period
        Of a crank cycle, s.
    """
    time = runs.base.time
    u = model_uncertainty(runs, CHANNEL, period)
    assert u is not None
    half_width = window_samples(period, float(time[-1] - time[0]) / (time.size - 1))
    perturbed = [run.values(CHANNEL) for run in runs.perturbed_runs]
    return Estimate(time, u, spread(runs.original.values(CHANNEL), perturbed, half_width))
