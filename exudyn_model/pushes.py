"""Forces of a workpiece on the slider at the start and in a turn of the crank, before a run."""

import numpy as np

from exudyn_model.linkage import driven_rod4, linkage_array
from exudyn_model.parameters import Parameters
from exudyn_model.workpiece import workpiece_array, workpiece_forces

# Crank angles at which the force is looked at in a turn
_TURN = 720


def pushes(parameters: Parameters, y: float) -> tuple[float, float]:
    """Return the force on a slider at a height ``y`` (m), and the largest on an ideal one in a turn, N.

    Raises
    ------
    ValueError
        In one line, where one of them is not finite.
    """
    load, mechanism = parameters.load, parameters.mechanism
    if load is None:
        return 0.0, 0.0
    linkage = linkage_array(mechanism)
    tips = [driven_rod4(mechanism.period * k / _TURN, linkage)[0] for k in range(_TURN)]
    across = mechanism.guide_x + mechanism.reference_offset - np.array([tip.x for tip in tips])
    below = mechanism.slider_branch * np.sqrt(mechanism.rod4.length**2 - across**2)
    heights = np.array([tip.y for tip in tips]) + below
    forces, _ = workpiece_forces(np.append(heights, y), workpiece_array(load))
    if not np.isfinite(forces).all():
        raise ValueError(
            f"load.surface = {load.surface} m: the workpiece's force overflows at y = {heights.min():.3g} m"
        )
    return float(forces[-1]), float(forces[:-1].max())
