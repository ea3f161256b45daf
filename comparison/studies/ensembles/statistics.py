r"""Two ensembles of runs from scattered starts, compared as distributions.

Where neighbouring runs part, one run of either model says nothing; what may be asked is whether both draw
from one distribution. Every quantity gives one number a run, so that the runs, started independently, are
the sample: a channel at an instant, the number of contacts in a turn, quantiles of a run's contacts. Two
samples are held against each other by

- the two-sample test of Kolmogorov and Smirnov, whose statistic is the largest distance of the empirical
  distribution functions (exact p-value, conservative where values are tied);
- the Wasserstein distance :math:`\int |F_a - F_b|`, which says how far they are apart in the quantity's unit.

Some hundred tests at 5 % each would find differences by chance. The p-values are therefore adjusted after
Benjamini and Yekutieli (Ann. Statist. 29, 2001, 1165-1188), which holds however the tests depend on each
other: of all differences that are called found, at most the share `RATE` is expected to be false.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain

import numpy as np
import pandas as pd
from scipy.stats import false_discovery_control, ks_2samp, wasserstein_distance

from comparison.tables.arrays import Array
from comparison.tables.channels import CORNERS
from comparison.tables.table import Table

RATE = 0.05
QUANTILES = {"median": 0.5, "nine tenths": 0.9, "largest": 1.0}
OF_CONTACTS = {"largest_depth": "m", "peak_force": "N", "normal_speed": "m/s"}


@dataclass(frozen=True)
class Distance:
    """One quantity in two ensembles."""

    quantity: str
    where: str
    unit: str
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


@dataclass(frozen=True)
class Sample:
    """One number a run, of each of two ensembles: shapes (n,) and (m,)."""

    quantity: str
    where: str
    unit: str
    a: Array
    b: Array


def distances(samples: Sequence[Sample]) -> list[Distance]:
    """Test every quantity and adjust the p-values for their number.

    Parameters
    ----------
    samples
        All that is asked of the two ensembles: one family of tests.

    Returns
    -------
    list of Distance
        In the same order.
    """
    if not samples:
        return []
    tests = [ks_2samp(sample.a, sample.b) for sample in samples]
    adjusted = false_discovery_control([test.pvalue for test in tests], method="by")
    return [
        Distance(
            quantity=sample.quantity,
            where=sample.where,
            unit=sample.unit,
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
    first_turn: int,
) -> list[Sample]:
    """Collect what two ensembles are asked.

    Parameters
    ----------
    a, b
        The runs, all with the same times.
    instants
        Sample times (s) at which channels are compared, shape (k,).
    floors
        Channel -> its floor and unit. Where both ensembles spread (standard deviation) by less than the floor
        the motion is predictable, and comparing single runs says more.
    period
        Of a crank turn, s.
    first_turn
        The first whose contacts count, from 0: until then the runs have not parted.
    """
    return list(
        chain(
            _channels(a, b, instants, floors),
            _counts(a, b, period, first_turn),
            _quantiles(a, b, period * first_turn),
        )
    )


def _channels(
    a: Sequence[Table], b: Sequence[Table], instants: Array, floors: Mapping[str, tuple[float, str]]
) -> Iterator[Sample]:
    rows = np.searchsorted(a[0].time, instants - 1e-9 * instants[-1])
    for channel, (floor, unit) in floors.items():
        of_a, of_b = (np.array([table.values(channel)[rows] for table in runs]) for runs in (a, b))
        for k, instant in enumerate(instants):
            if max(of_a[:, k].std(), of_b[:, k].std()) > floor:
                yield Sample(channel, f"t = {instant:.4f} s", unit, of_a[:, k], of_b[:, k])


def _counts(a: Sequence[Table], b: Sequence[Table], period: float, first_turn: int) -> Iterator[Sample]:
    """Count the contacts that begin in a turn, by corner."""
    turns = range(first_turn, round(a[0].time[-1] / period))
    for corner, words in CORNERS.items():
        for turn in turns:
            both = (np.array([_begun(_events(t), corner, turn, period) for t in runs]) for runs in (a, b))
            yield Sample(f"contacts, {words} corner", f"turn {turn + 1}", "", *both)


def _begun(events: pd.DataFrame, corner: str, turn: int, period: float) -> float:
    begun = events["start"].to_numpy(float)[(events["corner"] == corner).to_numpy()]
    return float(np.count_nonzero((begun >= turn * period) & (begun < (turn + 1) * period)))


def _quantiles(a: Sequence[Table], b: Sequence[Table], since: float) -> Iterator[Sample]:
    """Take quantiles of each run's own contacts; a run without any has zero."""
    for column, unit in OF_CONTACTS.items():
        for words, level in QUANTILES.items():
            both = (
                np.array([_quantile(_events(table), column, level, since) for table in runs])
                for runs in (a, b)
            )
            yield Sample(f"{column.replace('_', ' ')} of a contact", words, unit, *both)


def _quantile(events: pd.DataFrame, column: str, level: float, since: float) -> float:
    values = events[column].to_numpy(float)[(events["start"] >= since).to_numpy()]
    return float(np.quantile(values, level)) if values.size else 0.0


def _events(table: Table) -> pd.DataFrame:
    if table.events is None:
        raise ValueError("a run of an ensemble has no event table")
    return table.events
