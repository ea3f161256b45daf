"""Norms of a difference: pure functions on arrays.

All are invariant under a change of unit: scaling difference and scale by one factor scales the first two
results by it and leaves the others.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from comparison.tables.arrays import Array


def maximum(difference: Array) -> float:
    r"""Largest absolute value, :math:`\max_i |E_i|` (the infinity norm); in the unit of the difference.

    Parameters
    ----------
    difference
        Shape (n,), n >= 1.
    """
    return float(np.abs(difference).max())


def rms(time: Array, difference: Array) -> float:
    r"""Root mean square over time, :math:`\sqrt{\sum_i w_i E_i^2 / \sum_i w_i}`; in the difference's unit.

    The weight of a sample is the mean distance to its neighbours: samples that a program puts closer
    together, at contacts say, count no more than others. The largest value is taken out before squaring, so
    that neither overflow nor underflow changes the result with the unit (as in LAPACK's dnrm2).

    Parameters
    ----------
    time
        Increasing, shape (n,), n >= 2.
    difference
        Shape (n,).
    """
    largest = maximum(difference)
    if largest == 0.0:
        return 0.0
    return largest * float(np.sqrt(np.average(np.square(difference / largest), weights=np.gradient(time))))


def scaled(value: float, scale: float) -> float:
    """Value over the channel's scale, a pure number; nan where the scale is zero, i.e. nothing to measure by.

    Parameters
    ----------
    value, scale
        In one unit; scale >= 0.
    """
    return value / scale if scale > 0 else float("nan")


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

    with the reference m, the other signal c and integrals by the trapezoidal rule on the time grid. The angle
    is taken from the difference and the sum of the normalised signals (Kahan 2006, How futile are mindless
    assessments of roundoff, sec. 12): the arc cosine loses half of the digits of a small one.

    Parameters
    ----------
    time
        Increasing, shape (n,), n >= 2.
    reference, other
        In one unit, shape (n,).

    Returns
    -------
    errors
        All nan where either signal is zero throughout: they are undefined, and whoever shows them says so.

    Notes
    -----
    Formulas of Sprague and Geers (2004), A spectral-element method for modelling cavitation in transient
    fluid-structure interaction, IJNME 60, 2467-2499; discussed by Schwer (2007), Validation metrics for
    response histories, Engineering with Computers 23, 295-309. Exchanging the two leaves P and turns 1 + M
    into its inverse. A constant that is large against what changes hides it: subtract it first.
    """
    largest_m, largest_c = maximum(reference), maximum(other)
    if largest_m == 0.0 or largest_c == 0.0:
        return SpragueGeers(np.nan, np.nan, np.nan)
    root_weights = np.sqrt(np.diff(time, prepend=time[0]) + np.diff(time, append=time[-1]))
    # As in `rms`, squares must neither over- nor underflow.
    m, c = root_weights * (reference / largest_m), root_weights * (other / largest_c)
    norm_m, norm_c = np.linalg.norm(m), np.linalg.norm(c)
    magnitude = float(norm_c / norm_m * (largest_c / largest_m) - 1.0)
    m, c = m / norm_m, c / norm_c
    phase = float(2.0 * np.arctan2(np.linalg.norm(m - c), np.linalg.norm(m + c)) / np.pi)
    return SpragueGeers(magnitude, phase, float(np.hypot(magnitude, phase)))


TUBE = 0.002  # the default of csv-compare


def tube_share(time: Array, reference: Array, other: Array, width: float = TUBE) -> float:
    r"""Share of the samples that lie in a tube around the reference; information, never a gate.

    The reference is widened by a rectangle of half-width ``width`` of its duration and half-height ``width``
    of its range R:

    .. math::

        \min_{|s - t| \le w} m(s) - w R \; \le \; c(t) \; \le \; \max_{|s - t| \le w} m(s) + w R

    the rule of csv-compare (Modelica Association) and funnel (Lawrence Berkeley National Laboratory), with
    straight lines between the samples of m, at the samples of c. It tolerates every peak shorter than the
    width of the tube: **a contact force that is missing altogether, zero at all times, is inside**, for a
    contact lasts 0.2 ms and 0.002 of two crank cycles at 150 rpm are 1.6 ms. Therefore no verdict depends on
    it.

    Parameters
    ----------
    time
        Uniform, shape (n,), n >= 2.
    reference, other
        In one unit, shape (n,).
    width
        Half-width and half-height of the rectangle, as shares.

    Returns
    -------
    share
        0 to 1. Exchanging the two changes it.
    """
    half = int(width * (reference.size - 1) + 1e-9)  # 0.002 of 500 is a sample, whichever way it rounds
    height, reach = width * float(np.ptp(reference)), width * float(time[-1] - time[0])
    ends = [np.interp(time + side * reach, time, reference) for side in (-1.0, 1.0)]
    windows = np.lib.stride_tricks.sliding_window_view(np.pad(reference, half, mode="edge"), 2 * half + 1)
    low = np.min([windows.min(axis=1), *ends], axis=0) - height
    high = np.max([windows.max(axis=1), *ends], axis=0) + height
    return float(np.mean((other >= low) & (other <= high)))


def resampled(time: Array, signals: tuple[Array, ...], points: int) -> tuple[Array, tuple[Array, ...]]:
    """Return times and signals on a uniform grid, at most so many points, linearly interpolated.

    Plain resampling, no filter: what is shorter than an interval is met or missed by chance.

    Parameters
    ----------
    time
        Increasing, s, shape (n,), n >= 2.
    signals
        Each of shape (n,).
    points
        At least 2; a signal that has fewer keeps its number.
    """
    grid = np.linspace(time[0], time[-1], min(time.size, points))
    return grid, tuple(np.interp(grid, time, signal) for signal in signals)
