r"""Two ensembles of runs from scattered starts, compared as distributions.

Where neighbouring runs diverge, single runs cannot be compared; what can be tested is whether both models
draw from one distribution. Every quantity gives one number a run, so that the runs, started independently,
are the sample: a channel at an instant, the number of contacts in a cycle, quantiles of a run's contacts.
Two samples are compared by

- the two-sample test of Kolmogorov and Smirnov, whose statistic is the largest distance of the empirical
  distribution functions (exact p-value, conservative where values are tied);
- the Wasserstein distance :math:`\int |F_a - F_b|`, in the quantity's unit.

Some hundred tests at 5 % each would find differences by chance. The p-values are therefore adjusted after
Benjamini and Yekutieli (Ann. Statist. 29, 2001, 1165-1188), which holds however the tests depend on each
other: of all differences that are reported as found, at most the share `RATE` is expected to be false.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import false_discovery_control, ks_2samp, wasserstein_distance

from comparison.tables.arrays import Array
from comparison.tables.channels import CORNERS
from comparison.tables.table import Table

RATE = 0.05
QUANTILES = {"median": 0.5, "nine tenths": 0.9, "largest": 1.0}
OF_CONTACTS = {"largest_depth": "m", "peak_force": "N", "normal_speed": "m/s"}


@dataclass(frozen=True)
class Sample:
    """One number a run, of each of two ensembles: shapes (n,) and (m,)."""

    quantity: str
    where: str
    unit: str
    a: Array
    b: Array


@dataclass(frozen=True)
class Distance(Sample):
    """How far the two samples are apart."""

    statistic: float
    """Largest distance of the empirical distribution functions, 0 to 1."""
    wasserstein: float
    """In the quantity's unit."""
    scale: float
    """Standard deviation of both samples together, in that unit."""
    p: float
    """Probability of such a statistic by chance, for this quantity alone."""
    adjusted: float
    """The smallest rate of false discoveries at which it counts as found."""

    @property
    def found(self) -> bool:
        """Whether it is a difference at the rate `RATE` of false discoveries."""
        return self.adjusted <= RATE


def distances(samples: Sequence[Sample]) -> list[Distance]:
    """Test every quantity; the p-values are adjusted for the number of all samples, one family of tests."""
    if not samples:
        return []
    tests = [ks_2samp(sample.a, sample.b) for sample in samples]
    adjusted = false_discovery_control([test.pvalue for test in tests], method="by")
    return [
        Distance(
            **vars(sample),
            statistic=float(test.statistic),
            wasserstein=float(wasserstein_distance(sample.a, sample.b)),
            scale=float(np.std(np.concatenate([sample.a, sample.b]))),
            p=float(test.pvalue),
            adjusted=float(rate),
        )
        for sample, test, rate in zip(samples, tests, adjusted, strict=True)
    ]


def ask(
    a: Sequence[Table],
    b: Sequence[Table],
    *,
    instants: Array,
    floors: Mapping[str, tuple[float, str]],
    period: float,
    first_cycle: int,
) -> list[Sample]:
    """Collect the samples of two ensembles.

    Parameters
    ----------
    a, b
        The runs, all with the same times.
    instants
        Sample times (s) at which channels are compared, shape (k,).
    floors
        Channel -> its floor and unit. Where both ensembles scatter (standard deviation) by no more than the
        floor the motion is predictable, and single runs can be compared.
    period
        Of the crank, s.
    first_cycle
        The first whose contacts count, from 0: until then the runs have not diverged.
    """
    units = {channel: unit for channel, (_, unit) in floors.items()}
    of_a, of_b = ([_numbers(run, instants, units, period, first_cycle) for run in runs] for runs in (a, b))
    samples = [
        Sample(*key, np.array([run[key] for run in of_a]), np.array([run[key] for run in of_b]))
        for key in of_a[0]
    ]
    return [
        sample
        for sample in samples
        if sample.quantity not in floors or max(sample.a.std(), sample.b.std()) > floors[sample.quantity][0]
    ]


def _numbers(
    run: Table, instants: Array, units: Mapping[str, str], period: float, first_cycle: int
) -> dict[tuple[str, str, str], float]:
    """Return what a run gives: (quantity, where, unit) -> number; zero for quantiles of no contacts."""
    if run.events is None:
        raise ValueError("a run of an ensemble has no event table")
    rows = np.searchsorted(run.time, instants - 1e-9 * instants[-1])
    numbers = {
        (channel, f"t = {instant:.4f} s", unit): value
        for channel, unit in units.items()
        for instant, value in zip(instants, run.values(channel)[rows], strict=True)
    }
    edges = period * np.arange(first_cycle, round(run.time[-1] / period) + 1)
    for corner, words in CORNERS.items():
        counts, _ = np.histogram(run.events.loc[run.events["corner"] == corner, "start"], edges)
        for cycle, count in enumerate(counts, first_cycle + 1):
            numbers[f"contacts, {words} corner", f"cycle {cycle}", ""] = float(count)
    late = run.events[run.events["start"] >= edges[0]]
    for column, unit in OF_CONTACTS.items():
        for words, level in QUANTILES.items():
            value = late[column].quantile(level) if len(late) else 0.0
            numbers[f"{column.replace('_', ' ')} of a contact", words, unit] = float(value)
    return numbers
