"""The ideal mechanism: no freedom left, so every channel is a closed form of the crank angle."""

import math

import numpy as np

from reference_model.channels import ACCELERATIONS, MOTION, Extrema
from reference_model.energy import ENERGIES, balance
from reference_model.linkage import Array, Mechanism, ideal_motion
from reference_model.reactions import REACTIONS, reactions

MARKS = 1000
"""Instants of a cycle at which channels are looked at for their extrema."""
_TORQUE = REACTIONS.index("crank_torque")
_PIECE = 1 << 14
"""Samples that are computed at once: of a long run only what is asked for is kept."""
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(6)


def observe_ideal(m: Mechanism, names: list[str], times: Array, cycles: int) -> tuple[Array, Extrema]:
    """Return the channels at the times (s), shape (names, n), and their extrema.

    The drive's work is the integral of the torque (six Gauss points a sample interval), not a difference of
    energies, so the residual is a real check.
    """
    values, work = np.empty((len(names), times.size)), 0.0
    for first in range(0, max(1, times.size - 1), _PIECE):
        # The last sample of a piece is the first of the next: the drive's work goes on from there.
        piece = slice(first, first + _PIECE + 1)
        values[:, piece], work = _observe(m, names, times[piece], work)
    return values, _extrema(m, names, float(times[-1]), cycles)


def _extrema(m: Mechanism, names: list[str], end: float, cycles: int) -> Extrema:
    """Return the extrema of each cycle up to `end`, s: all whole ones have those of the first."""
    period = 2.0 * np.pi / abs(m.omega)
    extrema, whole = Extrema(len(names), cycles, period), int(end / period + 1e-9)
    if whole:
        extrema.values[:] = _extrema_to(m, names, period)
    if cycles > whole:
        extrema.values[whole] = _extrema_to(m, names, end - whole * period)
    extrema.values[:, :, 1::2] += period * np.arange(cycles)[:, None, None]
    return extrema


def _extrema_to(m: Mechanism, names: list[str], end: float) -> Array:
    """Return the extrema of the channels up to `end` (s) within the first cycle, shape (names, 4).

    Of the closed form at `MARKS` a cycle, and of the parabola through the least or greatest value and its
    neighbours.
    """
    interval = 2.0 * np.pi / abs(m.omega) / MARKS
    times = np.append(interval * np.arange(math.ceil(end / interval - 1e-9)), end)
    channels, _ = _observe(m, names, times, 0.0)
    rows, extrema = np.arange(len(names)), np.empty((len(names), 4))
    for column, at in ((0, channels.argmin(1)), (2, channels.argmax(1))):
        middle = np.clip(at, 1, max(times.size - 3, 1))  # the last interval may be shorter
        before, value, after = (channels[rows, np.minimum(middle + by, times.size - 1)] for by in (-1, 0, 1))
        rise, curvature = (after - before) / 2.0, after - 2.0 * value + before
        inside = (middle == at) & (np.abs(rise) < np.abs(curvature))
        by = np.divide(-rise, curvature, out=np.zeros(len(names)), where=inside)
        extrema[:, column] = np.where(inside, value + rise * by / 2.0, channels[rows, at])
        extrema[:, column + 1] = times[at] + interval * by
    return extrema


def _torque(m: Mechanism, motion: Array) -> Array:
    return reactions(m, motion, 0.0, 0.0, ideal_slider=True, journal=None)


def _observe(m: Mechanism, names: list[str], times: Array, work: float) -> tuple[Array, float]:
    """Return the channels (names, n), and the drive's work, J; `work`: that up to the first time."""
    motion = ideal_motion(m, times)
    channels = dict(zip(MOTION + ACCELERATIONS, motion[4], strict=True))
    if REACTIONS[0] in names:
        channels |= zip(REACTIONS, _torque(m, motion), strict=True)
    if ENERGIES[0] in names:
        half = np.diff(times) / 2.0
        nodes = (times[:-1] + half)[:, None] + half[:, None] * _NODES
        power = m.omega * _torque(m, ideal_motion(m, nodes.ravel()))[_TORQUE].reshape(nodes.shape)
        drive = work + np.concatenate([[0.0], np.cumsum(half * (power @ _WEIGHTS))])
        none = np.zeros(times.size)
        start = ideal_motion(m, np.zeros(1))
        energies = balance(m, motion, start, none, 0.0, np.stack([drive, none, none]), 0)
        channels |= zip(ENERGIES, energies, strict=True)
        work = float(drive[-1])
    return np.stack([channels[name] for name in names]), work
