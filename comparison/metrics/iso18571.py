"""Rating of a signal against a reference after ISO/TS 18571:2014, made for crash tests; here information.

Written from the standard's section 6, and Barbat, Fu, Zhan, Yang and Gehre (2013), ESV 13-0448.
"""

from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from comparison.tables.channels import Array

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
