"""Contacts of results, from their event tables: matched one by one, their situations, their forces in time.

An event table has one row a contact, in any order: ``corner``, ``start`` and ``end`` (s), ``normal_speed``,
``impulse``, ``peak_force``, in SI units; an empty one needs no columns. Samples are not used: the median
contact lasts 0.2 ms, a sampling interval 0.4 ms. Impulses are preferred to peak forces: a peak depends on the
contact's compliance, an impulse on the colliding masses and their speeds.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from comparison.tables.arrays import Array, BoolArray
from comparison.tables.channels import CONTACTS, CORNERS, PIN
from comparison.tables.table import Table

IntArray = NDArray[np.intp]

# Two starts are matched within this share of a crank cycle (80 us at 150 rpm). It is less than half of the
# shortest time between contacts of one corner in the shipped scenes (4.4e-4 of a cycle), so that matching is
# unique during chatter; where runs are predictable their starts agree to 1e-4 of a cycle, and elsewhere the
# nearest start is typically 1e-3 away. Samples are 1e-3 apart.
WINDOW = 1 / 5000

SITUATIONS = {
    "free": "free",
    "one_corner": "one corner",
    "one_side": "two corners of one side",
    "opposite": "two opposite corners",
}
"""The paper's four contact situations of the slider (Sec. 2, Fig. 3) by key, with their descriptions.

A wall is touched by no corner, one or both of its own. Two opposite corners (Fig. 3b) means contact at both
walls at once, whichever corners: the slider is narrower than its guide, so lower left and lower right cannot
touch together, and what is left are the two diagonals.
"""

PULSE_POINTS = 20
"""Points of a pulse at least; fewer noted ones are joined by a monotone spline."""
PULSE_PEAK = 0.01
"""Relative distance of a pulse's peak from that of the event table at most."""
_NOTED = 5
"""Points that a model must have noted of a contact, its peak among them."""


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
        Event tables; starts at one corner are distinct.
    window
        s, >= 0.

    Returns
    -------
    pairs
        Row positions in a and in b, in the order of a's starts, shape (m, 2).
    """
    matched = [np.empty((0, 2), dtype=np.intp)]
    for place in CONTACTS:
        rows_a, starts_a = _starts(a, place)
        rows_b, starts_b = _starts(b, place)
        if not (rows_a.size and rows_b.size):
            continue
        partner = _nearest(starts_a, starts_b)
        mutual = _nearest(starts_b, starts_a)[partner] == np.arange(rows_a.size)
        mutual &= np.abs(starts_b[partner] - starts_a) <= window
        matched.append(np.column_stack([rows_a, rows_b[partner]])[mutual])
    pairs = np.concatenate(matched)
    start = _column(a, "start")[pairs[:, 0]]
    return pairs[np.lexsort((pairs[:, 0], start))]


def compare_impacts(
    a: pd.DataFrame,
    b: pd.DataFrame,
    window: float,
    part: tuple[BoolArray, BoolArray] | None = None,
) -> Impacts:
    """Compare the contacts of two event tables, matched within a window (s).

    A ``part`` names those to consider, shapes (len(a),) and (len(b),), see `begin_where`. The tables are
    matched as a whole, and a matched contact is considered if its partner is: none loses its partner at the
    edge of the part.
    """
    pairs = match(a, b, window)
    in_a, in_b = (
        np.ones(len(events), np.bool_) if part is None else part[i] for i, events in enumerate((a, b))
    )
    pairs = pairs[in_a[pairs[:, 0]] | in_b[pairs[:, 1]]]
    first, second = pairs[:, 0], pairs[:, 1]
    in_a, in_b = in_a.copy(), in_b.copy()
    in_a[first], in_b[second] = True, True

    def differences(name: str) -> Array:
        return np.abs(_column(a, name)[first] - _column(b, name)[second])

    def largest(name: str) -> float:
        if not len(pairs):
            return np.nan
        values = _column(a, name)[in_a], _column(b, name)[in_b]
        return _ratio(differences(name).max(), max(part.max() for part in values))

    count_a, count_b = int(in_a.sum()), int(in_b.sum())
    delays = differences("start")
    total_a, total_b = _column(a, "impulse")[in_a].sum(), _column(b, "impulse")[in_b].sum()
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
        impulse_error=_ratio(differences("impulse").sum(), mean) if len(pairs) else np.nan,
        peak_force_error=largest("peak_force"),
    )


def begin_where(events: pd.DataFrame, time: Array, holds: Mapping[str, BoolArray]) -> BoolArray:
    """Return which contacts begin where something holds at the samples on either side, shape (len(events),).

    ``holds`` says by corner whether it does at each of the increasing times (s), shape (n,), n >= 2.
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


def time_shares(events: pd.DataFrame, span: tuple[float, float]) -> dict[str, float]:
    """Return the share of a span of time that the slider spends in each of the `SITUATIONS`; their sum is 1.

    Exact from the contacts' starts and ends, to round-off.

    Parameters
    ----------
    events
        Event table; others than the slider's four corners, and what lies outside the span, do not count.
    span
        First and last instant, s.
    """
    lengths, touches = _touches(events, tuple(CORNERS), span)
    left = touches["ll"].astype(int) + touches["ul"]
    right = touches["lr"].astype(int) + touches["ur"]
    holds = {
        "free": left + right == 0,
        "one_corner": left + right == 1,
        "one_side": (np.maximum(left, right) == 2) & (np.minimum(left, right) == 0),
        "opposite": np.minimum(left, right) > 0,
    }
    return {situation: float(lengths[holds[situation]].sum()) for situation in SITUATIONS}


def pin_share(events: pd.DataFrame, span: tuple[float, float]) -> float:
    """Return the share of a span of time in which the journal at A touches its bearing; see `time_shares`."""
    lengths, touches = _touches(events, (PIN,), span)
    return float(lengths[touches[PIN]].sum())


def _touches(
    events: pd.DataFrame, places: tuple[str, ...], span: tuple[float, float]
) -> tuple[Array, dict[str, BoolArray]]:
    """Return the lengths between all starts and ends, as shares of the span, and which places touch there.

    Shapes (n,), the second by place. Contacts of one place may overlap.
    """
    bounds = np.column_stack([_column(events, "start"), _column(events, "end")])
    spans = {place: np.clip(bounds[_starts(events, place)[0]], *span) for place in places}
    edges = np.unique(np.concatenate([span, *(contacts.ravel() for contacts in spans.values())]))
    touches = {}
    for place, contacts in spans.items():
        starts, ends = (
            np.bincount(np.searchsorted(edges, instants), minlength=edges.size) for instants in contacts.T
        )
        touches[place] = np.cumsum(starts - ends)[:-1] > 0
    return np.diff(edges) / (span[1] - span[0]), touches


@dataclass(frozen=True)
class Pulse:
    """Normal force of one contact, shape (n,), n >= `PULSE_POINTS`.

    Attributes
    ----------
    row
        Row of the contact in the event table.
    time
        From the touch, s, increasing.
    force
        N.
    """

    row: int
    time: Array
    force: Array


def noted(table: Table) -> list[Pulse]:
    """Return the contacts that a table has the force of, with enough points and the peak of its events.

    A model notes the forces of its contacts at its own steps. The few of a method of high order are joined by
    a monotone spline. No verdict depends on them: they are drawn.
    """
    if table.pulses is None or table.events is None:
        return []
    rows, times, forces = (table.pulses[name] for name in ("row", "time", "force"))
    starts, peaks = _column(table.events, "start"), _column(table.events, "peak_force")
    pulses = []
    for first, stop in pairwise(np.flatnonzero(np.diff(rows, prepend=-1, append=-1)).tolist()):
        row = int(rows[first])
        time, force = times[first:stop] - starts[row], forces[first:stop]
        # An error of any kind in the forces shows in their peak
        if stop - first < _NOTED or not abs(float(force.max()) - peaks[row]) <= PULSE_PEAK * peaks[row] > 0.0:
            continue
        if time.size < PULSE_POINTS:
            parts = np.linspace(0.0, 1.0, -(-PULSE_POINTS // (time.size - 1)), endpoint=False)
            closer = np.append((time[:-1, None] + np.diff(time)[:, None] * parts).ravel(), time[-1])
            time, force = closer, PchipInterpolator(time, force)(closer)
        pulses.append(Pulse(row, time, force))
    return pulses


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
