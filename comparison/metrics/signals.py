"""Measures of two signals on one time grid.

Times increase, in s, shape (n,), n >= 2; signals and their differences have the same shape, and two signals
one unit. No measure changes with the units but by the factor of its own.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from comparison.metrics.iso18571 import EQUAL, MOST_POINTS, rating
from comparison.tables.arrays import Array

TUBE = 0.002
"""The default width of csv-compare."""


def maximum(difference: Array) -> float:
    r"""Largest absolute value, :math:`\max_i |E_i|` (the infinity norm); in the difference's unit."""
    return float(np.abs(difference).max())


def rms(time: Array, difference: Array) -> float:
    r"""Root mean square over time, :math:`\sqrt{\sum_i w_i E_i^2 / \sum_i w_i}`; in the difference's unit.

    The weight of a sample is the mean distance to its neighbours: samples that a program puts closer
    together, at contacts say, count no more than others. The largest value is taken out before squaring, so
    that neither overflow nor underflow changes the result with the unit (as in LAPACK's dnrm2).
    """
    largest = maximum(difference)
    if largest == 0.0:
        return 0.0
    return largest * float(np.sqrt(np.average(np.square(difference / largest), weights=np.gradient(time))))


def scaled(value: float, scale: float) -> float:
    """Value over the channel's scale (>= 0, in one unit); nan where that is zero: nothing to measure by."""
    return value / scale if scale > 0 else float("nan")


def peaks(time: Array, a: Array, b: Array, zero: float = 0.0) -> tuple[tuple[float, float], ...]:
    r"""Return value and instant of the peak of either signal.

    The sample farthest from a zero, of both signals on the side to which the two go farther: else a wave that
    is as high as it is deep would have its peak above in one and below in the other. Of samples equally far
    but for round-off, as in the periods of a steady motion, the first. What lies between samples is not seen:
    peaks of contacts are those of `comparison.metrics.contacts`.
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
    r"""Pearson's correlation coefficient over time, without any shift of one against the other.

    .. math::

        r = \frac{\int (a - \bar a)(b - \bar b) \, dt}
                 {\sqrt{\int (a - \bar a)^2 \, dt \int (b - \bar b)^2 \, dt}}

    with means over time and all integrals by the trapezoidal rule. It sees neither offset nor amplitude: 1
    for any b = p a + q with p > 0, -1 with p < 0. Exchanging the signals leaves it; it is nan where either is
    constant. K. Pearson (1895), Proc. R. Soc. Lond. 58, 240-242.
    """
    if np.ptp(a) == 0.0 or np.ptp(b) == 0.0:
        return float("nan")
    roots = _root_weights(time)
    directions = []
    for signal in (a, b):
        signal = signal / maximum(signal)  # squares must neither over- nor underflow
        moving = roots * (signal - np.average(signal, weights=roots**2))
        directions.append(moving / np.linalg.norm(moving))
    return float(np.clip(directions[0] @ directions[1], -1.0, 1.0))


class SpragueGeers(NamedTuple):
    """Errors of a signal against a reference; pure numbers, 0 for equal signals."""

    magnitude: float
    """M: how much larger; +0.1 for 1.1 times the reference, whatever its phase."""
    phase: float
    """P: angle between the two over pi, 0 to 1; whatever their magnitudes."""
    combined: float
    """C."""


def sprague_geers(time: Array, reference: Array, other: Array) -> SpragueGeers:
    r"""Magnitude, phase and combined error after Sprague and Geers.

    .. math::

        M = \sqrt{I_{cc} / I_{mm}} - 1, \quad P = \arccos(I_{mc} / \sqrt{I_{mm} I_{cc}}) / \pi, \quad
        C = \sqrt{M^2 + P^2}, \quad I_{ab} = \int a b \, dt

    with the reference m, the other signal c and integrals by the trapezoidal rule; nan where either signal is
    zero throughout. Exchanging the two leaves P and turns 1 + M into its inverse. A constant that is large
    against what changes hides it: subtract it first.

    Notes
    -----
    M. A. Sprague, T. L. Geers (2004), A spectral-element method for modelling cavitation in transient
    fluid-structure interaction, Int. J. Numer. Methods Eng. 60, 2467-2499; discussed by L. E. Schwer (2007),
    Validation metrics for response histories, Eng. Comput. 23, 295-309.
    """
    ratio, phase = _ratio_and_phase(time, reference, other)
    magnitude = ratio - 1.0
    return SpragueGeers(magnitude, phase, float(np.hypot(magnitude, phase)))


class Russell(NamedTuple):
    """Errors of a signal against another; pure numbers, 0 for equal signals."""

    magnitude: float
    """R_M: 0.1 for 1.14 times the reference, -0.1 for its 1.14th part; grows with the logarithm."""
    phase: float
    """R_P: angle between the two over pi, 0 to 1."""
    comprehensive: float
    """R_C: up to 0.15 called excellent, above 0.28 poor."""


def russell(time: Array, reference: Array, other: Array) -> Russell:
    r"""Magnitude, phase and comprehensive error after Russell.

    .. math::

        m = \frac{I_{cc} - I_{mm}}{\sqrt{I_{mm} I_{cc}}}, \quad
        R_M = \operatorname{sign}(m) \log_{10}(1 + |m|), \quad
        R_P = \frac{1}{\pi} \arccos \frac{I_{mc}}{\sqrt{I_{mm} I_{cc}}}, \quad
        R_C = \sqrt{\frac{\pi}{4} (R_M^2 + R_P^2)}

    with the integrals of `sprague_geers`, whose phase error this is too. Exchanging the two turns the sign of
    the magnitude error and leaves the others: neither signal has to be the reference.

    Notes
    -----
    D. M. Russell (1997), Error measures for comparing transient data: I, Development of a comprehensive error
    measure; II, Error measures case study, Proc. 68th Shock and Vibration Symposium. The classes are those of
    the second part.
    """
    ratio, phase = _ratio_and_phase(time, reference, other)
    with np.errstate(divide="ignore"):
        excess = ratio - np.divide(1.0, ratio)
    magnitude = float(np.copysign(np.log10(1.0 + np.abs(excess)), excess))
    return Russell(magnitude, phase, float(np.sqrt(np.pi / 4.0) * np.hypot(magnitude, phase)))


def tube_share(time: Array, reference: Array, other: Array, width: float = TUBE) -> float:
    r"""Share of the samples that lie in a tube around the reference; alone a poor gate.

    The reference is widened by a rectangle of half-width ``width`` of its duration and half-height ``width``
    of its range R:

    .. math::

        \min_{|s - t| \le w} m(s) - w R \; \le \; c(t) \; \le \; \max_{|s - t| \le w} m(s) + w R

    the rule of csv-compare (Modelica Association) and funnel (Lawrence Berkeley National Laboratory), with
    straight lines between the samples of m, at the samples of c. It tolerates every peak shorter than the
    width of the tube: **a contact force that is missing altogether, zero at all times, is inside**, for a
    contact lasts 0.2 ms and 0.002 of two crank cycles at 150 rpm are 1.6 ms. Times must be uniform.
    Exchanging the signals changes the share.
    """
    half = int(width * (reference.size - 1) + 1e-9)  # 0.002 of 500 is a sample, whichever way it rounds
    height, reach = width * float(np.ptp(reference)), width * float(time[-1] - time[0])
    ends = [np.interp(time + side * reach, time, reference) for side in (-1.0, 1.0)]
    windows = np.lib.stride_tricks.sliding_window_view(np.pad(reference, half, mode="edge"), 2 * half + 1)
    low = np.min([windows.min(axis=1), *ends], axis=0) - height
    high = np.max([windows.max(axis=1), *ends], axis=0) + height
    return float(np.mean((other >= low) & (other <= high)))


def tube_distance(time: Array, a: Array, b: Array, reach: float) -> Array:
    r"""Return the distance of two signals of which either may be early or late, shape (n,).

    Each is held against the range of the other within ``reach`` (s) to either side, with straight lines
    between samples, and the larger distance counts,

    .. math::

        d(t) = \max\bigl(\mathrm{dist}(a(t), b([t - w, t + w])), \mathrm{dist}(b(t), a([t - w, t + w]))\bigr):

    a peak that one of them lacks altogether is as far away as it is high, though the other one's samples are
    within the range of its flanks. Exchanging the signals changes nothing.
    """
    return np.maximum(_beyond_range(time, a, b, reach), _beyond_range(time, b, a, reach))


def _beyond_range(time: Array, values: Array, other: Array, reach: float) -> Array:
    """Return how far values lie outside the range of another signal within the reach, shape (n,).

    The other one is continued beyond its ends as it goes there.
    """
    steps = np.diff(other) / np.diff(time)
    edges = time[0] - reach, time[-1] + reach
    long = np.concatenate([[edges[0]], time, [edges[1]]])
    other = np.concatenate([[other[0] - steps[0] * reach], other, [other[-1] + steps[-1] * reach]])
    windows = np.column_stack(
        [np.searchsorted(long, time - reach), np.searchsorted(long, time + reach, side="right")]
    ).ravel()
    # An index past the end ends the last window; what lies between two windows is not used.
    padded = np.append(other, other[-1])
    ends = [np.interp(time + side * reach, long, other) for side in (-1.0, 1.0)]
    low = np.min([np.minimum.reduceat(padded, windows)[::2], *ends], axis=0)
    high = np.max([np.maximum.reduceat(padded, windows)[::2], *ends], axis=0)
    beyond: Array = np.maximum(np.maximum(low - values, values - high), 0.0)
    return beyond


def resampled(time: Array, signals: tuple[Array, ...], points: int) -> tuple[Array, tuple[Array, ...]]:
    """Return times and signals on a uniform grid, linearly interpolated, of at most so many points (>= 2).

    There is no filter: what is shorter than an interval is met or missed by chance.
    """
    grid = np.linspace(time[0], time[-1], min(time.size, points))
    return grid, tuple(np.interp(grid, time, signal) for signal in signals)


def information(time: Array, a: Array, b: Array, *, position: bool) -> dict[str, float]:
    """Measure b against a in the usual ways, for information.

    Parameters
    ----------
    time, a, b
        Times and signals.
    position
        Whether the channel is a position: its zero is arbitrary (the slider moves by 0.2 mm at x = -0.55 m),
        so both are measured from the mean of the two. Forces, rates and gaps have a zero of their own.

    Returns
    -------
    measures
        `sprague_geers`, `russell`, the scores of `comparison.metrics.iso18571.rating`, `tube_share` and
        `correlation`, on at most 5,000 points; `peaks` of either signal and b's less a's, on all samples. nan
        where one is undefined. All pure numbers, but peaks in the channel's unit and their times in s.

    Notes
    -----
    A longer table is resampled without a filter, so that some impacts shorter than the new interval are
    missed: for force channels these measures are of little use. They are those of the samples: of impacts the
    scores change by some percent with the sampling, whose nine samples smooth the slope.
    """
    grid, (first, second) = resampled(time, (a, b), MOST_POINTS)
    zero = float(first.mean() + second.mean()) / 2 if position else 0.0
    first, second = first - zero, second - zero
    (peak_a, time_a), (peak_b, time_b) = peaks(time, a, b, zero)
    geers, russells = sprague_geers(grid, first, second), russell(grid, first, second)
    scores = rating(first, second)
    return {
        "sprague_geers_magnitude": geers.magnitude,
        "sprague_geers_phase": geers.phase,
        "sprague_geers_combined": geers.combined,
        "russell_magnitude": russells.magnitude,
        "russell_phase": russells.phase,
        "russell_comprehensive": russells.comprehensive,
        "iso18571": scores.overall,
        "iso18571_corridor": scores.corridor,
        "iso18571_phase": scores.phase,
        "iso18571_magnitude": scores.magnitude,
        "iso18571_slope": scores.slope,
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
