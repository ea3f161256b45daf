"""Modified Coulomb friction (Eqs. 12, 13), as a whole and by its straight pieces."""

import numpy as np
from numpy.typing import NDArray

from exudyn_model.columns import FRICTION_COEFFICIENT, STATIC_SPEED, TRANSITION_SPEED
from exudyn_model.kernels import kernel


@kernel
def friction_force(normal: float, slip: float, law: NDArray[np.float64]) -> float:
    """Return the friction (N) against the slip (m/s); zero below the static speed."""
    ramp = (abs(slip) - law[STATIC_SPEED]) / (law[TRANSITION_SPEED] - law[STATIC_SPEED])
    force: float = -law[FRICTION_COEFFICIENT] * min(max(ramp, 0.0), 1.0) * normal * np.sign(slip)
    return force


@kernel
def slip_regime(slip: float, law: NDArray[np.float64]) -> float:
    """Return the straight piece of Eq. 13: 0 none, 1 rising, 2 full friction; with the slip's sign."""
    piece = 2.0 if abs(slip) >= law[TRANSITION_SPEED] else 1.0 if abs(slip) >= law[STATIC_SPEED] else 0.0
    return piece if slip >= 0.0 else -piece


@kernel
def friction_in_regime(normal: float, slip: float, regime: float, law: NDArray[np.float64]) -> float:
    """Extend one piece of :func:`friction_force` (N), named as by :func:`slip_regime`, to any slip."""
    if regime == 0.0:
        return 0.0
    sign, ramp = np.sign(regime), 1.0
    if abs(regime) == 1.0:
        ramp = (sign * slip - law[STATIC_SPEED]) / (law[TRANSITION_SPEED] - law[STATIC_SPEED])
    force: float = -law[FRICTION_COEFFICIENT] * ramp * normal * sign
    return force
