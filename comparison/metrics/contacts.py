"""Contacts from event tables: matching, situations, forces, and the one that separates two groups of runs.

Samples are not used: the median contact lasts 0.2 ms, a sampling interval 0.4 ms. Times are in s.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from comparison.tables.channels import CONTACTS, CORNERS, PIN, Array, BoolArray
from comparison.tables.table import Table

IntArray = NDArray[np.intp]

# Two starts are matched within this share of a crank cycle: less than half of the shortest time between
# contacts of one corner in the shipped scenes (4.4e-4 of a cycle), so that matching is unique during chatter;
# where runs are predictable their starts agree to 1e-4 of a cycle.
WINDOW = 1 / 5000
PARTED = 0.9  # least difference of the shares of two groups that have a contact, for it to separate them

SITUATIONS = {
    "free": "free",
    "one_corner": "one corner",
    "one_side": "two corners of one side",
    "opposite": "two opposite corners",
}
"""The paper's four contact situations of the slider (Sec. 2, Fig. 3); opposite: at both walls at once."""

PULSE_POINTS = 20  # of a pulse at least; fewer noted ones are joined by a monotone spline
PULSE_PEAK = 0.01  # relative distance of a pulse's peak from that of the event table at most
_NOTED = 5  # points that a model must have noted of a contact, its peak among them


@dataclass(frozen=True)
class Impacts:
    """Agreement of the contacts of b with those of a; a number is nan where there is nothing to compare.

    ``pairs`` are the matched rows of both, shape (m, 2); precision and recall the shares of b's and of a's
    contacts that are matched. Errors of speed and peak force are the largest over the largest value; that of
    the total impulse is of all contacts, matched or not, that of the impulse the sum over matched ones, both
    over the mean of the two totals. Impulses depend less on compliance than peak forces.
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
    """Match the contacts of two event tables one to one: rows of a and b, by a's starts, shape (m, 2).

    Two contacts match if they are at the same corner, each one's start is the nearest start of the other
    table to the other's (of two equally near the earlier), and both are at most ``window`` apart.
    """
    matched = [np.empty((0, 2), dtype=np.intp)]
    for place in CONTACTS:
        (rows_a, starts_a), (rows_b, starts_b) = starts_at(a, place), starts_at(b, place)
        if rows_a.size and rows_b.size:
            partner = _nearest(starts_a, starts_b)
            mutual = _nearest(starts_b, starts_a)[partner] == np.arange(rows_a.size)
            mutual &= np.abs(starts_b[partner] - starts_a) <= window
            matched.append(np.column_stack([rows_a, rows_b[partner]])[mutual])
    pairs = np.concatenate(matched)
    return pairs[np.lexsort((pairs[:, 0], _column(a, "start")[pairs[:, 0]]))]


def compare_impacts(
    a: pd.DataFrame, b: pd.DataFrame, window: float, part: tuple[BoolArray, BoolArray] | None = None
) -> Impacts:
    """Compare the contacts of two event tables, matched within a window.

    ``part`` masks the rows to consider. The tables are matched as a whole, and a matched contact is
    considered if its partner is: none loses its partner at the edge of the part.
    """
    pairs, events = match(a, b, window), (a, b)
    part = part or (np.ones(len(a), np.bool_), np.ones(len(b), np.bool_))
    pairs = pairs[part[0][pairs[:, 0]] | part[1][pairs[:, 1]]]
    counted = [np.union1d(np.flatnonzero(own), pairs[:, side]) for side, own in enumerate(part)]

    def differences(name: str) -> Array:
        first, second = (_column(table, name)[pairs[:, side]] for side, table in enumerate(events))
        return np.abs(first - second)

    def largest(name: str) -> float:
        if not len(pairs):
            return np.nan
        largest_of_each = (
            _column(table, name)[rows].max() for table, rows in zip(events, counted, strict=True)
        )
        return _ratio(differences(name).max(), max(largest_of_each))

    delays = differences("start")
    totals = [_column(table, "impulse")[rows].sum() for table, rows in zip(events, counted, strict=True)]
    mean = sum(totals) / 2
    return Impacts(
        pairs=pairs,
        count_a=counted[0].size,
        count_b=counted[1].size,
        precision=_ratio(len(pairs), counted[1].size),
        recall=_ratio(len(pairs), counted[0].size),
        largest_delay=float(delays.max()) if delays.size else np.nan,
        median_delay=float(np.median(delays)) if delays.size else np.nan,
        normal_speed_error=largest("normal_speed"),
        total_impulse_error=_ratio(abs(totals[0] - totals[1]), mean),
        impulse_error=_ratio(differences("impulse").sum(), mean) if len(pairs) else np.nan,
        peak_force_error=largest("peak_force"),
    )


def begin_where(events: pd.DataFrame, time: Array, holds: Mapping[str, BoolArray]) -> BoolArray:
    """Return by row which contacts start where their corner's mask is true at the samples on either side."""
    begins = np.zeros(len(events), dtype=np.bool_)
    for place, mask in holds.items():
        rows, starts = starts_at(events, place)
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
    """Compare the contacts of two runs: "all", and those in the "predictable" samples of their corner."""
    if a is None or b is None or period is None:
        return None
    impacts = {"all": compare_impacts(a, b, WINDOW * period)}
    if predictable:
        part = begin_where(a, time, predictable), begin_where(b, time, predictable)
        impacts["predictable"] = compare_impacts(a, b, WINDOW * period, part)
    return impacts


def time_shares(events: pd.DataFrame, span: tuple[float, float]) -> dict[str, float]:
    """Return the share of a span of time that the slider spends in each of the `SITUATIONS`, to round-off."""
    lengths, touches = _touches(events, list(CORNERS), span)
    left, right = touches["ll"] + touches["ul"], touches["lr"] + touches["ur"]
    situation = np.where(np.minimum(left, right) > 0, 3, np.maximum(left, right))
    return {name: float(lengths[situation == k].sum()) for k, name in enumerate(SITUATIONS)}


def pin_share(events: pd.DataFrame, span: tuple[float, float]) -> float:
    """Return the share of a span of time in which the journal at A touches its bearing; see `time_shares`."""
    lengths, touches = _touches(events, [PIN], span)
    return float(lengths[touches[PIN] > 0].sum())


def _touches(
    events: pd.DataFrame, places: list[str], span: tuple[float, float]
) -> tuple[Array, dict[str, IntArray]]:
    """Return the lengths between all starts and ends, as shares of the span, and 1 where a place touches."""
    bounds = np.clip(np.column_stack([_column(events, "start"), _column(events, "end")]), *span)
    contacts = {place: bounds[starts_at(events, place)[0]] for place in places}
    edges = np.unique(np.concatenate([span, *(own.ravel() for own in contacts.values())]))
    touches = {}
    for place, own in contacts.items():
        begun, ended = (np.searchsorted(np.sort(column), edges[:-1], "right") for column in own.T)
        touches[place] = (begun > ended).astype(np.intp)
    return np.diff(edges) / (span[1] - span[0]), touches


@dataclass(frozen=True)
class Pulse:
    """Normal force (N) of the contact in a row of the event table, at times (s) from the touch."""

    row: int
    time: Array
    force: Array


def pulses_of(table: Table) -> list[Pulse]:
    """Return the force pulses of a table that have enough points and the peak of its event table.

    A model notes the forces of its contacts at its own steps. No verdict depends on them: they are drawn.
    """
    if table.pulses is None or table.events is None:
        return []
    rows, times, forces = (table.pulses[name] for name in ("row", "time", "force"))
    starts, peaks = _column(table.events, "start"), _column(table.events, "peak_force")
    pulses = []
    for first, stop in pairwise(np.flatnonzero(np.diff(rows, prepend=-1, append=-1)).tolist()):
        row = int(rows[first])
        time, force = times[first:stop] - starts[row], forces[first:stop]
        # Any error of the forces shows in their peak.
        if stop - first < _NOTED or not abs(float(force.max()) - peaks[row]) <= PULSE_PEAK * peaks[row] > 0.0:
            continue
        if time.size < PULSE_POINTS:
            parts = np.linspace(0.0, 1.0, -(-PULSE_POINTS // (time.size - 1)), endpoint=False)
            closer = np.append((time[:-1, None] + np.diff(time)[:, None] * parts).ravel(), time[-1])
            time, force = closer, np.maximum(PchipInterpolator(time, force)(closer), 0.0)  # not by rounding
        pulses.append(Pulse(row, time, force))
    return pulses


class Parting(NamedTuple):
    """A contact that separates two groups of runs: its start, s, and how many runs of each group have it."""

    corner: str
    start: float
    having: tuple[int, int]
    sizes: tuple[int, int]


def parting_contact(
    groups: tuple[Sequence[pd.DataFrame], Sequence[pd.DataFrame]], *, period: float, until: float
) -> Parting | None:
    """Find the first contact that separates two groups of runs, by their event tables; None without one.

    A run has a contact if one of the same corner starts within `WINDOW`. Those after ``until`` (s) are
    consequences.
    """
    partings = []
    window, sizes = WINDOW * period, (len(groups[0]), len(groups[1]))

    def near(instants: Array, starts: Array) -> BoolArray:
        return np.searchsorted(starts, instants + window) > np.searchsorted(starts, instants - window)

    for corner in CONTACTS:
        starts = [[starts_at(events, corner)[1] for events in group] for group in groups]
        candidates = np.concatenate([own for group in starts for own in group])
        candidates = candidates[candidates <= until]
        one, other = (np.sum([near(candidates, own) for own in group], axis=0) for group in starts)
        apart = np.abs(one / sizes[0] - other / sizes[1])
        if np.any(apart >= PARTED):
            # Of all starts of this contact, that which separates the groups best.
            earliest = candidates[apart >= PARTED].min()
            nearby = np.flatnonzero((candidates >= earliest) & (candidates <= earliest + window))
            k = nearby[apart[nearby].argmax()]
            partings.append(Parting(corner, float(candidates[k]), (int(one[k]), int(other[k])), sizes))
    return min(partings, key=lambda parting: parting.start, default=None)


def starts_at(events: pd.DataFrame, place: str) -> tuple[IntArray, Array]:
    """Return row positions and starts of the contacts at one place, by increasing start."""
    if not len(events):
        return np.empty(0, dtype=np.intp), np.empty(0)
    rows, starts = np.flatnonzero(events["corner"].to_numpy() == place), _column(events, "start")
    rows = rows[np.argsort(starts[rows], kind="stable")]
    return rows, starts[rows]


def _column(events: pd.DataFrame, name: str) -> Array:
    return events[name].to_numpy(dtype=np.float64) if len(events) else np.empty(0)


def _nearest(values: Array, among: Array) -> IntArray:
    """Return for each value the position of the nearest in an increasing array; of two the earlier."""
    after = np.searchsorted(among, values)
    bounded = np.concatenate([[-np.inf], among, [np.inf]])
    return np.where(values - bounded[after] <= bounded[after + 1] - values, after - 1, after)


def _ratio(part: float, whole: float) -> float:
    return float(part / whole) if whole > 0 else np.nan
