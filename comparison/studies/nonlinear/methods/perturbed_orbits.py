"""Neighbours of an orbit that are brought back to a small distance again and again.

Two neighbouring states are integrated, the logarithm of the growth of their distance is recorded, and the
perturbed one is rescaled along its direction to the initial distance (G. Benettin, L. Galgani, A. Giorgilli
and J.-M. Strelcyn, Meccanica 15 (1980) 9-30, Part 2). A period of the drive consists of *stages*, and the
perturbed orbits are rescaled after each: a whole period takes them from round-off to the size of the
attractor and back, a part of it does not.

A computed state has an error of its own. The divergence due to it alone is that of one more perturbed orbit,
which starts every stage at round-off from the first state: along the same orbit, with the same growth. A
perturbed orbit that has not come `CLEAR` times as far as that one is *collapsed*: its distance is error and
not motion. Its growth is then unknown, only bounded from above, and it starts the next stage in the direction
it had before.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from comparison.tables.arrays import Array

CLEAR = 10.0
"""Times the error: there it changes the logarithm by at most 0.1."""

Orbit = Callable[[Array, int], tuple[Array, int]]
"""State and when -> state and when at the end of a stage."""
Perturbed = Callable[[Array, int, int], Array]
"""State, when, until when -> state."""


@dataclass(frozen=True)
class PerturbedOrbits:
    """Perturbed orbits at m distances over n stages."""

    distances: Array
    """d0, shape (m,)."""
    times: NDArray[np.int64]
    """When a stage begins and ends, counted as `Orbit` does, shape (n, 2)."""
    logs: Array
    """ln(d1 / d0), shape (m, n); of a collapsed stage its upper bound."""
    collapsed: NDArray[np.bool_]
    """Whether d1 is no more than error, shape (m, n)."""
    noise: Array
    """Final distance of the perturbed orbit that starts at round-off, shape (n,)."""


def follow(
    orbit: Orbit,
    perturbed: Perturbed,
    start: Array,
    when: int,
    until: int,
    *,
    distances: Array,
    round_off: float,
    scale: Array,
) -> PerturbedOrbits:
    """Follow an orbit with its perturbed orbits.

    Parameters
    ----------
    orbit
        Takes the first state over a stage, which it chooses.
    perturbed
        Takes a perturbed state over a stage; for the same state it must give the same as ``orbit``.
    start
        The first state, shape (k,).
    when, until
        When it is; stages begin before ``until``.
    distances
        d0 of each perturbed orbit, in the unit of ``scale`` times state, shape (m,).
    round_off
        Initial distance, in that unit, of the perturbed orbit that shows the error.
    scale
        What each coordinate is multiplied with before distances are taken, shape (k,).
    """
    state = np.asarray(start, dtype=np.float64)
    even = np.full(state.size, 1.0 / np.sqrt(state.size))
    directions = np.tile(even, (distances.size, 1))
    times, noise = [], []
    logs: list[Array] = []
    collapsed: list[NDArray[np.bool_]] = []
    while when < until:
        after, end = orbit(state, when)
        error = float(
            np.linalg.norm((perturbed(state + round_off * even / scale, when, end) - after) * scale)
        )
        starts = state + distances[:, None] * directions / scale
        apart = (np.array([perturbed(beside, when, end) for beside in starts]) - after) * scale
        grown = np.linalg.norm(apart, axis=1)
        lost = grown <= CLEAR * error
        directions[~lost] = apart[~lost] / grown[~lost, None]
        # Where even the error is zero, so may a distance be: the least number there is has a logarithm.
        logs.append(np.log(np.maximum(np.maximum(grown, CLEAR * error), np.finfo(float).tiny) / distances))
        collapsed.append(lost)
        noise.append(error)
        times.append((when, end))
        state, when = after, end
    return PerturbedOrbits(
        distances, np.array(times), np.array(logs).T, np.array(collapsed).T, np.array(noise)
    )
