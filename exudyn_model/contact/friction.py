"""Modified Coulomb friction (Eqs. 12-13), as a whole and by its straight pieces."""

from typing import Any

import numpy as np

from exudyn_model.compiled import kernel


@kernel
def friction_force(normal: float, slip: float, law: Any) -> float:
    """Return the friction (N) against the slip (m/s); zero below ``static_speed``."""
    ramp: float = (abs(slip) - law.static_speed) / (law.transition_speed - law.static_speed)
    force: float = -law.friction * min(max(ramp, 0.0), 1.0) * normal * np.sign(slip)
    return force


@kernel
def slip_regime(slip: float, law: Any) -> float:
    """Return the straight piece of Eq. 13: 0 none, 1 rising, 2 full friction; with the slip's sign."""
    piece = 2.0 if abs(slip) >= law.transition_speed else 1.0 if abs(slip) >= law.static_speed else 0.0
    return piece if slip >= 0.0 else -piece


@kernel
def friction_in_regime(normal: float, slip: float, regime: float, law: Any) -> float:
    """Extend one piece of :func:`friction_force` (N), named as by :func:`slip_regime`, to any slip."""
    if regime == 0.0:
        return 0.0
    sign, ramp = np.sign(regime), 1.0
    if abs(regime) == 1.0:
        ramp = (sign * slip - law.static_speed) / (law.transition_speed - law.static_speed)
    force: float = -law.friction * ramp * normal * sign
    return force
