"""Modified Coulomb friction (Eqs. 12-13), taken apart into its smooth pieces.

The dynamic correction coefficient c_d of Eq. 13 has kinks at |v_t| = v0 and v1. Between them it is smooth, so
an integrator that knows in which regime it is, and locates the change, never steps over a kink. Regimes:
-2, +2 full friction; -1, +1 on the ramp between v0 and v1; 0 none. Where v0 is 0 there is no regime 0: -1 and
+1 are then one and the same ramp from -v1 to v1.
"""

import math

from reference_model.compiled import inlined
from reference_model.parameters import Law


@inlined
def friction_regime(law: Law, v_t: float) -> float:
    """Return the regime of a tangential speed (m/s)."""
    speed = abs(v_t)
    regime = 0.0 if speed < law.v0 else (1.0 if speed <= law.v1 else 2.0)
    return regime if v_t >= 0.0 else -regime


@inlined
def regime_bounds(law: Law, regime: float) -> tuple[float, float]:
    """Return the lower and upper tangential speed (m/s) of a regime."""
    if regime == 0.0:
        return -law.v0, law.v0
    if abs(regime) == 1.0:
        if law.v0 == 0.0:
            return -law.v1, law.v1
        return (law.v0, law.v1) if regime > 0.0 else (-law.v1, -law.v0)
    return (law.v1, math.inf) if regime > 0.0 else (-math.inf, -law.v1)


@inlined
def friction_force(law: Law, normal: float, v_t: float, regime: float) -> float:
    """Return the friction force (N) along the direction of the slip `v_t` (m/s), Eq. 12.

    c_d v_t / |v_t| of Eq. 13 stands there as the smooth function that it is within `regime`.
    """
    if regime == 0.0:
        return 0.0
    sign = 1.0 if regime > 0.0 else -1.0
    correction = sign if abs(regime) == 2.0 else (v_t - sign * law.v0) / (law.v1 - law.v0)
    return -law.c_f * normal * correction
