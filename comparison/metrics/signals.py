"""Measures of two signals on one time grid, their linear relation, and a run against an ensemble of runs.

Times increase, in s, shape (n,), n >= 2; signals and their differences have the same shape, and two signals
one unit. A change of units only scales a measure that has one.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf, nan

import numpy as np
from scipy.ndimage import maximum_filter1d, minimum_filter1d

from comparison.tables.channels import Array, BoolArray

TUBE = 0.002  # the default width of csv-compare
EQUAL = 1e-12  # numbers that differ by less, relatively, are equal: their sums round so


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

    It is on the side to which the two go farther: a wave that is as high as it is deep would else have its
    peak above in one and below in the other. Of samples equally far, to round-off, the first counts.
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


def measures(
    time: Array, a: Array, b: Array, *, position: bool, between: Between = ((), ())
) -> dict[str, float]:
    """Return the usual measures of b against a; nan where one is undefined.

    The zero of a position is arbitrary (the slider moves by 0.2 mm at x = -0.55 m): its peak is measured from
    the mean of the two. Correlation and tube use as many samples at uniform times.
    """
    grid = np.linspace(time[0], time[-1], time.size)
    first, second = np.interp(grid, time, a), np.interp(grid, time, b)
    zero = float(first.mean() + second.mean()) / 2 if position else 0.0
    (peak_a, time_a), (peak_b, time_b) = peaks(time, a, b, zero, between)
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
    """Return T of one channel, for each of n >= 3 members left out, and for a run; zero without a sample.

    Members have shape (n, m), run and floor u (m,). Without the floor a solver's local errors would count.
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

    Errors are those of the delete-one jackknife over blocks of the samples, whatever the correlation of the
    remainder within a block, plus the rounding of the numbers.
    """
    if scaled and not a.any():
        return Fit(nan, nan, nan, nan, inf)
    design = np.column_stack([a] * scaled + [np.ones(a.size)] * moved)
    target = b if scaled else b - a
    count = min(_BLOCKS, a.size)
    blocks = np.arange(a.size) * count // a.size

    def solved(kept: BoolArray) -> Array:
        return np.asarray(np.linalg.lstsq(design[kept], target[kept], rcond=None)[0], dtype=np.float64)

    whole = solved(np.ones(a.shape, dtype=np.bool_))
    parts = np.array([solved(blocks != n) for n in range(count)])
    rounding = 4 * np.spacing(max(np.abs(a).max(), np.abs(b).max()))
    errors = 2 * np.sqrt((count - 1) * np.var(parts, axis=0))
    errors += rounding / np.sqrt(np.mean(design**2, axis=0))
    before, after = (float(np.sqrt(np.mean(rest**2))) for rest in (b - a, target - design @ whole))
    ratio, ratio_error = (float(whole[0]), float(errors[0])) if scaled else (1.0, 0.0)
    offset, offset_error = (float(whole[-1]), float(errors[-1])) if moved else (0.0, 0.0)
    return Fit(ratio, offset, ratio_error, offset_error, after / before if before else nan)
