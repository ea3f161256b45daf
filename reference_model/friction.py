"""Modified Coulomb friction (Eqs. 12-13), taken apart into its smooth pieces.

The dynamic correction coefficient c_d of Eq. 13 has kinks at |v_t| = v0 and v1. Between them it is
smooth, so an integrator that knows in which regime it is, and locates the change, never steps over a kink.
Regimes: -2, +2 full friction; -1, +1 on the ramp between v0 and v1; 0 none. Where v0 is 0 there is no regime
0: -1 and +1 are then one and the same ramp from -v1 to v1.
"""

from reference_model.compiled import inlined
from reference_model.constants import Constants


@inlined
def friction_regime(c: Constants, v_t: float) -> int:
    """Return the regime of a tangential speed (m/s)."""
    speed = abs(v_t)
    regime = 0 if speed < c.v0 else (1 if speed <= c.v1 else 2)
    return regime if v_t >= 0.0 else -regime


@inlined
def regime_bounds(c: Constants, regime: int) -> tuple[float, float]:
    """Return the lower and upper tangential speed (m/s) of a regime."""
    if regime == 0:
        return -c.v0, c.v0
    if abs(regime) == 1:
        if c.v0 == 0.0:
            return -c.v1, c.v1
        return (c.v0, c.v1) if regime > 0 else (-c.v1, -c.v0)
    return (c.v1, float("inf")) if regime > 0 else (-float("inf"), -c.v1)


@inlined
def signed_correction(c: Constants, v_t: float, regime: int) -> float:
    """Return c_d v_t / |v_t| of Eq. 13 as the smooth function it is within `regime`."""
    if regime == 0:
        return 0.0
    sign = 1.0 if regime > 0 else -1.0
    if abs(regime) == 2:
        return sign
    return (v_t - sign * c.v0) / (c.v1 - c.v0)


@inlined
def friction_force(c: Constants, normal: float, v_t: float, regime: int) -> float:
    """Return the friction force along +y on the slider, N (Eq. 12)."""
    return -c.c_f * normal * signed_correction(c, v_t, regime)
