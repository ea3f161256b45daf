"""Contacts of any formulation: corners in the guide, the journal in its bearing, and the contacts' memory.

Corners (Eqs. 1-6) are seen in the frame of the guide. Its origin lies on the guide's centre line, x points
across the guide, y along it. Corners are sharp points; each sees the infinite wall on its own side.

The journal (Figs. 7, 8), of radius R_j, sits on the crank's tip; the bearing, of radius R_b = R_j +
clearance, at the start of rod 2. The vector e leads from the bearing's centre to the journal's; the contact
is closed where |e| exceeds the clearance; n = e / |e|, t is n rotated by +90 degrees. Force and friction act
on both bodies in the point of the bearing's surface, its centre + R_b n.

The memory holds impact speeds, for the damping of Eq. 11, and times, for the table of contacts: one record
for each corner of a slider, in the order of ``CORNERS``, and for each journal. Only accepted states update
it, never trial states of an iteration or of a rejected step. Where a side has one contact (``Law.shared``),
it is in the record of the lower corner, whatever corner it is named after.
"""

from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from exudyn_model.kernels import kernel
from exudyn_model.laws import CornerMotion, Law, SideForces, foundation_normals, friction_force, surface_force

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


class Memory:
    """Memory of a contact: SI units, times in s from t = 0."""

    gap: float
    rate: float
    slip: float  # Where friction acts
    normal: float
    friction: float
    closed: float  # 1: inside the wall
    impact_speed: float  # 0: no contact is in progress
    start: float
    name: float  # Row after which the table of contacts names this one
    end: float  # Of the last contact; while its side is in contact, time at which this corner last came out
    # Energy of the contact, or of the side in the record of its lower corner; dissipated powers
    stored: float
    damping_power: float
    friction_power: float
    regime: float  # Of a journal's friction in an iteration: see `laws.slip_regime`


FIELDS = tuple(Memory.__annotations__)
MEMORY = np.dtype([(name, np.float64) for name in FIELDS])

ROUNDED = 2e-15
"""A gap (m) that counts as zero: some roundings of the sums of lengths near 0.6 m that it comes from."""
ROUNDED_SPEED = 4e-15
"""A speed (m/s) that counts as zero at t = 0: some roundings of rates of some m/s."""


def new_contacts(count: int) -> NDArray[Any]:
    """Return the memory of ``count`` contacts before the first state, shape (count,), of ``MEMORY``."""
    return np.zeros(count, MEMORY)


def touches_at_start(gap: float, rate: float) -> bool:
    """Return whether a contact is closed at t = 0: inside its wall, or on it and moving in (m, m/s)."""
    return bool(gap < -ROUNDED or (gap <= ROUNDED and rate < -ROUNDED_SPEED))


def start_side(side: int, lower: CornerMotion, upper: CornerMotion, contacts: NDArray[Any], law: Law) -> None:
    """Begin at t = 0 the contacts of a side with a corner inside its wall, or on it and moving in.

    The one contact of a side has the speed at its resultant, and the name of the deeper corner. On the wall,
    where rounding would decide both, it has speed and name of the faster corner.

    Parameters
    ----------
    side : int
        Row of its lower corner.
    lower, upper : CornerMotion
    contacts : ndarray, shape (n,), of ``MEMORY``
        Changed in place.
    law : Law
    """
    rows = [
        row
        for row, corner in ((side, lower), (side + UPPER, upper))
        if touches_at_start(corner.gap, corner.rate)
    ]
    if not law.shared:
        for row in rows:
            rate = lower.rate if row == side else upper.rate
            contacts["impact_speed"][row], contacts["name"][row] = max(-rate, law.speed_floor), row
    elif rows:
        rate, upper_leads = min(lower.rate, upper.rate), upper.rate < lower.rate
        if min(lower.gap, upper.gap) < -ROUNDED:
            # Not compiled for a single call
            normals = cast(Any, foundation_normals).py_func
            f1, f2 = normals(-lower.gap, -upper.gap, law.side_stiffness)
            rate = (f1 * lower.rate + f2 * upper.rate) / (f1 + f2)
            upper_leads = upper.gap < lower.gap
        name = side + UPPER if upper_leads else side
        contacts["impact_speed"][side], contacts["name"][side] = max(-rate, law.speed_floor), name
