"""Load of a workpiece: a force that pushes the slider's centre up, by its height alone.

With h = surface - y the force P(h) is 0 for h <= 0, else P1 (h / h1)^q, or linear between the rows of a table
and constant beyond its last row. The stored energy is the integral of P from 0 to h.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from exudyn_model.kernels import entry, record
from exudyn_model.linkage import driven_rod4
from exudyn_model.parameters import Load, Parameters

Array = NDArray[np.float64]

ROW = np.dtype([(name, float) for name in ("height", "depth", "force", "energy", "exponent")])
"""A row of a workpiece: height of the slider's centre (m), depth (m), force (N) and energy (J) there, and q.

The first row is the surface; q is 0 for a table. Without a load there is no row.
"""
# Number of crank angles in a turn at which `load_forces` computes the force
_TURN = 720


def workpiece_array(load: Load | None) -> NDArray[Any]:
    """Return the rows of a workpiece for the kernels."""
    if load is None:
        return np.zeros(0, ROW)
    points = np.array(load.rows if load.exponent == 0.0 else [(0.0, 0.0), *load.rows])
    workpiece = np.zeros(len(points), ROW)
    depths, forces = points.T
    workpiece["height"], workpiece["depth"], workpiece["force"] = load.surface - depths, depths, forces
    workpiece["energy"][1:] = np.cumsum(0.5 * (forces[1:] + forces[:-1]) * np.diff(depths))
    workpiece["exponent"] = load.exponent
    return workpiece


@entry
def workpiece_force(y: float, workpiece: NDArray[Any]) -> tuple[float, float]:
    """Return force along y (N) and stored energy (J) of a slider with its centre at a height ``y`` (m)."""
    depth = workpiece[0].height - y if len(workpiece) > 0 else 0.0
    if not depth > 0.0:
        return 0.0, 0.0
    row = len(workpiece) - 1
    exponent = workpiece[row].exponent
    if exponent > 0.0:
        power = workpiece[row].force * (depth / workpiece[row].depth) ** exponent
        return power, power * depth / (exponent + 1.0)
    while depth < workpiece[row].depth:  # the depth of the first row is 0
        row -= 1
    base = workpiece[row].force
    force, rest = base, depth - workpiece[row].depth
    if row + 1 < len(workpiece):
        rise, length = workpiece[row + 1].force - base, workpiece[row + 1].depth - workpiece[row].depth
        force += rise * rest / length
    return force, workpiece[row].energy + 0.5 * (base + force) * rest


@entry
def workpiece_forces(heights: Array, workpiece: NDArray[Any]) -> tuple[Array, Array]:
    """Return forces (N) and energies (J) as :func:`workpiece_force` at many heights (m), shape (n,)."""
    forces, energies = np.empty_like(heights), np.empty_like(heights)
    for k in range(len(heights)):
        forces[k], energies[k] = workpiece_force(heights[k], workpiece)
    return forces, energies


def load_forces(parameters: Parameters, y: float) -> tuple[float, float]:
    """Return the force on a slider at a height ``y`` (m), and the largest on an ideal slider in a turn, N.

    Raises
    ------
    ValueError
        If one of the forces is not finite; one line.
    """
    load, mechanism = parameters.load, parameters.mechanism
    if load is None:
        return 0.0, 0.0
    linkage = record(mechanism)[0]
    tips = [driven_rod4(mechanism.period * k / _TURN, linkage)[0] for k in range(_TURN)]
    across = mechanism.guide_x + mechanism.reference_offset - np.array([tip.x for tip in tips])
    drop = mechanism.slider_branch * np.sqrt(mechanism.rod4.length**2 - across**2)
    heights = np.array([tip.y for tip in tips]) + drop
    forces, _ = workpiece_forces(np.append(heights, y), workpiece_array(load))
    if not np.isfinite(forces).all():
        raise ValueError(
            f"load.surface = {load.surface} m: the workpiece's force overflows at y = {heights.min():.3g} m"
        )
    return float(forces[-1]), float(forces[:-1].max())
