"""The load of a workpiece on the slider's centre: its force and its energy, of the height y5 alone.

The force is a power law, or linear between the rows of a table. The functions take numbers or arrays.
"""

from typing import Any, NamedTuple

import numpy as np

from reference_model.linkage import Array


class Load(NamedTuple):
    """Force P(h) at h = surface - y5 > 0: force (h / depth)^exponent, or the table's if it has rows."""

    surface: float
    """y5 at which the slider meets the workpiece, m; -inf: there is none."""
    force: float
    """Force of the power law at `depth`, N."""
    depth: float
    """Reference depth of the power law, m."""
    exponent: float
    depths: Array
    """Depths of the table's rows, ascending from 0, m; empty: a power law."""
    forces: Array
    """Forces of the table's rows, N; the last one also acts beyond its depth."""


NO_LOAD = Load(-np.inf, 0.0, 1.0, 1.0, np.empty(0), np.empty(0))


def exists(load: Load) -> bool:
    """Return whether there is a workpiece."""
    return load.surface > -np.inf


def kinks(load: Load) -> Array:
    """Return the heights of the slider at which the force is not smooth, m."""
    if not exists(load):
        return np.empty(0)
    return load.surface - (load.depths if load.depths.size else np.zeros(1))


def load_force(load: Load, y: Any) -> Any:
    """Return the force (N) along +y on a slider whose centre is at the height `y` (m)."""
    h = np.maximum(load.surface - y, 0.0)
    force = load.force * (h / load.depth) ** load.exponent
    # The weight of a row is exactly 0 outside the two segments beside it, so that nothing is left of a
    # row that lies behind, however steep these are.
    after = 0.0 * h
    for i in range(load.depths.size - 1, 0, -1):
        width = load.depths[i] - load.depths[i - 1]
        share = np.minimum(np.maximum(h - load.depths[i - 1], 0.0), width) / width
        force = force + load.forces[i] * (share - after)
        after = share
    return force


def load_energy(load: Load, y: Any) -> Any:
    """Return the energy (J) stored in the workpiece: the integral of the force over the depth."""
    h = np.maximum(load.surface - y, 0.0)
    energy = load.force * h / (load.exponent + 1.0) * (h / load.depth) ** load.exponent
    for i in range(1, load.depths.size):
        width = load.depths[i] - load.depths[i - 1]
        depth = np.minimum(np.maximum(h - load.depths[i - 1], 0.0), width)
        mean = load.forces[i - 1] + 0.5 * (load.forces[i] - load.forces[i - 1]) * (depth / width)
        energy = energy + mean * depth
    if load.depths.size:
        energy = energy + load.forces[-1] * np.maximum(h - load.depths[-1], 0.0)
    return energy
