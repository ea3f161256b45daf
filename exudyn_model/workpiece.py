"""Load of a workpiece: a force that pushes the slider's centre up, by its height alone.

With h = surface - y the force is P(h), 0 for h <= 0: P1 (h / h1)^q, or linear between the rows of a table and
that of its last row beyond it. What is stored is its integral over h from 0.
"""

import numpy as np
from numpy.typing import NDArray

from exudyn_model.kernels import entry
from exudyn_model.parameters import Load

# The first row of a workpiece's array: its surface, m, and the exponent q, 0 for a table
SURFACE, EXPONENT = 0, 1
# The rows after it, one for a power law: h (m), force (N) and energy (J) there
DEPTH, FORCE, ENERGY = range(3)


def workpiece_array(load: Load) -> NDArray[np.float64]:
    """Collect the constants of a workpiece for the kernels, shape (1 + rows, 3)."""
    workpiece = np.zeros((1 + len(load.rows), 3))
    workpiece[0, SURFACE], workpiece[0, EXPONENT] = load.surface, load.exponent
    workpiece[1:, : FORCE + 1] = load.rows
    depths, forces = workpiece[1:, DEPTH], workpiece[1:, FORCE]
    workpiece[2:, ENERGY] = np.cumsum(0.5 * (forces[1:] + forces[:-1]) * np.diff(depths))
    return workpiece


@entry
def workpiece_force(y: float, workpiece: NDArray[np.float64]) -> tuple[float, float]:
    """Return force along y (N) and stored energy (J) of a slider with its centre at a height ``y`` (m)."""
    depth = workpiece[0, SURFACE] - y
    if not depth > 0.0:
        return 0.0, 0.0
    row = len(workpiece) - 1
    exponent = workpiece[0, EXPONENT]
    if exponent > 0.0:
        power = workpiece[row, FORCE] * (depth / workpiece[row, DEPTH]) ** exponent
        return power, power * depth / (exponent + 1.0)
    while depth < workpiece[row, DEPTH]:  # the first one's is 0
        row -= 1
    before = workpiece[row, FORCE]
    force, rest = before, depth - workpiece[row, DEPTH]
    if row + 1 < len(workpiece):
        rise, length = workpiece[row + 1, FORCE] - before, workpiece[row + 1, DEPTH] - workpiece[row, DEPTH]
        force += rise * rest / length
    return force, workpiece[row, ENERGY] + 0.5 * (before + force) * rest


@entry
def workpiece_forces(
    heights: NDArray[np.float64], workpiece: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return forces (N) and energies (J) as :func:`workpiece_force` at many heights (m), shape (n,)."""
    forces, energies = np.empty_like(heights), np.empty_like(heights)
    for k in range(len(heights)):
        forces[k], energies[k] = workpiece_force(heights[k], workpiece)
    return forces, energies
