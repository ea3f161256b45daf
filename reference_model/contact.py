"""Contact of the slider's four corners with the guide's walls (Eqs. 1-11), in four laws.

Corners are numbered ll, lr, ul, ur: lower/upper in the slider's y, left/right in its x. Each sees only
the infinite wall on its side. The forces of one side derive from a potential U of its two depths d1, d2,
times the damping factor of Eq. 11 at each corner, N_i = dU/dd_i (1 + C d_i' / v_i). v_i is the speed of the
touch, or, where the law has no memory, sqrt(d_i'^2 + floor^2):

0, hertz-corners
    U = K d1^(n+1)/(n+1) + K d2^(n+1)/(n+1): every penetrating corner by itself (Eqs. 9-11).
1, paper-switching
    Eqs. 7-8 literally: as soon as both corners of a side penetrate, the point forces are replaced by the
    surface force K_s (d1 + d2)/2, undamped, at the centroid of the penetrated trapezoid. At the corners
    that is N1 = K_s (2 d1 + d2)/6, N2 = K_s (d1 + 2 d2)/6, from U = K_s (d1^2 + d1 d2 + d2^2)/6. The switch
    jumps from some N to some 1e4 N at a depth of 1 um: each one creates or destroys energy.
2, strip
    U = K d1^(n+1)/(n+1) + K d2^(n+1)/(n+1) + 2 K_s h^2 with h = d1 d2 / (d1 + d2), h = 0 unless both
    penetrate. At equal depths the added part is K_s d^2/2, the surface law's; as one depth goes to zero
    its forces, dU/dd1 = 4 K_s h (d2 / (d1 + d2))^2, vanish: it goes over continuously into the corner law.
    So U cannot be convex, whatever the transition: a corner alone is softer than the flat side, and a slider
    that is pressed against its wall comes to rest a little tilted, on one corner, to either side.
3, foundation
    Eqs. 7-8 continued to a side of which only a part is inside (`reference_model.foundation`).
"""

import math

from reference_model.compiled import inlined, kernel
from reference_model.constants import PAPER_SWITCHING, STRIP, Constants

CORNERS = ("ll", "lr", "ul", "ur")


@inlined
def corner_arm(c: Constants, corner: int, c5: float, s5: float) -> tuple[float, float]:
    """Return the arm A(theta_5) s of a corner, from the slider's centre in the fixed frame (Eq. 2), m."""
    sx = -c.half_width if corner % 2 == 0 else c.half_width
    sy = -c.half_length if corner < 2 else c.half_length
    return c5 * sx - s5 * sy, s5 * sx + c5 * sy


@inlined
def corner_gap(c: Constants, corner: int, x: float) -> float:
    """Return the gap (m, positive when open) of a corner whose material point is at `x` (Eqs. 3-6)."""
    return x - c.wall_left if corner % 2 == 0 else c.wall_right - x


@inlined
def inward(corner: int) -> float:
    """Return the x component of the wall's normal into the guide: +1 at the left wall, -1 at the right."""
    return 1.0 if corner % 2 == 0 else -1.0


@inlined
def point_force(K: float, n: float, depth: float) -> float:
    """Return the elastic force K d^n of a point contact (Eq. 9), N; zero for a negative depth."""
    if depth <= 0.0:
        return 0.0
    return K * (depth * math.sqrt(depth) if n == 1.5 else math.pow(depth, n))


@inlined
def without_memory(c: Constants) -> bool:
    """Return whether the damping refers to the present depth rate, not to the impact speed of the touch."""
    return c.memoryless > 0.0


@inlined
def damping_factor(c: Constants, depth_rate: float, impact_speed: float) -> float:
    """Return 1 + C d'/v of Eq. 11; negative where the wall would have to pull.

    v is `impact_speed` (m/s), or the present one where the law has no memory: then it is at least 1 - C > 0.
    """
    if without_memory(c):
        impact_speed = math.sqrt(depth_rate * depth_rate + c.speed_floor * c.speed_floor)
    return 1.0 + c.C * depth_rate / impact_speed


@inlined
def elastic_force(c: Constants, mine: float, other: float, both: bool) -> float:
    """Return dU/dd of the corner of depth `mine` (m), N.

    `other` is the depth of the other corner of its side, `both` whether both are in contact.
    """
    if both and c.law == PAPER_SWITCHING:
        return c.Ks * (2.0 * mine + other) / 6.0
    force = point_force(c.K, c.n, mine)
    if both and c.law == STRIP and mine > 0.0 and other > 0.0:
        share = other / (mine + other)
        force += 4.0 * c.Ks * mine * share**3
    return force


@kernel
def stored_energy(c: Constants, d1: float, d2: float, both: bool) -> float:
    """Return the potential U of one side, J."""
    if both and c.law == PAPER_SWITCHING:
        return c.Ks * (d1 * d1 + d1 * d2 + d2 * d2) / 6.0
    energy = (point_force(c.K, c.n, d1) * d1 + point_force(c.K, c.n, d2) * d2) / (c.n + 1.0)
    if both and c.law == STRIP and d1 > 0.0 and d2 > 0.0:
        h = d1 * d2 / (d1 + d2)
        energy += 2.0 * c.Ks * h * h
    return energy


@inlined
def is_damped(c: Constants, both: bool) -> bool:
    """Return whether the damping factor applies: not in the paper's surface contact."""
    return not (both and c.law == PAPER_SWITCHING)
