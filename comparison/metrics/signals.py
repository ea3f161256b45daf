"""Measures of two signals on one time grid.

Times increase, in s, shape (n,), n >= 2; signals and their differences have the same shape, and two signals
one unit. No measure changes with the units but by the factor of its own.
"""

from typing import NamedTuple

import numpy as np
from scipy.ndimage import maximum_filter1d, minimum_filter1d

from comparison.metrics.iso18571 import EQUAL, MOST_POINTS, rating
from comparison.tables.channels import Array

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


def peaks(time: Array, a: Array, b: Array, zero: float = 0.0) -> tuple[tuple[float, float], ...]:
    """Return value and instant of the peak of either signal: the sample farthest from a zero.

    On the side to which the two go farther: a wave that is as high as it is deep would else have its peak
    above in one and below in the other. Of samples equally far but for round-off the first.
    """
    above = max(float(a.max()), float(b.max())) - zero
    below = zero - min(float(a.min()), float(b.min()))
    side = 1.0 if above >= (1.0 - EQUAL) * below else -1.0
    pairs = []
    for signal in (a, b):
        away = side * (signal - zero)
        farthest = int((away >= away.max() - EQUAL * abs(away.max())).argmax())
        pairs.append((float(signal[farthest]), float(time[farthest])))
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


def information(time: Array, a: Array, b: Array, *, position: bool) -> dict[str, float]:
    """Measure b against a in the usual ways; nan where a measure is undefined.

    Of a position the zero is arbitrary (the slider moves by 0.2 mm at x = -0.55 m): both are measured from
    the mean of the two. All but `peaks` are of at most 5,000 points, to which a longer table is resampled.
    """
    grid = np.linspace(time[0], time[-1], min(time.size, MOST_POINTS))
    first, second = np.interp(grid, time, a), np.interp(grid, time, b)
    zero = float(first.mean() + second.mean()) / 2 if position else 0.0
    first, second = first - zero, second - zero
    (peak_a, time_a), (peak_b, time_b) = peaks(time, a, b, zero)
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
