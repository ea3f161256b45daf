"""Two ensembles of runs from scattered starts, compared as distributions.

Every quantity gives one number a run, so that the runs, started independently, are the sample. Two samples
are compared by the two-sample test of Kolmogorov and Smirnov and by the Wasserstein distance. Some hundred
tests at 5 % each would find differences by chance: the p-values are adjusted after Benjamini and Yekutieli
(Ann. Statist. 29, 2001, 1165-1188), however the tests depend on each other.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from scipy.stats import false_discovery_control, ks_2samp, wasserstein_distance

from comparison.tables.arrays import Array
from comparison.tables.channels import CORNERS
from comparison.tables.table import Table

RATE = 0.05
"""Of the differences that are reported, the share expected to be false is at most this."""
NAMES = ["quantity", "where", "unit"]
"""What names a column of an ensemble's numbers, and a row of their tests."""
QUANTILES = {"median": 0.5, "nine tenths": 0.9, "largest": 1.0}
CONTACT_COLUMNS = {"largest_depth": "m", "peak_force": "N", "normal_speed": "m/s"}


def distances(a: pd.DataFrame, b: pd.DataFrame) -> pd.DataFrame:
    """Test every column of two ensembles, a row a run; their p-values are adjusted as one family of tests.

    Returns
    -------
    tests
        A row a column: ``statistic``, 0 to 1; ``wasserstein`` and ``scale``, the standard deviation of both
        together, in the column's unit; ``p`` for this column alone; ``adjusted``, the smallest rate of false
        discoveries at which it is a difference; ``differs``: it is one at `RATE`.
    """
    rows = []
    for column in a:
        x, y = a[column].to_numpy(float), b[column].to_numpy(float)
        test = ks_2samp(x, y)
        rows.append((test.statistic, wasserstein_distance(x, y), np.std(np.append(x, y)), test.pvalue))
    tests = pd.DataFrame(rows, a.columns, ["statistic", "wasserstein", "scale", "p"], dtype=np.float64)
    tests["adjusted"] = false_discovery_control(tests["p"], method="by") if rows else tests["p"]
    return tests.assign(differs=tests["adjusted"] <= RATE)


def scattered(
    a: pd.DataFrame, b: pd.DataFrame, floors: Mapping[str, float]
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Return the columns in which either ensemble scatters by more than the floor of the quantity.

    Below it the motion is predictable, and single runs can be compared.
    """
    least = a.columns.get_level_values("quantity").map(lambda name: floors.get(name, -1.0))
    kept = np.maximum(a.to_numpy().std(axis=0), b.to_numpy().std(axis=0)) > least
    return a.loc[:, kept], b.loc[:, kept]


def numbers_of(
    runs: Sequence[Table], instants: Array, units: Mapping[str, str], period: float, first_cycle: int
) -> pd.DataFrame:
    """Return the numbers of an ensemble: a row a run, a column a quantity, where it is taken, and its unit.

    Channels (those of ``units``) are taken at sample times ``instants`` (s), which all runs have. Contacts
    count from a cycle on, the first being 0: until then the runs have not diverged.
    """
    rows = [_numbers(run, instants, units, period, first_cycle) for run in runs]
    return pd.DataFrame(rows, columns=pd.MultiIndex.from_tuples(list(rows[0]), names=NAMES))


def _numbers(
    run: Table, instants: Array, units: Mapping[str, str], period: float, first_cycle: int
) -> dict[tuple[str, str, str], float]:
    assert run.events is not None
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
    for column, unit in CONTACT_COLUMNS.items():
        for words, level in QUANTILES.items():
            value = late[column].quantile(level) if len(late) else 0.0
            numbers[f"{column.replace('_', ' ')} of a contact", words, unit] = float(value)
    return numbers
