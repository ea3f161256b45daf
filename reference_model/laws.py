"""Contact laws: each an object of one side of the slider, that is of two corners, and a number in `Law.law`.

A law gives the elastic forces f_1, f_2 at the two corners of a side from their depths, and the potential U
that they derive from (`side_force`); whether the damping of Eq. 11 applies (`is_damped`); and whether the
corners touch independently, or the side as one contact (`touches_as_one`), whose force f_1 + f_2 has one
memory of the impact speed, one damping and one friction.

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
    stays bounded.
"""

import math

from reference_model.compiled import inlined
from reference_model.parameters import FOUNDATION, PAPER_SWITCHING, Law


@inlined
def point_force(K: float, n: float, depth: float) -> float:
    """Return the elastic force K d^n of a point contact (Eq. 9), N; zero for a negative depth."""
    if depth <= 0.0:
        return 0.0
    return K * (depth * math.sqrt(depth) if n == 1.5 else math.pow(depth, n))


@inlined
def touches_as_one(law: Law) -> bool:
    """Return whether a side is one contact, which the corner that touched first keeps."""
    return law.law == FOUNDATION


def acts_on_sides(law: Law) -> bool:
    """Return `touches_as_one`, which only kernels can call, to Python."""
    return bool(touches_as_one.py_func(law))  # type: ignore[attr-defined]


@inlined
def is_damped(law: Law, both: bool) -> bool:
    """Return whether the damping factor applies: not in the paper's surface contact."""
    return not (both and law.law == PAPER_SWITCHING)


@inlined
def damping_factor(law: Law, depth_rate: float, impact_speed: float) -> float:
    """Return 1 + C d'/v of Eq. 11; negative where the wall would have to pull.

    v is `impact_speed` (m/s), or the present one where the law has no memory: then it is at least 1 - C > 0.
    """
    if law.memoryless > 0.0:
        impact_speed = math.sqrt(depth_rate * depth_rate + law.speed_floor * law.speed_floor)
    return 1.0 + law.C * depth_rate / impact_speed


@inlined
def side_force(law: Law, d1: float, d2: float, both: bool) -> tuple[float, float, float]:
    """Return the elastic forces (N) at the two corners of a side, and the potential U (J) of both.

    Parameters
    ----------
    law
        The contact.
    d1, d2
        Depths of the corners, m; negative outside the wall.
    both
        Whether both corners are in contact, independently.
    """
    if law.law == FOUNDATION:
        if d1 > 0.0 and d2 > 0.0:
            f1, f2 = law.Ks * (2.0 * d1 + d2) / 6.0, law.Ks * (d1 + 2.0 * d2) / 6.0
            return f1, f2, law.Ks * (d1 * d1 + d1 * d2 + d2 * d2) / 6.0
        deep, out = (d1, d2) if d1 > d2 else (d2, d1)
        if deep <= 0.0:
            return 0.0, 0.0, 0.0
        share = deep / (deep - out)
        force = 0.5 * law.Ks * deep * share
        less, energy = force * share / 3.0, force * deep / 3.0
        return (force - less, less, energy) if d1 > d2 else (less, force - less, energy)
    if both and law.law == PAPER_SWITCHING:
        f1, f2 = law.Ks * (2.0 * d1 + d2) / 6.0, law.Ks * (d1 + 2.0 * d2) / 6.0
        return f1, f2, law.Ks * (d1 * d1 + d1 * d2 + d2 * d2) / 6.0
    f1, f2 = point_force(law.K, law.n, d1), point_force(law.K, law.n, d2)
    return f1, f2, (f1 * max(d1, 0.0) + f2 * max(d2, 0.0)) / (law.n + 1.0)


@inlined
def resultant_share(f1: float, f2: float, d1: float, d2: float) -> float:
    """Return the share of corner 1 in a side's force, where the resultant's point divides its face.

    Where neither corner is inside there is no force, and the deeper one has the share of a touch: all.
    """
    if f1 + f2 > 0.0:
        return f1 / (f1 + f2)
    return 1.0 if d1 > d2 else 0.0
