"""The ideal mechanism: no freedom left, so every channel is a closed form of the crank angle."""

import numpy as np

from reference_model.bodies import ideal_motion
from reference_model.compiled import kernel
from reference_model.energy import height_energy, kinetic_energy
from reference_model.forces import Array
from reference_model.observation import (
    CHANNELS,
    ENERGIES_FROM,
    REACTIONS_FROM,
    WITH_ENERGY,
    WITH_JOINTS,
)
from reference_model.parameters import Constants
from reference_model.reactions import REACTIONS, reactions

_TORQUE = REACTIONS.index("crank_torque")
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(6)


@kernel
def _observe_ideal(c: Constants, motion: Array, out: Array) -> None:
    for i in range(motion.shape[0]):
        reactions(c, motion[i], 0.0, 0.0, True, True, (0.0, 0.0, 0.0, 0.0), out[i])


@kernel
def _stored(c: Constants, motion: Array, out: Array) -> None:
    for i in range(motion.shape[0]):
        out[0, i], out[1, i] = kinetic_energy(c, motion[i], 0, 5), height_energy(c, motion[i], 0, 5)


def observe_ideal(c: Constants, times: Array, what: int) -> Array:
    """Return all channels at all times, shape (n, CHANNELS); those not asked for are zero.

    The drive's work is the integral of the torque (six Gauss points a sample interval), not a difference of
    energies, so the residual is a real check.
    """
    motion = ideal_motion(c, times)
    out = np.zeros((times.size, CHANNELS))
    out[:, :9] = motion[:, 4]
    if what & WITH_JOINTS:
        _observe_ideal(c, motion, out[:, REACTIONS_FROM:ENERGIES_FROM])
    if what & WITH_ENERGY:
        half = np.diff(times) / 2.0
        nodes = (times[:-1] + half)[:, None] + half[:, None] * _NODES
        forces = np.empty((nodes.size, len(REACTIONS)))
        _observe_ideal(c, ideal_motion(c, nodes.ravel()), forces)
        power = c.omega * forces[:, _TORQUE].reshape(nodes.shape)
        drive = np.concatenate([[0.0], np.cumsum(half * (power @ _WEIGHTS))])
        stored = np.empty((2, times.size))
        _stored(c, motion, stored)
        gravity = stored[1, 0] - stored[1]
        energies = out[:, ENERGIES_FROM:]
        energies[:, 0], energies[:, 1], energies[:, 2] = drive, gravity, stored[0]
        energies[:, 6] = drive + gravity - (stored[0] - stored[0, 0])
    return out
