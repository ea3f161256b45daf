"""Counts of verdicts, and how sure a counted rate is.

Intervals are exact, after C. J. Clopper and E. S. Pearson (Biometrika 26, 1934, 404-413).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from scipy.stats import binomtest

from comparison.studies.detection.tasks import Found


@dataclass(frozen=True)
class Counts:
    """How comparisons without a fault ended."""

    draws: int
    indeterminate: int
    """Too little of the run is predictable for a verdict."""
    underestimated: int
    """Of those that agree: with an uncertainty that ensembles had to correct."""
    alarms: int
    """Differ, or cannot be compared as a run fails."""

    @property
    def decided(self) -> int:
        """Number of comparisons with a verdict."""
        return self.draws - self.indeterminate

    @property
    def upper_limit(self) -> float:
        """One-sided 95 % limit of the rate of alarms."""
        return upper_limit(self.alarms, self.decided)


def count(found: Sequence[Found]) -> Counts:
    """Count how comparisons without a fault ended."""
    verdicts = Counter(result["verdict"] for result in found)
    corrected = sum(
        result["verdict"] == "agree" and confirmation_of(result).get("outcome") == "underestimated"
        for result in found
    )
    alarms = verdicts.total() - verdicts["agree"] - verdicts["indeterminate"]
    return Counts(verdicts.total(), verdicts["indeterminate"], corrected, alarms)


def confirmation_of(found: Found) -> dict[str, Any]:
    """Return what ensembles said of a difference; empty where they were not asked."""
    return found.get("confirmation") or {}


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
