"""Clearance of the crank pin A: the crank's journal in the bearing of rod 2 (Figs. 7, 8).

The journal, of radius R_j, sits on the crank's tip; the bearing, of radius R_b = R_j + clearance, at the
start of rod 2. The vector e leads from the bearing's centre to the journal's; the contact is closed where
|e| exceeds the clearance; n = e / |e|, t is n rotated by +90 degrees. Force and friction act on both bodies
in the point of the bearing's surface, its centre + R_b n.
"""

from typing import NamedTuple

import numpy as np

from exudyn_model.kernels import kernel
from exudyn_model.laws import Law, friction_force, surface_force


class JournalMotion(NamedTuple):
    """Motion of a journal in its bearing."""

    # Gap (m), positive where it is open, and its rate (m/s)
    gap: float
    rate: float
    # Velocity (m/s) along t of the journal's material relative to the bearing's, where they touch
    slip: float
    # The unit vector n
    nx: float
    ny: float
    distance: float  # |e|, m


@kernel
def journal_motion(
    ex: float, ey: float, vx: float, vy: float, w1: float, w2: float, law: Law
) -> JournalMotion:
    """Return the motion from e (m), its rate (m/s), and both angular speeds (rad/s), the journal's first."""
    distance = np.hypot(ex, ey)
    # A centred journal has no direction, and no contact that would need it
    nx, ny = (ex / distance, ey / distance) if distance > 0.0 else (1.0, 0.0)
    gap, rate = law.clearance - distance, -(nx * vx + ny * vy)
    slip = nx * vy - ny * vx + w1 * (law.bearing_radius - distance) - w2 * law.bearing_radius
    return JournalMotion(gap, rate, slip, nx, ny, distance)


@kernel
def journal_forces(motion: JournalMotion, impact_speed: float, law: Law) -> tuple[float, float, float]:
    """Return normal force, its elastic part, and friction on the journal along t (N); 0 if it is open."""
    if motion.gap >= 0.0 or impact_speed == 0.0:
        return 0.0, 0.0, 0.0
    elastic = law.stiffness * (-motion.gap) ** law.exponent
    normal = surface_force(elastic, -motion.gap, -motion.rate, impact_speed, law)
    return normal, elastic, friction_force(normal, motion.slip, law)


@kernel
def bearing_load(
    normal: float, friction: float, motion: JournalMotion, arm_x: float, arm_y: float, law: Law
) -> tuple[float, float, float]:
    """Return the force G on the bearing's body (N) and its moment (N m).

    The moment is about the point from which (``arm_x``, ``arm_y``), m, leads to the bearing's centre.
    """
    gx, gy = normal * motion.nx + friction * motion.ny, normal * motion.ny - friction * motion.nx
    px, py = arm_x + law.bearing_radius * motion.nx, arm_y + law.bearing_radius * motion.ny
    return gx, gy, px * gy - py * gx
