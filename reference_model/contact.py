"""Contact of the slider's four corners with the guide's walls (Eqs. 1-6, 9-11).

Corners are numbered ll, lr, ul, ur: lower/upper in the slider's y, left/right in its x. Each sees only
the infinite wall on its side.
"""

import math

from reference_model.compiled import kernel
from reference_model.parameters import Constants

CORNERS = ("ll", "lr", "ul", "ur")


@kernel
def corner_arm(c: Constants, corner: int, c5: float, s5: float) -> tuple[float, float]:
    """Return the arm A(theta_5) s of a corner, from the slider's centre in the fixed frame (Eq. 2), m."""
    sx = -c.half_width if corner % 2 == 0 else c.half_width
    sy = -c.half_length if corner < 2 else c.half_length
    return c5 * sx - s5 * sy, s5 * sx + c5 * sy


@kernel
def corner_gap(c: Constants, corner: int, x: float) -> float:
    """Return the gap (m, positive when open) of a corner whose material point is at `x` (Eqs. 3-6)."""
    return x - c.wall_left if corner % 2 == 0 else c.wall_right - x


@kernel
def inward(corner: int) -> float:
    """Return the x component of the wall's normal into the guide: +1 at the left wall, -1 at the right."""
    return 1.0 if corner % 2 == 0 else -1.0


@kernel
def normal_force(c: Constants, depth: float, depth_rate: float, impact_speed: float) -> float:
    """Return the Lankarani-Nikravesh force K d^n (1 + C d_rate / impact_speed), N (Eqs. 9 and 11).

    Not clipped: it is negative where the corner leaves faster than impact_speed / C, where the wall
    would have to pull. Zero for a negative depth.
    """
    if depth <= 0.0:
        return 0.0
    elastic = depth * math.sqrt(depth) if c.n == 1.5 else math.pow(depth, c.n)
    return c.K * elastic * (1.0 + c.C * depth_rate / impact_speed)
