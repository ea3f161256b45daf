"""Errors of the slider against the ideal mechanism: actual - ideal at equal time, and their peaks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from comparison.tables.arrays import Array, BoolArray
from comparison.tables.table import Table


@dataclass(frozen=True)
class Peak:
    """An error of largest size."""

    value: float
    """Signed."""
    time: float
    """s."""


def error(actual: Table, ideal: Table, channel: str) -> Array:
    """Return actual - ideal of a channel, shape (n,).

    Raises
    ------
    ValueError
        If the two have not the same times.
    """
    if not np.allclose(actual.time, ideal.time, rtol=0, atol=1e-9):
        raise ValueError("the ideal run has other times")
    return actual.values(channel) - ideal.values(channel)


def peak(time: Array, values: Array, within: BoolArray) -> Peak:
    """Return the sample of largest size among those where ``within`` holds; arrays of shape (n,)."""
    part = np.flatnonzero(within)
    at = part[np.abs(values[part]).argmax()]
    return Peak(float(values[at]), float(time[at]))


def largest(actual: Table, ideal: Table, channel: str, within: BoolArray) -> Peak:
    """Return the error of largest size among the samples and at the channel's own extrema.

    The extrema are those over the integration steps: a peak between two samples counts. Its error is taken
    against the ideal motion between samples, which is smooth.

    Raises
    ------
    ValueError
        As `error`.
    """
    best = peak(actual.time, error(actual, ideal, channel), within)
    inside = actual.time[within]
    extremes = actual.extrema.get(channel, {})
    for end in ("min", "max"):
        time = extremes.get(f"time_of_{end}", -1.0)
        if inside[0] <= time <= inside[-1]:
            there = extremes[end] - float(np.interp(time, ideal.time, ideal.values(channel)))
            best = max(best, Peak(there, time), key=lambda each: abs(each.value))
    return best


def second_cycle(time: Array, period: float) -> BoolArray:
    """Return where the time is in [T, 2T], up to its rounding: there the paper takes its peaks."""
    slack = 1e-9 * period
    return (time >= period - slack) & (time <= 2 * period + slack)


def shift_bound(radial: tuple[Array, Array], turned: tuple[Array, Array], step: float, reach: float) -> Array:
    """Return how far the slider moves at most when the crank pin moves by ``reach``, m, shape (n,).

    The gradient of the slider's position in the pin's, from central differences of an ideal mechanism, times
    the reach: to first order, as a rigid link in place of the clearance would do it.

    Parameters
    ----------
    radial
        Slider positions (m) with a crank longer and shorter by ``step``.
    turned
        The same with the crank pin ahead and behind by ``step`` along its circle.
    step, reach
        m.
    """
    along, across = ((ahead - behind) / (2 * step) for ahead, behind in (radial, turned))
    return np.asarray(reach * np.hypot(along, across))
