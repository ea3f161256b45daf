"""Contact laws and friction, as formulas of one contact with the constants of a `parameters.Contact`.

A contact law gives the elastic forces f_1, f_2 at the two corners of a side and their potential U from the
depths (`side_force`), the damped force (`damped_force`), and a speed with the sign of that force (`push`).

HERTZ_CORNERS
    U = K d1^(n+1)/(n+1) + K d2^(n+1)/(n+1): each penetrating corner independently (Eqs. 9-11).
PAPER_SWITCHING
    Eqs. 7-8 literally: as soon as both corners of a side penetrate, the point forces are replaced by the
    surface force K_s (d1 + d2)/2, undamped, at the centroid of the penetrated trapezoid. At the corners that
    is f1 = K_s (2 d1 + d2)/6, f2 = K_s (d1 + 2 d2)/6, from U = K_s (d1^2 + d1 d2 + d2^2)/6. The switch jumps
    from some N to some 1e4 N at a depth of 1 um: each one creates or destroys energy.
FOUNDATION
    The same surface continued to a side of which only a part is inside: an elastic foundation. Where corner 2
    is outside, the penetrated part is a triangle on the share q = d1 / (d1 - d2) of the side:

        d2 < 0 < d1     U = K_s d1^3 / (6 (d1 - d2)),    f1 + f2 = K_s d1 q/2,    f2 = (f1 + f2) q/3

    f_i = dU/dd_i are the forces at the corners, also at the one outside, that are statically equivalent to
    the pressure. U is convex and twice continuously differentiable; its third derivatives jump where the
    second corner goes in or out, which the integrators locate. It goes by the signs of the depths, not by the
    located modes: a trial step across such an instant, behind which the triangle's formulas have a pole,
    stays bounded. The side is one contact (`Contact.one_side`): its force f_1 + f_2 has one memory of the
    impact speed, one damping and one friction.
ADAMS_IMPACT
    As HERTZ_CORNERS, with k = contact.stiffness where the scene gives it, but damped by c(d) d', which refers
    to no impact speed. c falls with d^2 as a corner leaves its wall. An elastic force of n < 2 falls more
    slowly: one that was clipped pushes again before it is out. With n > 2 each contact ends clipped.

Friction is the modified Coulomb law of Eqs. 12-13, taken apart into its smooth pieces: the dynamic correction
coefficient c_d of Eq. 13 has kinks at |v_t| = v0 and v1, which the integrators locate. Regimes: -2, +2 full
friction; -1, +1 on the ramp between v0 and v1; 0 none. Where v0 is 0 there is no regime 0: -1 and +1 are then
one and the same ramp from -v1 to v1.
"""

import math

from reference_model.compiled import inlined
from reference_model.parameters import ADAMS_IMPACT, FOUNDATION, PAPER_SWITCHING, Contact

SHALLOWEST = 1.0e-11
"""Smallest depth that `push` follows, m: five times the accuracy to which a touch is located. Nearer to the
wall its slope would magnify the rounding of the depth without bound, and the force is negligible."""


@inlined
def point_force(K: float, n: float, depth: float) -> float:
    """Return the elastic force K d^n of a point contact (Eq. 9), N; zero for a negative depth."""
    if depth <= 0.0:
        return 0.0
    return K * (depth * math.sqrt(depth) if n == 1.5 else math.pow(depth, n))


@inlined
def damped_force(contact: Contact, elastic: float, depth: float, depth_rate: float, speed: float) -> float:
    """Return the damped normal force (N) from the elastic one; negative if the wall would have to pull."""
    if contact.law == ADAMS_IMPACT:
        s = min(max(depth / contact.d_max, 0.0), 1.0)
        return elastic + contact.c_max * s * s * (3.0 - 2.0 * s) * depth_rate
    return elastic * (1.0 + contact.C * depth_rate / speed)


@inlined
def push(contact: Contact, depth: float, depth_rate: float, speed: float) -> float:
    """Return a speed (m/s) that has the sign of the damped force.

    It is v (1 + C d'/v). Of adams-impact it is the force over c_max s^m, with s = d / d_max, m = min(n, 2),
    and m = 0 if s > 1: as s vanishes neither the elastic nor the damped part grows without bound, and one of
    them stays. The depth is in m, its rate and the impact speed `speed` in m/s.
    """
    if contact.law != ADAMS_IMPACT:
        return speed + contact.C * depth_rate
    s, m = max(depth, SHALLOWEST) / contact.d_max, min(contact.n, 2.0)
    elastic = contact.K * math.pow(contact.d_max, contact.n) / contact.c_max
    if s > 1.0:
        return elastic * math.pow(s, contact.n) + depth_rate
    return elastic * math.pow(s, contact.n - m) + math.pow(s, 2.0 - m) * (3.0 - 2.0 * s) * depth_rate


@inlined
def side_force(contact: Contact, d1: float, d2: float, both: bool) -> tuple[float, float, float]:
    """Return the elastic forces (N) at the two corners of a side, and the potential U (J) of both.

    d1, d2 are their depths (m), negative outside the wall; `both`: each corner is in contact by itself.
    """
    surface = both and contact.law == PAPER_SWITCHING
    if surface or (contact.law == FOUNDATION and d1 > 0.0 and d2 > 0.0):
        f1, f2 = contact.Ks * (2.0 * d1 + d2) / 6.0, contact.Ks * (d1 + 2.0 * d2) / 6.0
        return f1, f2, contact.Ks * (d1 * d1 + d1 * d2 + d2 * d2) / 6.0
    if contact.law == FOUNDATION:
        d_in, d_out = (d1, d2) if d1 > d2 else (d2, d1)
        if d_in <= 0.0:
            return 0.0, 0.0, 0.0
        share = d_in / (d_in - d_out)
        force = 0.5 * contact.Ks * d_in * share
        f_out, energy = force * share / 3.0, force * d_in / 3.0
        return (force - f_out, f_out, energy) if d1 > d2 else (f_out, force - f_out, energy)
    f1, f2 = point_force(contact.K, contact.n, d1), point_force(contact.K, contact.n, d2)
    return f1, f2, (f1 * max(d1, 0.0) + f2 * max(d2, 0.0)) / (contact.n + 1.0)


@inlined
def friction_regime(contact: Contact, v_t: float) -> int:
    """Return the regime of a tangential speed (m/s)."""
    speed = abs(v_t)
    regime = 0 if speed < contact.v0 else (1 if speed <= contact.v1 else 2)
    return regime if v_t >= 0.0 else -regime


@inlined
def regime_bounds(contact: Contact, regime: int) -> tuple[float, float]:
    """Return the lower and upper tangential speed (m/s) of a regime."""
    if regime == 0:
        return -contact.v0, contact.v0
    if abs(regime) == 1:
        if contact.v0 == 0.0:
            return -contact.v1, contact.v1
        return (contact.v0, contact.v1) if regime > 0 else (-contact.v1, -contact.v0)
    return (contact.v1, math.inf) if regime > 0 else (-math.inf, -contact.v1)


@inlined
def friction_force(contact: Contact, normal: float, v_t: float, regime: int) -> float:
    """Return the friction force (N) along the direction of the slip `v_t` (m/s), Eq. 12.

    c_d v_t / |v_t| of Eq. 13 is replaced by the smooth function that equals it within `regime`.
    """
    if regime == 0:
        return 0.0
    sign = 1.0 if regime > 0 else -1.0
    correction = sign if abs(regime) == 2 else (v_t - sign * contact.v0) / (contact.v1 - contact.v0)
    return -contact.c_f * normal * correction
