"""Channels and extrema of the ideal mechanism: each is a closed form of the crank angle."""

import math

import numpy as np

from reference_model.balance import ENERGIES, REACTIONS, energies, reactions
from reference_model.linkage import Array, Mechanism, ideal_motion
from reference_model.results import ACCELERATIONS, MARKS, MOTION, Extrema
from reference_model.workpiece import Load, kinks, load_force

_TORQUE = REACTIONS.index("crank_torque")
_PIECE = 1 << 14
"""Number of samples that are computed at once, which bounds the memory of a long run."""
_GAUSS_POINTS, _GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(6)


def observe_ideal(
    m: Mechanism, load: Load, names: list[str], times: Array, cycles: int
) -> tuple[Array, Extrema]:
    """Return the channels at the times (s), shape (names, n), and their extrema.

    The drive's work is the integral of the torque (six Gauss points an interval between samples and kinks of
    the load), not a difference of energies, so the residual is a real check.
    """
    values, work = np.empty((len(names), times.size)), 0.0
    for first in range(0, max(1, times.size - 1), _PIECE):
        # The last sample of a piece is the first of the next: the drive's work goes on from there.
        piece = slice(first, first + _PIECE + 1)
        values[:, piece], work = _observe(m, load, names, times[piece], work)
    return values, _extrema(m, load, names, float(times[-1]), cycles)


def _extrema(m: Mechanism, load: Load, names: list[str], end: float, cycles: int) -> Extrema:
    """Return the extrema of each cycle up to `end`, s: all whole ones have those of the first."""
    period = 2.0 * np.pi / abs(m.omega)
    extrema, whole_cycles = Extrema(len(names), cycles, period), int(end / period + 1e-9)
    if whole_cycles:
        extrema.values[:] = _extrema_to(m, load, names, period)
    if cycles > whole_cycles:
        extrema.values[whole_cycles] = _extrema_to(m, load, names, end - whole_cycles * period)
    extrema.values[:, :, 1::2] += period * np.arange(cycles)[:, None, None]
    return extrema


def _extrema_to(m: Mechanism, load: Load, names: list[str], end: float) -> Array:
    """Return the extrema of the channels up to `end` (s) within the first cycle, shape (names, 4).

    The closed form is evaluated at `MARKS` a cycle, at the kinks of the load, and between the marks.
    """
    period = 2.0 * np.pi / abs(m.omega)
    extrema, interval = Extrema(len(names), 1, period), period / MARKS
    marks = np.arange(math.ceil(end / interval - 1e-9)) * np.float64(interval)
    crossings = _at_kinks(m, load, np.append(marks, end))
    times = np.union1d(np.append(marks, end), crossings)
    values, _ = _observe(m, load, names, times, 0.0)
    extrema.widen(times, values)
    if marks.size > 2:
        for channel, row in enumerate(values[:, np.searchsorted(times, marks)]):
            extrema.widen_between(channel, marks, row, crossings)
    first: Array = extrema.values[0]
    return first


def _at_kinks(m: Mechanism, load: Load, times: Array) -> Array:
    """Return the times (s), ascending, at which the slider passes a height where its load is not smooth.

    The slider must turn at most once in an interval of `times`.
    """
    heights = kinks(load)
    if not heights.size:
        return heights

    def passages(grid: Array, row: int, height: float) -> Array:
        """Return the times (s) at which a row of the slider's motion passes a value, by bisection."""
        above = ideal_motion(m, grid)[4, row] > height
        i = np.flatnonzero(above[:-1] != above[1:])
        lo, hi, first = grid[i], grid[i + 1], above[i]
        for _ in range(60):
            middle = 0.5 * (lo + hi)
            before = (ideal_motion(m, middle)[4, row] > height) == first
            lo, hi = np.where(before, middle, lo), np.where(before, hi, middle)
        return hi

    grid = np.union1d(times, passages(times, 4, 0.0))
    return np.unique(np.concatenate([passages(grid, 1, height) for height in heights]))


def _smooth_between(m: Mechanism, load: Load, times: Array) -> Array:
    """Return the times (s), and others between them, such that the torque is smooth from one to the next.

    A power law begins as a power of time, so the intervals halve towards the instant at which it begins.
    """
    crossings = _at_kinks(m, load, times)
    if crossings.size and not load.depths.size:
        interval = float(np.diff(times).max())
        shifts = interval * 0.5 ** np.arange(30)
        crossings = np.concatenate(
            [crossings, np.add.outer(crossings, shifts).ravel(), np.subtract.outer(crossings, shifts).ravel()]
        )
        crossings = crossings[(crossings > times[0]) & (crossings < times[-1])]
    return np.union1d(times, crossings) if crossings.size else times


def _reactions(m: Mechanism, load: Load, motion: Array) -> Array:
    return reactions(m, motion, 0.0, load_force(load, motion[4, 1]), ideal_slider=True, journal=None)


def _observe(m: Mechanism, load: Load, names: list[str], times: Array, work: float) -> tuple[Array, float]:
    """Return the channels, shape (names, n), and the drive's work (J), `work` up to the first time."""
    motion = ideal_motion(m, times)
    channels = dict(zip(MOTION + ACCELERATIONS, motion[4], strict=True))
    if REACTIONS[0] in names:
        channels |= zip(REACTIONS, _reactions(m, load, motion), strict=True)
    if ENERGIES[0] in names:
        ends = _smooth_between(m, load, times)
        half_widths = np.diff(ends) / 2.0
        nodes = (ends[:-1] + half_widths)[:, None] + half_widths[:, None] * _GAUSS_POINTS
        power = m.omega * _reactions(m, load, ideal_motion(m, nodes.ravel()))[_TORQUE].reshape(nodes.shape)
        drive = work + np.concatenate([[0.0], np.cumsum(half_widths * (power @ _GAUSS_WEIGHTS))])
        drive = drive[np.searchsorted(ends, times)]
        zeros = np.zeros(times.size)
        start = ideal_motion(m, np.zeros(1))
        works = np.stack([drive, zeros, zeros])
        balance = energies(m, load, motion, start, (zeros, 0.0), works, 0)
        channels |= zip(ENERGIES, balance, strict=True)
        work = float(drive[-1])
    return np.stack([channels[name] for name in names]), work
