"""Corners of the slider and their walls (Eqs. 1-6), in the frame of the guide.

Its origin lies on the guide's centre line, x points across the guide, y along it. Corners are sharp points;
each sees the infinite wall on its own side.
"""

import numpy as np

from exudyn_model.kernels import kernel
from exudyn_model.laws import CornerMotion, Law, SideForces

CORNERS = ("ll", "lr", "ul", "ur")
"""Lower or upper along the guide (y), left or right across it (x); in the order of the contacts' rows."""
CORNER_COUNT = 4
# Offset from the row of a side's lower corner, which is that of the side, to that of its upper corner
UPPER = 2

# Sign of each of CORNERS across the guide (its wall is on the same side), and along it
ACROSS = (-1.0, 1.0, -1.0, 1.0)
ALONG = (-1.0, -1.0, 1.0, 1.0)


@kernel
def corner_motion(
    number: int, x: float, angle: float, vx: float, vy: float, omega: float, law: Law
) -> CornerMotion:
    """Return the motion of one of ``CORNERS`` from that of the slider in the guide's frame (m, rad, s)."""
    outward = ACROSS[number]
    sx, sy = outward * law.half_width, ALONG[number] * law.half_length
    cosine, sine = np.cos(angle), np.sin(angle)
    rx, ry = cosine * sx - sine * sy, sine * sx + cosine * sy
    # A difference of distances from the centre line, a hundred times the clearance, would lose digits
    gap = law.clearance - outward * (x - sine * sy) + 2.0 * law.half_width * np.sin(0.5 * angle) ** 2
    return CornerMotion(gap, -outward * (vx - omega * ry), vy + omega * rx, rx, ry)


@kernel
def corner_load(
    number: int, normal: float, friction: float, motion: CornerMotion
) -> tuple[float, float, float]:
    """Return fx, fy (N) and the moment about the slider's centre (N m) of a corner's force and friction."""
    inward = -ACROSS[number] * normal
    return inward, friction, motion.arm_x * friction - motion.arm_y * inward


@kernel
def side_load(
    side: int, forces: SideForces, lower: CornerMotion, upper: CornerMotion
) -> tuple[float, float, float]:
    """Return fx, fy (N) and the moment about the slider's centre (N m) of the forces of a side."""
    x1, y1, moment1 = corner_load(side, forces.lower, forces.lower_friction, lower)
    x2, y2, moment2 = corner_load(side + UPPER, forces.upper, forces.upper_friction, upper)
    return x1 + x2, y1 + y2, moment1 + moment2
