"""The load of a workpiece on the slider's centre: its force and its energy, of the height y5 alone.

The force is a power law, or of a table a sum of ramps, of which one begins at each row. What is here works on
numbers and on arrays of them alike.
"""

from typing import Any, NamedTuple

import numpy as np

from reference_model.linkage import Array


class Load(NamedTuple):
    """P(h), h = surface - y5 > 0: force (h / depth)^exponent + the sum of the bends (h - starts) > 0."""

    surface: float
    """y5 at which the slider meets the workpiece, m; -inf: there is none."""
    force: float
    """N, of the power law at ..."""
    depth: float
    """... this depth, m."""
    exponent: float
    starts: Array
    """Depths of a table's rows, m, ..."""
    bends: Array
    """... and by how much the slope of the force changes there, N/m."""


NO_LOAD = Load(-np.inf, 0.0, 1.0, 1.0, np.empty(0), np.empty(0))


def tabulated(surface: float, rows: Array) -> Load:
    """Return the load of a table, shape (n, 2): linear between its rows (m, N), constant beyond them."""
    slopes = np.diff(rows[:, 1]) / np.diff(rows[:, 0])
    bends = np.diff(slopes, prepend=0.0, append=0.0)
    return Load(surface, 0.0, 1.0, 1.0, np.ascontiguousarray(rows[:, 0]), bends)


def exists(load: Load) -> bool:
    """Return whether there is a workpiece."""
    return load.surface > -np.inf


def kinks(load: Load) -> Array:
    """Return the heights at which the force is not smooth, m."""
    if not exists(load):
        return np.empty(0)
    return load.surface - (load.starts if load.starts.size else np.zeros(1))


def load_force(load: Load, y: Any) -> Any:
    """Return the force (N) along +y on a slider whose centre is at the height `y` (m)."""
    h = np.maximum(load.surface - y, 0.0)
    force = load.force * (h / load.depth) ** load.exponent
    for i in range(load.starts.size):
        force = force + load.bends[i] * np.maximum(h - load.starts[i], 0.0)
    return force


def load_energy(load: Load, y: Any) -> Any:
    """Return the energy (J) stored in the workpiece: the integral of the force over the depth."""
    h = np.maximum(load.surface - y, 0.0)
    energy = load.force * h / (load.exponent + 1.0) * (h / load.depth) ** load.exponent
    for i in range(load.starts.size):
        energy = energy + 0.5 * load.bends[i] * np.maximum(h - load.starts[i], 0.0) ** 2
    return energy
