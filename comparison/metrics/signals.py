"""Measures of two signals on one time grid, and of a run against an ensemble of runs.

Times increase, in s, shape (n,), n >= 2; signals and their differences have the same shape, and two signals
one unit. No measure changes with the units but by the factor of its own.
"""

from collections.abc import Callable, Sequence
from functools import cache
from math import ceil
from typing import Any, NamedTuple

import numpy as np
from scipy.ndimage import maximum_filter1d, minimum_filter1d

from comparison.tables.channels import Array, BoolArray

TUBE = 0.002  # the default width of csv-compare


def maximum(difference: Array) -> float:
    """Return the largest absolute value, in the difference's unit."""
    return float(np.abs(difference).max())


def rms(time: Array, difference: Array) -> float:
    """Return the root mean square over time: a sample weighs the mean distance to its neighbours."""
    # Taken out before squaring, so that in no unit it overflows or underflows
    largest = maximum(difference)
    if largest == 0.0:
        return 0.0
    return largest * float(np.sqrt(np.average(np.square(difference / largest), weights=np.gradient(time))))


def scaled(value: float, scale: float) -> float:
    """Return the value over the channel's scale (>= 0, in one unit); nan where that is zero."""
    return value / scale if scale > 0 else float("nan")


Between = tuple[Sequence[tuple[float, float]], Sequence[tuple[float, float]]]
"""Instants and values of two signals between their samples."""


def peaks(
    time: Array, a: Array, b: Array, zero: float = 0.0, between: Between = ((), ())
) -> tuple[tuple[float, float], ...]:
    """Return value and instant of the peak of either signal: the sample, or extremum, farthest from a zero.

    On the side to which the two go farther: a wave that is as high as it is deep would else have its peak
    above in one and below in the other. Of samples equally far but for round-off the first.
    """
    times = [np.append(time, [at for at, _ in more]) for more in between]
    signals = [
        np.append(each, [value for _, value in more]) for each, more in zip((a, b), between, strict=True)
    ]
    above = max(float(each.max()) for each in signals) - zero
    below = zero - min(float(each.min()) for each in signals)
    side = 1.0 if above >= (1.0 - EQUAL) * below else -1.0
    pairs = []
    for at, signal in zip(times, signals, strict=True):
        away = side * (signal - zero)
        farthest = int((away >= away.max() - EQUAL * abs(away.max())).argmax())
        pairs.append((float(signal[farthest]), float(at[farthest])))
    return tuple(pairs)


def correlation(time: Array, a: Array, b: Array) -> float:
    """Return Pearson's correlation coefficient over time, without any shift; nan where either is constant."""
    if np.ptp(a) == 0.0 or np.ptp(b) == 0.0:
        return float("nan")
    roots = _root_weights(time)
    directions = []
    for signal in (a, b):
        signal = signal / maximum(signal)  # squares must neither over- nor underflow
        moving = roots * (signal - np.average(signal, weights=roots**2))
        directions.append(moving / np.linalg.norm(moving))
    return float(np.clip(directions[0] @ directions[1], -1.0, 1.0))


class Errors(NamedTuple):
    """Errors of a signal against a reference; pure numbers, 0 for equal signals, nan where either is zero.

    The magnitude's error is how much larger it is, whatever its phase; that of the phase the angle between
    the two over pi, 0 to 1, whatever their magnitudes.
    """

    magnitude: float
    phase: float
    combined: float


def sprague_geers(time: Array, reference: Array, other: Array) -> Errors:
    """Return magnitude, phase and combined error after Sprague and Geers.

    M = sqrt(I_cc / I_mm) - 1, P = arccos(I_mc / sqrt(I_mm I_cc)) / pi and C = sqrt(M^2 + P^2), where I_ab is
    the integral of a b over time, m the reference and c the other signal. A constant that is large against
    what changes hides it: subtract it first. Int. J. Numer. Methods Eng. 60 (2004), 2467-2499.
    """
    ratio, phase = _ratio_and_phase(time, reference, other)
    return Errors(ratio - 1.0, phase, float(np.hypot(ratio - 1.0, phase)))


def russell(time: Array, reference: Array, other: Array) -> Errors:
    """Return magnitude, phase and comprehensive error after Russell.

    R_M = sign(m) log10(1 + |m|) with m = (I_cc - I_mm) / sqrt(I_mm I_cc), R_P = P as of `sprague_geers`, and
    R_C = sqrt(pi / 4 (R_M^2 + R_P^2)): up to 0.15 called excellent, above 0.28 poor. Exchanging the two turns
    the sign of R_M and leaves the others. Proc. 68th Shock and Vibration Symposium (1997).
    """
    ratio, phase = _ratio_and_phase(time, reference, other)
    with np.errstate(divide="ignore"):
        excess = ratio - np.divide(1.0, ratio)
    magnitude = float(np.copysign(np.log10(1.0 + np.abs(excess)), excess))
    return Errors(magnitude, phase, float(np.sqrt(np.pi / 4.0) * np.hypot(magnitude, phase)))


def tube_share(time: Array, reference: Array, other: Array) -> float:
    """Return the share of the samples that lie in a tube around the reference; alone a poor gate.

    The reference, at uniform times, is widened by a rectangle of half-width `TUBE` of its duration and half-
    height `TUBE` of its range, the rule of csv-compare (Modelica Association): a contact force that is
    missing is inside.
    """
    width = 2 * int(TUBE * (reference.size - 1) + 1e-9) + 1  # 0.002 of 500 is a sample, however it rounds
    height, reach = TUBE * float(np.ptp(reference)), TUBE * float(time[-1] - time[0])
    ends = [np.interp(time + side * reach, time, reference) for side in (-1.0, 1.0)]
    low = np.min([minimum_filter1d(reference, width, mode="nearest"), *ends], axis=0) - height
    high = np.max([maximum_filter1d(reference, width, mode="nearest"), *ends], axis=0) + height
    return float(np.mean((other >= low) & (other <= high)))


def tube_distance(time: Array, a: Array, b: Array, reach: float) -> Array:
    """Return the distance of two signals of which either may be early or late, shape (n,).

    Each is held against the range of the other within ``reach`` (s), and the larger distance counts: a peak
    that one of them lacks altogether is as far away as it is high.
    """
    return np.maximum(_beyond_range(time, a, b, reach), _beyond_range(time, b, a, reach))


def _beyond_range(time: Array, values: Array, other: Array, reach: float) -> Array:
    """Return how far values lie outside the range of another signal, which is continued beyond its ends."""
    steps = np.diff(other) / np.diff(time)
    long = np.concatenate([[time[0] - reach], time, [time[-1] + reach]])
    other = np.concatenate([[other[0] - steps[0] * reach], other, [other[-1] + steps[-1] * reach]])
    windows = np.column_stack(
        [np.searchsorted(long, time - reach), np.searchsorted(long, time + reach, side="right")]
    ).ravel()
    # An index past the end ends the last window; what lies between two windows is not used.
    padded = np.append(other, other[-1])
    ends = [np.interp(time + side * reach, long, other) for side in (-1.0, 1.0)]
    low = np.min([np.minimum.reduceat(padded, windows)[::2], *ends], axis=0)
    high = np.max([np.maximum.reduceat(padded, windows)[::2], *ends], axis=0)
    return np.asarray(np.maximum(np.maximum(low - values, values - high), 0.0))


def information(
    time: Array, a: Array, b: Array, *, position: bool, between: Between = ((), ())
) -> dict[str, float]:
    """Measure b against a in the usual ways; nan where a measure is undefined.

    Of a position the zero is arbitrary (the slider moves by 0.2 mm at x = -0.55 m): both are measured from
    the mean of the two. All but `peaks` are of at most 5,000 points, to which a longer table is resampled.
    """
    grid = np.linspace(time[0], time[-1], min(time.size, MOST_POINTS))
    first, second = np.interp(grid, time, a), np.interp(grid, time, b)
    zero = float(first.mean() + second.mean()) / 2 if position else 0.0
    first, second = first - zero, second - zero
    (peak_a, time_a), (peak_b, time_b) = peaks(time, a, b, zero, between)
    errors: dict[str, float] = {}
    for name, last, measure in (
        ("sprague_geers", "combined", sprague_geers),
        ("russell", "comprehensive", russell),
    ):
        parts = (f"{name}_{part}" for part in ("magnitude", "phase", last))
        errors |= dict(zip(parts, measure(grid, first, second), strict=True))
    overall, *scores = rating(first, second)._asdict().items()
    return {
        **errors,
        "iso18571": overall[1],
        **{f"iso18571_{name}": score for name, score in scores},
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
    # Of twice the weights of the trapezoidal rule
    return np.asarray(np.sqrt(np.diff(time, prepend=time[0]) + np.diff(time, append=time[-1])))


def _ratio_and_phase(time: Array, reference: Array, other: Array) -> tuple[float, float]:
    """Return sqrt(I_cc / I_mm) and the angle between the two over pi; nan where either is zero throughout.

    The angle is taken from the difference and the sum of the normalised signals (W. Kahan 2006, How futile
    are mindless assessments of roundoff, sec. 12): the arc cosine loses half of the digits of a small one.
    """
    largest_m, largest_c = maximum(reference), maximum(other)
    if largest_m == 0.0 or largest_c == 0.0:
        return np.nan, np.nan
    roots = _root_weights(time)
    # As in `rms`, squares must neither over- nor underflow.
    m, c = roots * (reference / largest_m), roots * (other / largest_c)
    norm_m, norm_c = np.linalg.norm(m), np.linalg.norm(c)
    m, c = m / norm_m, c / norm_c
    angle = 2.0 * np.arctan2(np.linalg.norm(m - c), np.linalg.norm(m + c))
    return float(norm_c / norm_m * (largest_c / largest_m)), float(angle / np.pi)


# ---- rating after ISO/TS 18571:2014, made for crash tests; here information
#
# Written from the standard's section 6, and Barbat, Fu, Zhan, Yang and Gehre (2013), ESV 13-0448.

INNER, OUTER = 0.05, 0.5  # half-widths of the corridors, as shares of the reference's largest value
MAX_SHIFT = 0.2  # share of the duration
MAX_MAGNITUDE = 0.5
MAX_SLOPE = 2.0
WARP = 0.1  # how far the time may be warped, as a share of the duration
SMOOTHED = 4  # samples on either side of the one whose slope is smoothed
MOST_POINTS = 5000
EQUAL = 1e-12  # numbers that differ by less, relatively, are equal: their sums round so


class Rating(NamedTuple):
    """Scores R, Z, E_P, E_M and E_S of `rating`, from 0 (none) to 1 (perfect)."""

    overall: float
    corridor: float
    phase: float
    magnitude: float
    slope: float


def rating(reference: Array, other: Array) -> Rating:
    """Rate C against a reference T on one uniform grid, in one unit: R = 0.4 Z + 0.2 (E_P + E_M + E_S).

    Corridor Z: the mean of ((d_o - |T - C|) / (d_o - d_i))^2, cut to [0, 1], with d_i = 0.05 max |T| and d_o
    = 0.5 max |T|. Phase E_P = 1 - n / (0.2 N): the shift by n of N samples, at most 0.2 N, at which the
    common part of both has the largest correlation coefficient; the other two scores, not below 0, are those
    of that part. Magnitude E_M = 1 - sum |C_w - T_w| / sum |T_w| / 0.5, both warped in time, by less than a
    tenth of their length, so that the sum of squared differences is least. Slope E_S = 1 - sum |C' - T'| /
    sum |T'| / 2, with derivatives smoothed over nine samples. All are nan where either is constant or has
    fewer than 10 samples.
    """
    if reference.size > MOST_POINTS:
        raise ValueError(f"{reference.size} samples; at most {MOST_POINTS} can be rated")
    if reference.size < 10 or np.ptp(reference) == 0.0 or np.ptp(other) == 0.0:
        return Rating(*[np.nan] * 5)
    # The scores are ratios: any unit will do, and one in which squares neither over- nor underflow is safe.
    unit = max(float(np.abs(reference).max()), float(np.abs(other).max()))
    reference, other = reference / unit, other / unit
    shift = best_shift(reference, other)
    kept = reference.size - abs(shift)
    first, second = reference[max(-shift, 0) :][:kept], other[max(shift, 0) :][:kept]
    largest = float(np.abs(reference).max())
    inside = (OUTER * largest - np.abs(reference - other)) / ((OUTER - INNER) * largest)
    corridor = float(np.mean(np.clip(inside, 0.0, 1.0) ** 2))
    phase = 1.0 - abs(shift) / (MAX_SHIFT * reference.size)
    magnitude = max(0.0, 1.0 - warped_difference(first, second) / MAX_MAGNITUDE)
    slopes = _slope(first), _slope(second)
    size = float(np.abs(slopes[0]).sum())
    slope_error = float(np.abs(slopes[1] - slopes[0]).sum()) / size if size > 0 else np.inf
    slope = max(0.0, 1.0 - slope_error / MAX_SLOPE)
    overall = 0.4 * corridor + 0.2 * (phase + magnitude + slope)
    return Rating(overall, corridor, phase, magnitude, slope)


def best_shift(reference: Array, other: Array) -> int:
    """Return by how many samples the other is late where both are most alike; of equal ones the smallest."""
    size, late = reference.size, np.arange(1, int(MAX_SHIFT * reference.size) + 1)
    shifts = np.concatenate([[0], np.column_stack([late, -late]).ravel()])
    count = size - np.abs(shifts)
    signals = reference - reference.mean(), other - other.mean()  # lest the sums of squares cancel
    (sum_t, square_t), (sum_c, square_c) = (
        [total[start + count] - total[start] for total in (_running(signal), _running(signal * signal))]
        for signal, start in zip(signals, (np.maximum(-shifts, 0), np.maximum(shifts, 0)), strict=True)
    )
    product = np.correlate(signals[1], signals[0], "full")[size - 1 + shifts]
    moves_t, moves_c = square_t - sum_t * sum_t / count, square_c - sum_c * sum_c / count
    moves = (moves_t > EQUAL * square_t[0]) & (moves_c > EQUAL * square_c[0])
    alike = np.full(shifts.shape, -np.inf)
    alike[moves] = (product - sum_t * sum_c / count)[moves] / np.sqrt((moves_t * moves_c)[moves])
    alike = np.minimum(alike, 1.0)  # what is above is rounding
    return int(shifts[np.flatnonzero(alike >= alike.max() - EQUAL)[0]])


def warped_difference(reference: Array, other: Array) -> float:
    """Return sum |C_w - T_w| / sum |T_w| along the warping path; infinite where the reference is zero."""
    difference, size = _warp()(reference, other, int(np.ceil(WARP * reference.size)) - 1)
    return float(difference / size) if size > 0 else float("inf")


def _running(signal: Array) -> Array:
    return np.concatenate([[0.0], np.cumsum(signal)])


def _slope(signal: Array) -> Array:
    """Return the derivative per sample, smoothed; near the ends over as many samples as fit on both sides."""
    total = _running(np.gradient(signal))
    at = np.arange(signal.size)
    half = np.minimum(SMOOTHED, np.minimum(at, signal.size - 1 - at))
    return np.asarray((total[at + half + 1] - total[at - half]) / (2 * half + 1))


@cache
def _warp() -> Callable[[Array, Array, int], tuple[float, float]]:
    """Compile the dynamic time warping; numba is imported where it is first needed."""
    from numba import njit

    try:
        compiled: Any = njit(cache=True)(_warp_sums)
        compiled(np.zeros(2), np.zeros(2), 1)  # loads or compiles it
    except Exception:  # numba's, of many kinds: no folder, one that is full, damaged files in it
        compiled = njit(_warp_sums)
    return compiled  # type: ignore[no-any-return]


def _warp_sums(reference: Array, other: Array, width: int) -> tuple[float, float]:
    """Sum |C - T| and |T| along the path of least squares, |i - j| <= width.

    Dynamic time warping after Sakoe and Chiba (1978), steps (1, 1), (1, 0) and (0, 1) of equal weight; of
    equal costs the diagonal step. Both sums are carried along with the cost: no path has to be kept. Entry
    j + 1 is that of sample j, in this row up to the one in question, from there on in the row above.
    """
    size = reference.size
    cost = np.full(size + 1, np.inf)
    difference, total = np.zeros(size + 1), np.zeros(size + 1)
    cost[0] = 0.0
    for i in range(size):
        first = max(0, i - width)
        diagonal = cost[first], difference[first], total[first]
        cost[first] = np.inf
        for j in range(first, min(size, i + width + 1)):
            best, diagonal = diagonal, (cost[j + 1], difference[j + 1], total[j + 1])
            if diagonal[0] < best[0]:
                best = diagonal
            if cost[j] < best[0]:
                best = cost[j], difference[j], total[j]
            gap = other[j] - reference[i]
            cost[j + 1] = best[0] + gap * gap
            difference[j + 1] = best[1] + abs(gap)
            total[j + 1] = best[2] + abs(reference[i])
    return difference[size], total[size]


# ---- rank of a run in an ensemble of runs, and clusters of an ensemble
#
# The statistic T of a run S is the largest |S - mean(M)| / max(std(M), u) over the samples of one channel,
# with the members M; that of a member is against the others. If S is drawn as the members are, T(S) exceeds
# all T(M_i), i = 1 ... n, about once in n + 1 draws, whatever the distribution (a permutation test;
# B. Phipson, G. K. Smyth, Stat. Appl. Genet. Mol. Biol. 9, 2010, 39). Of several channels the largest counts.

# Gap over the wider of two groups. Errors of one kind do not look like that even if they spread over six
# decades; two families of trajectories, a contact apart, do.
SEPARATION = 3.0
SMALLEST = 0.05  # share of an ensemble that makes a cluster, and not a few stragglers; two members at least


def distances(members: Array, run: Array, floor: Array) -> tuple[Array, float]:
    """Return T of one channel, for each of n >= 3 members left out, and for a run; zero without a sample.

    Shapes (n, m) and (m,). Without the floor u, shape (m,), the local errors of a solver would count.
    """
    count = members.shape[0]
    if not run.size:
        return np.zeros(count), 0.0
    centre = members.mean(axis=0)
    off = members - centre
    squares = (off**2).sum(axis=0)
    away = float((np.abs(run - centre) / np.maximum(np.sqrt(squares / count), floor)).max())
    # Without member i the mean moves by -off_i / (n - 1); the sum of squares about it follows from that.
    rest = np.maximum(squares - off**2 * (count / (count - 1)), 0.0) / (count - 1)
    left_out = np.abs(off) * (count / (count - 1)) / np.maximum(np.sqrt(rest), floor)
    return left_out.max(axis=1), away


def clustered(members: Array, floor: Array) -> BoolArray:
    """Return the samples, shape (m,), at which an ensemble, shape (n, m), falls into two clusters.

    Of at least `SMALLEST` of the members each, farther apart than `SEPARATION` times either's width and the
    floor.
    """
    count = members.shape[0]
    least = max(2, ceil(SMALLEST * count))
    if count < 2 * least:
        return np.zeros(members.shape[1], dtype=np.bool_)
    ordered = np.sort(members, axis=0)
    gaps = np.diff(ordered, axis=0)[least - 1 : count - least]
    row, column = gaps.argmax(axis=0) + least - 1, np.arange(members.shape[1])
    below, above = ordered[row, column], ordered[row + 1, column]
    width = np.maximum(below - ordered[0], ordered[-1] - above)
    return np.asarray((above - below > SEPARATION * width) & (above - below > floor))


def split(values: Array) -> BoolArray:
    """Return which of the values lie above the widest gap between them, shape (n,)."""
    ordered = np.sort(values)
    return np.asarray(values > ordered[np.diff(ordered).argmax()])
