"""An elastic foundation along the whole side of the slider: Eqs. 7-8 continued to partial penetration.

A side wholly inside its wall, with depths d1 and d2 at its two corners, meets the paper's surface force
K_s (d1 + d2)/2 at the centroid of the penetrated trapezoid. Where one corner is outside, the penetrated part
is a triangle on the share q = d1 / (d1 - d2) of the side:

    both inside     U = K_s (d1^2 + d1 d2 + d2^2)/6,    N1 + N2 = K_s (d1 + d2)/2
    d2 < 0 < d1     U = K_s d1^3 / (6 (d1 - d2)),       N1 + N2 = K_s d1 q/2,     N2 = (N1 + N2) q/3

N_i = dU/dd_i are the forces at the corners, also at the one outside, that are statically equivalent to the
pressure. U is convex and twice continuously differentiable; its third derivatives jump where the second
corner goes in or out, which the integrators locate. What is here goes by the signs of the depths, not by the
located modes: a trial step across such an instant, behind which the triangle's formulas have a pole, stays
bounded.

The contact is the side's: one memory of the impact speed, one friction regime, one clipping, all kept at the
corner that touched first. The damping sees the depth rate, the friction the slip of the resultant's point,
which divides the side's face as N1 and N2 do.
"""

from reference_model.compiled import inlined, kernel
from reference_model.constants import Constants


@inlined
def resultant(c: Constants, d1: float, d2: float) -> tuple[float, float]:
    """Return the elastic force N1 + N2 on a side (N), and the share of it at corner 1.

    Where neither corner is inside there is no force, and the deeper one has the share of a touch: all.

    Parameters
    ----------
    c, d1, d2
        Constants; depths of the corners (m), negative outside the wall.
    """
    if d1 <= 0.0 and d2 <= 0.0:
        return 0.0, 1.0 if d1 > d2 else 0.0
    if d2 <= 0.0:
        part = d1 / (d1 - d2)
        return 0.5 * c.Ks * d1 * part, 1.0 - part / 3.0
    if d1 <= 0.0:
        part = d2 / (d2 - d1)
        return 0.5 * c.Ks * d2 * part, part / 3.0
    return 0.5 * c.Ks * (d1 + d2), (2.0 * d1 + d2) / (3.0 * (d1 + d2))


@kernel
def foundation_energy(c: Constants, d1: float, d2: float) -> float:
    """Return the potential U of one side, J, from the depths of its corners (m)."""
    if d1 > 0.0 and d2 > 0.0:
        return c.Ks * (d1 * d1 + d1 * d2 + d2 * d2) / 6.0
    deeper, other = max(d1, d2), min(d1, d2)
    return c.Ks * deeper**3 / (6.0 * (deeper - other)) if deeper > 0.0 else 0.0
