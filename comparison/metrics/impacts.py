"""Comparison of impacts contact by contact, from the models' event tables.

Samples are not used: the median contact lasts 0.2 ms, a sampling interval 0.4 ms. Impulses are preferred to
peak forces: a peak depends on the contact's compliance, an impulse on the colliding masses and their speeds.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from comparison.tables.arrays import Array, BoolArray
from comparison.tables.channels import CONTACTS

IntArray = NDArray[np.intp]

# Two starts are matched within this share of a crank cycle (80 us at 150 rpm). It is less than half of the
# shortest time between contacts of one corner in the shipped scenes (4.4e-4 of a cycle), so that matching is
# unique during chatter; where runs are predictable their starts agree to 1e-4 of a cycle, and elsewhere the
# nearest start is typically 1e-3 away. Samples are 1e-3 apart.
WINDOW = 1 / 5000


@dataclass(frozen=True)
class Impacts:
    """Agreement of the contacts of b with those of a.

    Attributes
    ----------
    pairs
        Rows of the two event tables that are matched, in the order of a's starts, shape (m, 2).
    count_a, count_b
        Contacts considered.
    precision, recall
        Share of b's and of a's contacts that are matched; nan without any.
    largest_delay, median_delay
        Of the absolute differences of matched starts, s; nan without a match, like all that follow but the
        total impulse's.
    normal_speed_error
        Largest difference of the normal speeds of matched contacts, over the largest normal speed considered.
    total_impulse_error
        Difference of the impulses of all contacts considered, matched or not, over the mean of the two.
    impulse_error
        Sum of the absolute differences of the impulses of matched contacts, over the same mean. Large where
        chatter ends in a lasting contact and one model lifts off once more than the other: there a short
        contact is matched with a long one, which leaves the total unchanged.
    peak_force_error
        Largest difference of the peak forces of matched contacts, over the largest peak considered.
        Information: a peak depends on compliance.
    """

    pairs: IntArray
    count_a: int
    count_b: int
    precision: float
    recall: float
    largest_delay: float
    median_delay: float
    normal_speed_error: float
    total_impulse_error: float
    impulse_error: float
    peak_force_error: float


def match(a: pd.DataFrame, b: pd.DataFrame, window: float) -> IntArray:
    """Match the contacts of two event tables one to one.

    Two contacts match if they are at the same corner, each one's start is the nearest start of the other
    table to the other's, and both are at most ``window`` apart. Of two equally near the earlier is the
    nearest. Exchanging the tables exchanges the columns and orders the rows by the other starts.

    Parameters
    ----------
    a, b
        ``corner`` and ``start`` (s); in any order, the starts at one corner distinct.
    window
        s, >= 0.

    Returns
    -------
    pairs
        Row positions in a and in b, in the order of a's starts, shape (m, 2).
    """
    found = [np.empty((0, 2), dtype=np.intp)]
    for place in CONTACTS:
        rows_a, starts_a = _starts(a, place)
        rows_b, starts_b = _starts(b, place)
        if not (rows_a.size and rows_b.size):
            continue
        partner = _nearest(starts_a, starts_b)
        mutual = _nearest(starts_b, starts_a)[partner] == np.arange(rows_a.size)
        mutual &= np.abs(starts_b[partner] - starts_a) <= window
        found.append(np.column_stack([rows_a, rows_b[partner]])[mutual])
    pairs = np.concatenate(found)
    start = _column(a, "start")[pairs[:, 0]]
    return pairs[np.lexsort((pairs[:, 0], start))]


def compare_impacts(
    a: pd.DataFrame,
    b: pd.DataFrame,
    window: float,
    part: tuple[BoolArray, BoolArray] | None = None,
) -> Impacts:
    """Compare the contacts of two event tables.

    Parameters
    ----------
    a, b
        One row a contact: corner, start, normal_speed, impulse, peak_force; SI units. An empty one needs no
        columns.
    window
        See `match`.
    part
        Which contacts to consider, shapes (len(a),) and (len(b),), see `begin_where`; None: all. The tables
        are matched as a whole, and a matched contact is considered if its partner is: none loses its partner
        at the edge of the part.
    """
    pairs = match(a, b, window)
    first, second = pairs[:, 0], pairs[:, 1]
    in_a, in_b = (np.ones(len(a), np.bool_), np.ones(len(b), np.bool_)) if part is None else part
    kept = in_a[first] | in_b[second]
    pairs, first, second = pairs[kept], first[kept], second[kept]
    in_a, in_b = in_a.copy(), in_b.copy()
    in_a[first], in_b[second] = True, True
    count_a, count_b = int(in_a.sum()), int(in_b.sum())
    delays = np.abs(_column(a, "start")[first] - _column(b, "start")[second])

    def differences(name: str) -> tuple[Array, Array, Array]:
        """Return the differences of matched contacts, and all values of a and b that are considered."""
        of_a, of_b = _column(a, name), _column(b, name)
        return np.abs(of_a[first] - of_b[second]), of_a[in_a], of_b[in_b]

    def largest(name: str) -> float:
        difference, of_a, of_b = differences(name)
        return _ratio(difference.max(), max(of_a.max(), of_b.max())) if len(pairs) else np.nan

    impulse, impulse_a, impulse_b = differences("impulse")
    total_a, total_b = impulse_a.sum(), impulse_b.sum()
    mean = (total_a + total_b) / 2
    return Impacts(
        pairs=pairs,
        count_a=count_a,
        count_b=count_b,
        precision=_ratio(len(pairs), count_b),
        recall=_ratio(len(pairs), count_a),
        largest_delay=float(delays.max()) if delays.size else np.nan,
        median_delay=float(np.median(delays)) if delays.size else np.nan,
        normal_speed_error=largest("normal_speed"),
        total_impulse_error=_ratio(abs(total_a - total_b), mean),
        impulse_error=_ratio(impulse.sum(), mean) if len(pairs) else np.nan,
        peak_force_error=largest("peak_force"),
    )


def begin_where(events: pd.DataFrame, time: Array, holds: Mapping[str, BoolArray]) -> BoolArray:
    """Return which contacts begin where something holds.

    Parameters
    ----------
    events
        ``corner`` and ``start`` (s).
    time
        Increasing, s, shape (n,), n >= 2.
    holds
        Corner -> whether it holds at each time, shape (n,). It holds at a start if it holds at the samples on
        either side.

    Returns
    -------
    begins
        In the order of the rows, shape (len(events),).
    """
    begins = np.zeros(len(events), dtype=np.bool_)
    for place, mask in holds.items():
        rows, starts = _starts(events, place)
        after = np.clip(np.searchsorted(time, starts), 1, time.size - 1)
        begins[rows] = mask[after - 1] & mask[after]
    return begins


def impacts_of(
    a: pd.DataFrame | None,
    b: pd.DataFrame | None,
    *,
    time: Array,
    period: float | None,
    predictable: Mapping[str, BoolArray],
) -> dict[str, Impacts] | None:
    """Compare the contacts of two runs: "all", and those of the "predictable" part where that is known.

    Parameters
    ----------
    a, b
        Event tables; None: the run has none.
    time
        Increasing, s, shape (n,).
    period
        Period of a crank cycle, s, which sets the `WINDOW`; None: unknown.
    predictable
        Corner -> where its contacts are predictable, shape (n,); empty if no uncertainty is known.

    Returns
    -------
    impacts
        None, "not available", where a table or the period is missing.
    """
    if a is None or b is None or period is None:
        return None
    window = WINDOW * period
    impacts = {"all": compare_impacts(a, b, window)}
    if predictable:
        part = begin_where(a, time, predictable), begin_where(b, time, predictable)
        impacts["predictable"] = compare_impacts(a, b, window, part)
    return impacts


def _column(events: pd.DataFrame, name: str) -> Array:
    return events[name].to_numpy(dtype=np.float64) if len(events) else np.empty(0)


def _starts(events: pd.DataFrame, place: str) -> tuple[IntArray, Array]:
    """Return row positions and starts of the contacts at one place, by increasing start."""
    if not len(events):
        return np.empty(0, dtype=np.intp), np.empty(0)
    rows = np.flatnonzero(events["corner"].to_numpy() == place)
    starts = _column(events, "start")[rows]
    order = np.argsort(starts, kind="stable")
    return rows[order], starts[order]


def _nearest(values: Array, among: Array) -> IntArray:
    """Return for each value the position of the nearest in an increasing array; of two the earlier."""
    after = np.clip(np.searchsorted(among, values), 1, max(1, among.size - 1))
    before = after - 1
    after = np.minimum(after, among.size - 1)
    return np.where(values - among[before] <= among[after] - values, before, after)


def _ratio(part: float, whole: float) -> float:
    return float(part / whole) if whole > 0 else np.nan
