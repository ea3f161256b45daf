"""The ideal mechanism: no freedom left, so every channel is a closed form of the crank angle.

Computed for all samples at once, from the kernels' sources but without the compiler, whose import takes
longer than all of it.
"""

import math

import numpy as np

from reference_model.bodies import ideal_motion
from reference_model.compiled import over_arrays
from reference_model.constants import Constants
from reference_model.energy import height_energy, kinetic_energy
from reference_model.forces import Array
from reference_model.observation import (
    CHANNELS,
    ENERGIES_FROM,
    REACTIONS_FROM,
    WITH_ENERGY,
    WITH_JOINTS,
)
from reference_model.reactions import REACTIONS, reactions
from reference_model.recording import MARKS, Samples

_TORQUE = REACTIONS.index("crank_torque")
_PIECE = 1 << 14
"""Samples that are computed at once: of a long run only what is asked for is kept."""
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(6)


def _reactions(c: Constants, motion: Array, out: Array) -> None:
    over_arrays(reactions)(c, motion, 0.0, 0.0, True, True, (0.0, 0.0, 0.0, 0.0), out)


def _stored(c: Constants, motion: Array) -> tuple[Array, Array]:
    """Return kinetic and potential energy, J, shape (n,) each."""
    kinetic, height = over_arrays(kinetic_energy), over_arrays(height_energy)
    return np.asarray(kinetic(c, motion, 0, 5)), np.asarray(height(c, motion, 0, 5))


def observe_ideal(c: Constants, samples: Samples) -> Array:
    """Fill the samples and return the extrema of each cycle, as in `Progress.extrema`.

    The drive's work is the integral of the torque (six Gauss points a sample interval), not a difference of
    energies, so the residual is a real check.
    """
    work = 0.0
    for first in range(0, max(1, samples.times.size - 1), _PIECE):
        # The last sample of a piece is the first of the next: the drive's work goes on from there.
        times = samples.times[first : first + _PIECE + 1]
        channels = _observe(c, times, samples.what, work)
        work = channels[ENERGIES_FROM, -1]
        samples.values[:, first : first + times.size] = channels[samples.wanted]
    return _extrema(c, samples.what, float(samples.times[-1]))


def _extrema(c: Constants, what: int, end: float) -> Array:
    """Return the extrema of each cycle up to `end`, s: all whole ones have those of the first."""
    period = 2.0 * np.pi / abs(c.omega)
    whole, count = int(end / period + 1e-9), max(1, math.ceil(end / period - 1e-9))
    found = np.empty((count, CHANNELS, 4))
    if whole:
        found[:] = _extrema_to(c, what, period)
    if count > whole:
        found[whole] = _extrema_to(c, what, end - whole * period)
    found[:, :, 1::2] += period * np.arange(count)[:, None, None]
    return found


def _extrema_to(c: Constants, what: int, end: float) -> Array:
    """Return the extrema of the channels up to `end` (s) within the first cycle, shape (CHANNELS, 4).

    Of the closed form at `MARKS` a cycle, and of the parabola through the least or greatest value and its
    neighbours.
    """
    interval = 2.0 * np.pi / abs(c.omega) / MARKS
    times = np.append(interval * np.arange(math.ceil(end / interval - 1e-9)), end)
    channels, rows, found = _observe(c, times, what, 0.0), np.arange(CHANNELS), np.empty((CHANNELS, 4))
    for column, at in ((0, channels.argmin(1)), (2, channels.argmax(1))):
        middle = np.clip(at, 1, max(times.size - 3, 1))  # the last interval may be shorter
        before, value, after = (channels[rows, np.minimum(middle + by, times.size - 1)] for by in (-1, 0, 1))
        rise, curvature = (after - before) / 2.0, after - 2.0 * value + before
        inside = (middle == at) & (np.abs(rise) < np.abs(curvature))
        by = np.divide(-rise, curvature, out=np.zeros(CHANNELS), where=inside)
        found[:, column] = np.where(inside, value + rise * by / 2.0, channels[rows, at])
        found[:, column + 1] = times[at] + interval * by
    return found


def _observe(c: Constants, times: Array, what: int, work: float) -> Array:
    """Return all channels, shape (CHANNELS, n); those not asked for are zero.

    `work`: the drive's, J, up to the first of `times`.
    """
    motion = ideal_motion(c, times)
    out = np.zeros((CHANNELS, times.size))
    out[:9] = motion[4]
    if what & WITH_JOINTS:
        _reactions(c, motion, out[REACTIONS_FROM:ENERGIES_FROM])
    if what & WITH_ENERGY:
        half = np.diff(times) / 2.0
        nodes = (times[:-1] + half)[:, None] + half[:, None] * _NODES
        forces = np.empty((len(REACTIONS), nodes.size))
        _reactions(c, ideal_motion(c, nodes.ravel()), forces)
        power = c.omega * forces[_TORQUE].reshape(nodes.shape)
        drive = work + np.concatenate([[0.0], np.cumsum(half * (power @ _WEIGHTS))])
        kinetic, height = _stored(c, motion)
        kinetic_at_start, height_at_start = _stored(c, ideal_motion(c, np.zeros(1)))
        gravity = height_at_start - height
        energies = out[ENERGIES_FROM:]
        energies[0], energies[1], energies[2] = drive, gravity, kinetic
        energies[6] = drive + gravity - (kinetic - kinetic_at_start)
    return out
