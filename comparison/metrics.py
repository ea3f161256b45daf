"""Measures of two runs: two signals on one time grid, a run in an ensemble of runs, contacts of event tables.

Times are in s. Those of signals increase, shape (n,), n >= 2; signals and their differences have the same
shape, and two signals one unit. A change of units only scales a measure that has one. Contacts are not taken
from samples: the median contact lasts 0.2 ms, a sampling interval 0.4 ms.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import inf, nan
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator
from scipy.ndimage import maximum_filter1d, minimum_filter1d

from comparison.tables.channels import CONTACTS, CORNERS, Array, BoolArray
from comparison.tables.table import Table

TUBE = 0.002  # the default width of csv-compare
EQUAL = 1e-12  # numbers that differ by less, relatively, are equal: their sums round so


def maximum(difference: Array) -> float:
    """Return the largest absolute value, in the difference's unit."""
    return float(np.abs(difference).max())


def rms(time: Array, difference: Array) -> float:
    """Return the root mean square over time: a sample weighs the mean distance to its neighbours."""
    # The largest value divides first: squares must neither over- nor underflow, in any unit
    largest = maximum(difference)
    if largest == 0.0:
        return 0.0
    return largest * float(np.sqrt(np.average(np.square(difference / largest), weights=np.gradient(time))))


def scaled_value(value: float, scale: float) -> float:
    """Return the value over the channel's scale (>= 0, in one unit); nan where that is zero."""
    return value / scale if scale > 0 else float("nan")


Extrema = tuple[Sequence[tuple[float, float]], Sequence[tuple[float, float]]]
"""Instants and values of two signals between their samples."""


def peaks(
    time: Array, a: Array, b: Array, zero: float = 0.0, extrema: Extrema = ((), ())
) -> tuple[tuple[float, float], ...]:
    """Return value and instant of the peak of either signal: the sample, or extremum, farthest from a zero.

    It is on the side to which the two go farther: else a wave as high as it is deep could have its peak above
    in one signal and below in the other. Of samples equally far, to round-off, the first counts.
    """
    times = [np.append(time, [instant for instant, _ in points]) for points in extrema]
    signals = [
        np.append(each, [value for _, value in points]) for each, points in zip((a, b), extrema, strict=True)
    ]
    above = max(float(each.max()) for each in signals) - zero
    below = zero - min(float(each.min()) for each in signals)
    side = 1.0 if above >= (1.0 - EQUAL) * below else -1.0
    pairs = []
    for instants, signal in zip(times, signals, strict=True):
        distance = side * (signal - zero)
        row = int((distance >= distance.max() - EQUAL * abs(distance.max())).argmax())
        pairs.append((float(signal[row]), float(instants[row])))
    return tuple(pairs)


def correlation(time: Array, a: Array, b: Array) -> float:
    """Return Pearson's correlation coefficient over time, without any shift; nan where either is constant."""
    if np.ptp(a) == 0.0 or np.ptp(b) == 0.0:
        return float("nan")
    roots = _root_weights(time)
    directions = []
    for signal in (a, b):
        signal = signal / maximum(signal)  # squares must neither over- nor underflow
        deviation = roots * (signal - np.average(signal, weights=roots**2))
        directions.append(deviation / np.linalg.norm(deviation))
    return float(np.clip(directions[0] @ directions[1], -1.0, 1.0))


def tube_share(time: Array, reference: Array, other: Array) -> float:
    """Return the share of the samples that lie in a tube around the reference; alone a poor gate.

    A rectangle of half-width `TUBE` of its duration and half-height `TUBE` of its range widens the
    reference, at uniform times, by the rule of csv-compare (Modelica Association): a missing contact force
    is inside.
    """
    width = 2 * int(TUBE * (reference.size - 1) + 1e-9) + 1  # 0.002 of 500 is a sample, however it rounds
    height, reach = TUBE * float(np.ptp(reference)), TUBE * float(time[-1] - time[0])
    ends = [np.interp(time + side * reach, time, reference) for side in (-1.0, 1.0)]
    low = np.min([minimum_filter1d(reference, width, mode="nearest"), *ends], axis=0) - height
    high = np.max([maximum_filter1d(reference, width, mode="nearest"), *ends], axis=0) + height
    return float(np.mean((other >= low) & (other <= high)))


def tube_distance(time: Array, a: Array, b: Array, reach: float) -> Array:
    """Return the distance of two signals of which either may be early or late, shape (n,).

    Each is compared with the range of the other within ``reach`` (s), and the larger distance counts: a peak
    that one of them lacks is as far away as it is high.
    """
    return np.maximum(_beyond_range(time, a, b, reach), _beyond_range(time, b, a, reach))


def _beyond_range(time: Array, values: Array, other: Array, reach: float) -> Array:
    """Return the distance of values from the range of another signal, which is continued beyond its ends."""
    steps = np.diff(other) / np.diff(time)
    grid = np.concatenate([[time[0] - reach], time, [time[-1] + reach]])
    other = np.concatenate([[other[0] - steps[0] * reach], other, [other[-1] + steps[-1] * reach]])
    windows = np.column_stack(
        [np.searchsorted(grid, time - reach), np.searchsorted(grid, time + reach, side="right")]
    ).ravel()
    # An index past the end ends the last window; what lies between two windows is not used.
    padded = np.append(other, other[-1])
    ends = [np.interp(time + side * reach, grid, other) for side in (-1.0, 1.0)]
    low = np.min([np.minimum.reduceat(padded, windows)[::2], *ends], axis=0)
    high = np.max([np.maximum.reduceat(padded, windows)[::2], *ends], axis=0)
    return np.asarray(np.maximum(np.maximum(low - values, values - high), 0.0))


def measures(
    time: Array, a: Array, b: Array, *, position: bool, extrema: Extrema = ((), ())
) -> dict[str, float]:
    """Return the usual measures of b against a; nan where one is undefined.

    The zero of a position is arbitrary (the slider moves by 0.2 mm at x = -0.55 m): its peak is measured from
    the mean of the two. Correlation and tube use as many samples at uniform times.
    """
    grid = np.linspace(time[0], time[-1], time.size)
    first, second = np.interp(grid, time, a), np.interp(grid, time, b)
    zero = float(first.mean() + second.mean()) / 2 if position else 0.0
    (peak_a, time_a), (peak_b, time_b) = peaks(time, a, b, zero, extrema)
    return {
        "tube_share": tube_share(grid, first, second),
        "correlation": correlation(grid, first, second),
        "peak_a": peak_a,
        "peak_b": peak_b,
        "peak_difference": peak_b - peak_a,
        "peak_time_a": time_a,
        "peak_time_b": time_b,
        "peak_time_difference": time_b - time_a,
    }


def _root_weights(time: Array) -> Array:
    """Return the square roots of twice the weights of the trapezoidal rule."""
    return np.asarray(np.sqrt(np.diff(time, prepend=time[0]) + np.diff(time, append=time[-1])))


# ---- rank of a run in an ensemble of runs
#
# The statistic T of a run S is the largest |S - mean(M)| / max(std(M), u) over the samples of one channel,
# with the members M; that of a member is against the others. If S is drawn as the members are, T(S) exceeds
# all T(M_i), i = 1 ... n, about once in n + 1 draws, whatever the distribution (a permutation test;
# B. Phipson, G. K. Smyth, Stat. Appl. Genet. Mol. Biol. 9, 2010, 39). Of several channels the largest counts.


def distances(members: Array, run: Array, floor: Array) -> tuple[Array, float]:
    """Return T of one channel for each of n >= 3 members, and for a run; zero without a sample.

    Members have shape (n, m), run and floor u (m,). Without the floor a solver's local errors would count.
    """
    count = members.shape[0]
    if not run.size:
        return np.zeros(count), 0.0
    centre = members.mean(axis=0)
    deviations = members - centre
    squares = (deviations**2).sum(axis=0)
    distance = float((np.abs(run - centre) / np.maximum(np.sqrt(squares / count), floor)).max())
    # Without member i the mean moves by -deviation_i / (n - 1); the sum of squares about it follows.
    variances = np.maximum(squares - deviations**2 * (count / (count - 1)), 0.0) / (count - 1)
    of_members = np.abs(deviations) * (count / (count - 1)) / np.maximum(np.sqrt(variances), floor)
    return of_members.max(axis=1), distance


# ---- linear relation of two signals, with the errors of its coefficients

_BLOCKS = 20  # of the jackknife


@dataclass(frozen=True)
class Fit:
    """Coefficients of ``b = ratio * a + offset``, two standard errors of each, and the remainder."""

    ratio: float
    offset: float
    ratio_error: float
    offset_error: float
    rest: float  # RMS of the remainder over that of b - a; nan without b - a, inf of multiples of zero


def fit(a: Array, b: Array, *, scaled: bool = False, moved: bool = False) -> Fit:
    """Fit b by a with a free ratio (``scaled``), a free offset (``moved``) or both, by least squares.

    Errors are those of the delete-one jackknife over blocks of the samples, plus the rounding of the numbers:
    the remainder may be correlated within a block.
    """
    if scaled and not a.any():
        return Fit(nan, nan, nan, nan, inf)
    design = np.column_stack([a] * scaled + [np.ones(a.size)] * moved)
    target = b if scaled else b - a
    count = min(_BLOCKS, a.size)
    blocks = np.arange(a.size) * count // a.size

    def solve(rows: BoolArray) -> Array:
        return np.asarray(np.linalg.lstsq(design[rows], target[rows], rcond=None)[0], dtype=np.float64)

    solution = solve(np.ones(a.shape, dtype=np.bool_))
    estimates = np.array([solve(blocks != n) for n in range(count)])
    rounding = 4 * np.spacing(max(np.abs(a).max(), np.abs(b).max()))
    errors = 2 * np.sqrt((count - 1) * np.var(estimates, axis=0))
    errors += rounding / np.sqrt(np.mean(design**2, axis=0))
    rms_before, rms_after = (float(np.sqrt(np.mean(rest**2))) for rest in (b - a, target - design @ solution))
    ratio, ratio_error = (float(solution[0]), float(errors[0])) if scaled else (1.0, 0.0)
    offset, offset_error = (float(solution[-1]), float(errors[-1])) if moved else (0.0, 0.0)
    return Fit(ratio, offset, ratio_error, offset_error, rms_after / rms_before if rms_before else nan)


# ---- contacts: matching, situations, forces, and the one that separates two groups of runs

IntArray = NDArray[np.intp]

# Two starts are matched within this share of a crank cycle: less than half of the shortest time between
# contacts of one corner in the shipped scenes (4.4e-4 of a cycle), so that matching is unique during chatter;
# where runs are predictable their starts agree to 1e-4 of a cycle.
WINDOW = 1 / 5000
PARTING_SHARE = 0.9  # a contact separates two groups of runs if their shares that have it differ by as much

SITUATIONS = {
    "free": "free",
    "one_corner": "one corner",
    "one_side": "two corners of one side",
    "opposite": "two opposite corners",
}
"""The paper's four contact situations of the slider (Sec. 2, Fig. 3); opposite: at both walls at once."""

PULSE_POINTS = 20  # fewest points of a pulse; a monotone spline joins fewer
PULSE_PEAK = 0.01  # largest relative distance of a pulse's peak from that of the event table
_MIN_POINTS = 5  # fewest points that a model records of a contact, its peak among them


@dataclass(frozen=True)
class Impacts:
    """Agreement of the contacts of b with those of a; nan where there is nothing to compare.

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


def contact_places(*tables: pd.DataFrame | None) -> list[str]:
    """Return the places of the contacts in event tables: the press's in their order, then others."""
    places = dict.fromkeys(
        place for table in tables if table is not None and len(table) for place in table["corner"]
    )
    return sorted(map(str, places), key=lambda place: [*CONTACTS, place].index(place))


def match(a: pd.DataFrame, b: pd.DataFrame, window: float) -> IntArray:
    """Match the contacts of two event tables one to one: rows of a and b, by a's starts, shape (m, 2).

    Two contacts match if they are at the same corner, each one's start is the nearest start of the other
    table to the other's (of two equally near the earlier), and both are at most ``window`` apart.
    """
    matches = [np.empty((0, 2), dtype=np.intp)]
    for place in contact_places(a, b):
        (rows_a, starts_a), (rows_b, starts_b) = starts_at(a, place), starts_at(b, place)
        if rows_a.size and rows_b.size:
            partner = _nearest(starts_a, starts_b)
            mutual = _nearest(starts_b, starts_a)[partner] == np.arange(rows_a.size)
            mutual &= np.abs(starts_b[partner] - starts_a) <= window
            matches.append(np.column_stack([rows_a, rows_b[partner]])[mutual])
    pairs = np.concatenate(matches)
    return pairs[np.lexsort((pairs[:, 0], _column(a, "start")[pairs[:, 0]]))]


def compare_impacts(
    a: pd.DataFrame, b: pd.DataFrame, window: float, masks: tuple[BoolArray, BoolArray] | None = None
) -> Impacts:
    """Compare the contacts of two event tables, matched within a window.

    ``masks`` are the rows to consider. The tables are matched as a whole, and a matched contact is
    considered if its partner is: none loses its partner at the edge of a mask.
    """
    pairs, events = match(a, b, window), (a, b)
    masks = masks or (np.ones(len(a), np.bool_), np.ones(len(b), np.bool_))
    pairs = pairs[masks[0][pairs[:, 0]] | masks[1][pairs[:, 1]]]
    row_sets = [np.union1d(np.flatnonzero(mask), pairs[:, side]) for side, mask in enumerate(masks)]

    def differences(name: str) -> Array:
        first, second = (_column(table, name)[pairs[:, side]] for side, table in enumerate(events))
        return np.abs(first - second)

    def largest_error(name: str) -> float:
        if not len(pairs):
            return np.nan
        maxima = (_column(table, name)[rows].max() for table, rows in zip(events, row_sets, strict=True))
        return _ratio(differences(name).max(), max(maxima))

    delays = differences("start")
    totals = [_column(table, "impulse")[rows].sum() for table, rows in zip(events, row_sets, strict=True)]
    mean = sum(totals) / 2
    return Impacts(
        pairs=pairs,
        count_a=row_sets[0].size,
        count_b=row_sets[1].size,
        precision=_ratio(len(pairs), row_sets[1].size),
        recall=_ratio(len(pairs), row_sets[0].size),
        largest_delay=float(delays.max()) if delays.size else np.nan,
        median_delay=float(np.median(delays)) if delays.size else np.nan,
        normal_speed_error=largest_error("normal_speed"),
        total_impulse_error=_ratio(abs(totals[0] - totals[1]), mean),
        impulse_error=_ratio(differences("impulse").sum(), mean) if len(pairs) else np.nan,
        peak_force_error=largest_error("peak_force"),
    )


def begin_where(events: pd.DataFrame, time: Array, masks: Mapping[str, BoolArray]) -> BoolArray:
    """Return by row if a contact starts where its corner's mask is true at the samples on either side."""
    begins = np.zeros(len(events), dtype=np.bool_)
    for place, mask in masks.items():
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
    bounds = np.clip(np.column_stack([_column(events, "start"), _column(events, "end")]), *span)
    contacts = {place: bounds[starts_at(events, place)[0]] for place in CORNERS}
    edges = np.unique(np.concatenate([span, *(spans.ravel() for spans in contacts.values())]))
    lengths, touches = np.diff(edges) / (span[1] - span[0]), {}  # 1 where a corner touches
    for place, spans in contacts.items():
        starts, ends = (np.searchsorted(np.sort(column), edges[:-1], "right") for column in spans.T)
        touches[place] = (starts > ends).astype(np.intp)
    left, right = touches["ll"] + touches["ul"], touches["lr"] + touches["ur"]
    situation = np.where(np.minimum(left, right) > 0, 3, np.maximum(left, right))
    return {name: float(lengths[situation == k].sum()) for k, name in enumerate(SITUATIONS)}


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
        error = abs(float(force.max()) - peaks[row])
        if stop - first < _MIN_POINTS or not error <= PULSE_PEAK * peaks[row] > 0.0:
            continue
        if time.size < PULSE_POINTS:
            parts = np.linspace(0.0, 1.0, -(-PULSE_POINTS // (time.size - 1)), endpoint=False)
            grid = np.append((time[:-1, None] + np.diff(time)[:, None] * parts).ravel(), time[-1])
            time, force = grid, np.maximum(PchipInterpolator(time, force)(grid), 0.0)  # not by rounding
        pulses.append(Pulse(row, time, force))
    return pulses


class Parting(NamedTuple):
    """A contact that separates two groups of runs: its start, s, and how many runs of each group have it."""

    corner: str
    start: float
    counts: tuple[int, int]
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

    for corner in contact_places(*groups[0], *groups[1]):
        starts = [[starts_at(events, corner)[1] for events in group] for group in groups]
        candidates = np.concatenate([times for group in starts for times in group])
        candidates = candidates[candidates <= until]
        one, other = (np.sum([near(candidates, times) for times in group], axis=0) for group in starts)
        gaps = np.abs(one / sizes[0] - other / sizes[1])
        if np.any(gaps >= PARTING_SHARE):
            # The start of this contact that separates the groups best
            earliest = candidates[gaps >= PARTING_SHARE].min()
            nearby = np.flatnonzero((candidates >= earliest) & (candidates <= earliest + window))
            k = nearby[gaps[nearby].argmax()]
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


def _nearest(values: Array, candidates: Array) -> IntArray:
    """Return for each value the position of the nearest in an increasing array; of two the earlier."""
    after = np.searchsorted(candidates, values)
    neighbours = np.concatenate([[-np.inf], candidates, [np.inf]])
    return np.where(values - neighbours[after] <= neighbours[after + 1] - values, after - 1, after)


def _ratio(part: float, whole: float) -> float:
    return float(part / whole) if whole > 0 else np.nan
