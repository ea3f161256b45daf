"""What the times of tables tell: missing rows, and the shift between two tables, reported, never applied."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicHermiteSpline

from comparison.tables.channels import Array, Channel, channels

SAME_GRID = 1e-9
"""Share of a sample interval by which equal times may differ: a thousand rows written with 13 digits differ
by less, with 10 by more. At 2 m/s and 0.4 ms samples it is 1e-12 m."""

_BLOCKS = 20
_WINDOW = 2048  # largest number of samples of each block
_COARSE = 4096  # points of the search over all lags
_REACH = 0.25  # searched share of the span, to either side
_ROUNDS = 20

_EVEN = 0.9  # share of equal steps from which times count as equidistant
_COVERED = 0.05  # share of the span that they then cover at least
_EQUAL = 0.1  # by which equal steps differ, as a share of the usual one: times with few digits
_RATIO = 10.0  # of a hole to the longest other step, where steps vary
_FEW = 0.01  # of the steps of such a table, at most, that can be holes

Side = Mapping[str, Array]  # channel -> values, shape (n,)


class Hole(NamedTuple):
    """Interval without rows between two times, s."""

    start: float
    end: float
    missing: int  # rows that are missing, at the table's usual interval; 0 where that is unknown


def holes(time: Array) -> list[Hole]:
    """Find the holes in increasing times, two at least; where steps vary, long and rare ones alone."""
    steps = np.diff(time)
    usual = float(np.median(steps))
    equal = np.abs(steps - usual) <= _EQUAL * usual
    missing = np.zeros(steps.shape)
    # One step may be a hole, however few there are. Not where most steps are equal because they resolve
    # contacts, between which the solver takes long ones.
    if equal.sum() >= _EVEN * (steps.size - 1) and steps[equal].sum() >= _COVERED * (time[-1] - time[0]):
        missing = np.round(steps / usual) - 1
        long = np.flatnonzero(missing >= 1)
    else:
        ordered = np.sort(steps)
        jumps = np.flatnonzero(ordered[1:] >= _RATIO * ordered[:-1])
        few = jumps.size and steps.size - 1 - jumps[-1] <= max(1, int(_FEW * steps.size))
        if steps.size < 3 or not few:
            return []
        long = np.flatnonzero(steps >= ordered[jumps[-1] + 1])
    return [Hole(float(time[n]), float(time[n + 1]), int(missing[n])) for n in long]


def isolated(time: Array, values: Array, allowed: float) -> Array:
    """Return each sample's distance from the line through its neighbours where above a limit, else 0."""
    distance = np.zeros(time.shape)
    share = (time[1:-1] - time[:-2]) / (time[2:] - time[:-2])
    line = values[:-2] + share * (values[2:] - values[:-2])
    distance[1:-1] = np.abs(values[1:-1] - line)
    return np.where(distance > allowed, distance, 0.0)


@dataclass(frozen=True)
class Shift:
    """Estimated time shift ``s`` between two tables, ``b(t) = a(t - s)``."""

    value: float = float("nan")  # s; positive: b is later. nan if it cannot be estimated
    uncertainty: float = float("nan")
    """s, half of the 95 % interval; at least the difference of times that is regarded as zero."""
    reason: str = ""  # why it cannot be estimated; else empty

    @property
    def seen(self) -> bool:
        """Whether the shift exceeds its uncertainty."""
        return abs(self.value) > self.uncertainty


def estimate(time: Array, a: Side, b: Side, known: Mapping[str, Channel] | None = None) -> Shift:
    r"""Estimate the time shift between two results on a common grid.

    From the lag with the least variance of the difference Gauss-Newton steps minimise

    .. math:: \sum_c w_c \sum_i (b_c(t_i) - a_c(t_i - s) - o_c)^2

    with a free offset :math:`o_c` and, as weight, the inverse variance of the residual of each channel. These
    are positions (velocities where there are none), since forces jump; of other mechanisms all channels. The
    uncertainty is two standard errors by the delete-one jackknife over blocks of time (Kuensch 1989),
    whatever the correlation of the differences within a block.
    """
    known = channels() if known is None else known
    group = "motion" if any(known[name].group == "motion" for name in a) else "own"
    ranges = {name: (np.ptp(a[name]), np.ptp(b[name])) for name in a if known[name].group == group}
    moving = [name for name, both in ranges.items() if min(both) >= known[name].floor]
    # Velocities almost jump at impacts; positions only have kinks.
    names = [name for name in moving if known[name].rate is not None] or moving
    if not names:
        return Shift(reason="no channel of motion is excited in both")
    if time.size < 2 * _BLOCKS:
        return Shift(reason=f"{time.size} common samples; required: at least {2 * _BLOCKS}")
    scales = {name: float(max(ranges[name])) for name in names}
    lag = _search(time, a, b, scales)
    if lag is None:
        return Shift(reason="the two are not correlated closely enough at any lag")
    edges = (np.arange(_BLOCKS + 1) * time.size // _BLOCKS).tolist()
    blocks = [slice(start, min(start + _WINDOW, stop)) for start, stop in pairwise(edges)]
    floor = np.array([np.spacing(np.abs(a[name]).max()) / scale for name, scale in scales.items()])
    weights = np.ones(len(names))
    span = float(time[-1] - time[0])
    interval = span / (time.size - 1)

    def sums_of(block: slice, lag: float) -> Array:
        """Sum 1, r, g, r g, g^2, r^2 over a block: residual and rate over scale; shape (channels, 6)."""
        at = time[block] - lag
        inside = (at >= time[0]) & (at <= time[-1])
        at = at[inside]
        if at.size < 2:
            return np.zeros((len(scales), 6))
        first, last = np.searchsorted(time, at[[0, -1]])
        near, rows = slice(max(0, first - 2), last + 3), []
        for name, scale in scales.items():
            rate, values = known[name].rate, a[name][near]
            slopes = a[rate][near] if rate is not None and rate in a else np.gradient(values, time[near])
            value, slope = hermite(time[near], values, slopes, at)
            r, g = (b[name][block][inside] - value) / scale, slope / scale
            rows.append([at.size, r.sum(), g.sum(), r @ g, g @ g, r @ r])
        return np.array(rows)

    for _ in range(_ROUNDS):
        sums = np.array([sums_of(block, lag) for block in blocks])
        step, errors = _solve(sums.sum(axis=0), weights)
        lag += step
        weights = 1.0 / np.maximum(errors, floor**2)
        if not np.isfinite(lag) or abs(step) <= 0.1 * SAME_GRID * interval:
            break
    kept = np.array([_solve(sums.sum(axis=0) - part, weights)[0] for part in sums])
    spread = float(np.sqrt((len(kept) - 1) * np.var(kept)))
    uncertainty = max(2 * spread, abs(step), SAME_GRID * interval)
    if not np.isfinite(lag) or not uncertainty < 0.05 * span:
        return Shift(reason="the motion is too uniform, or the difference too irregular")
    return Shift(float(lag), uncertainty)


def hermite(time: Array, values: Array, slopes: Array, at: Array) -> tuple[Array, Array]:
    """Return the piecewise cubic with these values and slopes at its nodes, and its derivative."""
    cubic = CubicHermiteSpline(time, values, slopes)
    return np.where(at == time[-1], values[-1], cubic(at)), cubic(at, 1)


def _search(time: Array, a: Side, b: Side, scales: Mapping[str, float]) -> float | None:
    """Return the lag (s) nearest to zero of those at which the difference varies least; None without one."""
    n = min(_COARSE, time.size)
    even = np.linspace(time[0], time[-1], n)
    reach = int(_REACH * n)
    lags = np.arange(-reach, reach + 1)
    count = n - np.abs(lags)
    cost = np.zeros(lags.size)
    total = 0.0
    for name, scale in scales.items():
        first, second = (np.interp(even, time, side[name]) / scale for side in (a, b))
        first, second = first - first.mean(), second - second.mean()
        # Correlation by the Fourier transform, zero-padded against wrap-around.
        spectrum = np.fft.rfft(second, 2 * n) * np.conj(np.fft.rfft(first, 2 * n))
        products = np.fft.irfft(spectrum, 2 * n)[lags]
        of_first, of_second = _overlap(first, lags), _overlap(second, -lags)
        squares = _overlap(first**2, lags) + _overlap(second**2, -lags) - 2 * products
        cost += squares / count - ((of_second - of_first) / count) ** 2
        total += float(np.var(first) + np.var(second)) / 2
    inner = np.flatnonzero((cost[1:-1] <= cost[:-2]) & (cost[1:-1] <= cost[2:])) + 1
    # A lag between two steps leaves an eighth of the curvature at most: without it another period of a
    # motion, one that meets a step, would seem better. Unrelated signals keep twice their variance.
    between = (cost[inner - 1] - 2 * cost[inner] + cost[inner + 1]) / 8
    good = inner[cost[inner] <= 2 * cost.min() + between + 1e-6 * total]
    if not good.size or cost[good].min() > total:
        return None
    return float(lags[good[np.abs(lags[good]).argmin()]]) * float(even[1] - even[0])


def _overlap(values: Array, lags: NDArray[np.int_]) -> Array:
    """Sum the values that overlap with the other signal: the first n - lag, or the last n + lag."""
    sums = np.concatenate([[0.0], np.cumsum(values)])
    n = values.size
    overlap: Array = np.where(lags >= 0, sums[n - np.maximum(lags, 0)], sums[n] - sums[np.maximum(-lags, 0)])
    return overlap


def _solve(sums: Array, weights: Array) -> tuple[float, Array]:
    """Return the step of the lag and the residual variance of each channel, shape (channels,)."""
    n, r, g, rg, gg, rr = sums.T
    n = np.maximum(n, 1)
    rg, gg, rr = rg - r * g / n, gg - g * g / n, rr - r * r / n
    # The residual of a uniform rate is round-off.
    gg = np.where(gg > 1e-12 * sums[:, 4], gg, 0.0)
    whole = float(weights @ gg)
    step = -float(weights @ rg) / whole if whole > 0 else float("nan")
    return step, (rr + 2 * step * rg + step * step * gg) / n
