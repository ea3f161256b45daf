"""The slider's corners and sides in frozen modes: from its motion to forces, moment, losses (Eqs. 1-6).

Corners are numbered ll, lr, ul, ur: lower/upper in the slider's y, left/right in its x; number 4 is the
journal. Each corner sees only the infinite wall on its side. What a contact does between two events is its
*mode*: `MEMORY` > 0 is the impact speed frozen at its touch (0: no contact), `REGIME` its friction regime,
`CLIPPED` whether the wall would have to pull, `INSIDE` whether its gap is closed. That differs from
`MEMORY` > 0 only where a side is one contact (`laws.touches_as_one`), kept by the corner that touched first.
Within one mode the forces are smooth; `reference_model.events` finds where a mode ends.
"""

import numpy as np

from reference_model.compiled import inlined
from reference_model.friction import friction_force
from reference_model.laws import damped_force, is_damped, resultant_share, side_force, touches_as_one
from reference_model.linkage import Array
from reference_model.parameters import Law
from reference_model.trigonometry import cos_sin

CONTACTS = 5
"""Four corners and the journal."""
JOURNAL = 4
MEMORY, REGIME, CLIPPED, INSIDE = range(0, 4 * CONTACTS, CONTACTS)
"""Where each part of the modes begins, shape (MODES,): that of contact k stands k later."""
MODES = 4 * CONTACTS
RATE, SLIP, GAP, NORMAL, FRICTION, STORED = range(0, 6 * CONTACTS, CONTACTS)
"""Where each part of the contact states begins, shape (STATES,): m/s, m/s, m, N, N, J; the gap is positive
when open."""
STATES = 6 * CONTACTS

WORKS = 3
"""Integrals behind the impulses: work of the drive, loss by damping, loss by friction, J."""
TAIL = CONTACTS + WORKS
"""Of a state, behind its coordinates and rates: impulses of the contacts (N s), works (J)."""

Pose = tuple[float, float, float, float, float, float]
"""x, y, angle of the slider and their rates; m, rad, m/s, rad/s."""


def no_contacts() -> Array:
    """Return contact states of contacts that do not exist: open for ever."""
    contacts = np.zeros(STATES)
    contacts[GAP : GAP + CONTACTS] = np.inf
    return contacts


@inlined
def other_corner(k: int) -> int:
    """Return the number of the other corner of a corner's side."""
    return k + 2 if k < 2 else k - 2


@inlined
def is_of_side(law: Law, k: int) -> bool:
    """Return whether contact `k` is one of a whole side."""
    return k != JOURNAL and touches_as_one(law)


@inlined
def stiffness(law: Law, k: int) -> float:
    """Return the stiffness of contact `k` as a point, N/m^n."""
    return law.Kj if k == JOURNAL else law.K


@inlined
def inward(k: int) -> float:
    """Return the x component of the wall's normal into the guide: +1 at the left wall, -1 at the right."""
    return 1.0 if k % 2 == 0 else -1.0


@inlined
def corner_arm(law: Law, k: int, c5: float, s5: float) -> tuple[float, float]:
    """Return the arm A(theta_5) s of a corner, from the slider's centre in the fixed frame (Eq. 2), m."""
    sx = -inward(k) * law.half_width
    sy = -law.half_length if k < 2 else law.half_length
    return c5 * sx - s5 * sy, s5 * sx + c5 * sy


@inlined
def corner_motion(law: Law, pose: Pose, contacts: Array) -> tuple[float, float]:
    """Write gaps, rates and slips of the corners (Eqs. 3-6); return cosine and sine of the angle."""
    x5, _, angle, vx5, vy5, w5 = pose
    c5, s5 = cos_sin(angle)
    for k in range(JOURNAL):
        rx, ry = corner_arm(law, k, c5, s5)
        contacts[GAP + k] = x5 + rx - law.wall_left if k % 2 == 0 else law.wall_right - (x5 + rx)
        contacts[RATE + k] = inward(k) * (vx5 - w5 * ry)
        contacts[SLIP + k] = vy5 + w5 * rx
    return c5, s5


@inlined
def side_motion(law: Law, contacts: Array, k: int) -> tuple[float, float, float]:
    """Return corner `k`'s share in the force of its side, and gap rate and slip of the resultant's point."""
    m = other_corner(k)
    d1, d2 = -contacts[GAP + k], -contacts[GAP + m]
    f1, f2, _ = side_force(law, d1, d2, True)
    share = resultant_share(f1, f2, d1, d2)
    rate = share * contacts[RATE + k] + (1.0 - share) * contacts[RATE + m]
    return share, rate, share * contacts[SLIP + k] + (1.0 - share) * contacts[SLIP + m]


@inlined
def point_contact(
    law: Law, modes: Array, k: int, elastic: float, depth: float, gap_rate: float, slip: float
) -> tuple[float, float]:
    """Return normal force and friction (N) of contact `k` from its elastic force, in its mode (Eqs. 9-13)."""
    if modes[CLIPPED + k] > 0.0:
        return 0.0, 0.0
    normal = damped_force(law, elastic, depth, -gap_rate, modes[MEMORY + k])
    return normal, friction_force(law, normal, slip, modes[REGIME + k])


@inlined
def slider_forces(
    law: Law, pose: Pose, modes: Array, contacts: Array
) -> tuple[float, float, float, float, float]:
    """Evaluate both sides of the slider.

    Parameters
    ----------
    law, pose, modes
        The contact; the slider's motion; modes, shape (MODES,).
    contacts
        Written: columns 0-3, shape (STATES,).

    Returns
    -------
    Fx, Fy, M, damping, friction
        Force (N) and moment about the centre (N m) on the slider; power lost by damping and friction (W).
    """
    c5, s5 = corner_motion(law, pose, contacts)
    Fx = Fy = M = damping = friction = 0.0
    for side in range(2):
        upper = side + 2
        memory1, memory2 = modes[MEMORY + side], modes[MEMORY + upper]
        for k in (side, upper):
            contacts[NORMAL + k] = contacts[FRICTION + k] = contacts[STORED + k] = 0.0
        if memory1 == 0.0 and memory2 == 0.0:
            continue
        both = memory1 > 0.0 and memory2 > 0.0
        d1, d2 = -contacts[GAP + side], -contacts[GAP + upper]
        if touches_as_one(law):
            f1, f2, contacts[STORED + side] = side_force(law, d1, d2, True)
            share, gap_rate, slip = side_motion(law, contacts, side)
            keeper = side if memory1 > 0.0 else upper
            normal, tangential = point_contact(law, modes, keeper, f1 + f2, max(d1, d2), gap_rate, slip)
            contacts[NORMAL + side], contacts[FRICTION + side] = share * normal, share * tangential
            contacts[NORMAL + upper] = (1.0 - share) * normal
            contacts[FRICTION + upper] = (1.0 - share) * tangential
            damping -= (normal - f1 - f2) * gap_rate
            friction -= tangential * slip
        else:
            f1, f2, contacts[STORED + side] = side_force(
                law, d1 if memory1 > 0.0 else 0.0, d2 if memory2 > 0.0 else 0.0, both
            )
            for k in (side, upper):
                if modes[MEMORY + k] > 0.0:
                    elastic, gap_rate, slip = f1 if k == side else f2, contacts[RATE + k], contacts[SLIP + k]
                    if is_damped(law, both):
                        depth = -contacts[GAP + k]
                        normal, tangential = point_contact(law, modes, k, elastic, depth, gap_rate, slip)
                    else:
                        normal, tangential = elastic, friction_force(law, elastic, slip, modes[REGIME + k])
                    contacts[NORMAL + k], contacts[FRICTION + k] = normal, tangential
                    damping -= (normal - elastic) * gap_rate
                    friction -= tangential * slip
        for k in (side, upper):
            rx, ry = corner_arm(law, k, c5, s5)
            Nx = inward(k) * contacts[NORMAL + k]
            Fx += Nx
            Fy += contacts[FRICTION + k]
            M += rx * contacts[FRICTION + k] - ry * Nx
    return Fx, Fy, M, damping, friction


@inlined
def normal_force(law: Law, contacts: Array, k: int) -> float:
    """Return the normal force (N) of a contact; of a side's that at both corners."""
    force: float = contacts[NORMAL + k]
    if is_of_side(law, k):
        force += contacts[NORMAL + other_corner(k)]
    return force


@inlined
def write_tail(dy: Array, contacts: Array, power: float, damping: float, friction: float) -> None:
    """Write the derivatives of impulses and works: normal forces (N), powers of drive and losses (W)."""
    tail = dy.size - TAIL
    for k in range(CONTACTS):
        dy[tail + k] = contacts[NORMAL + k]
    dy[tail + CONTACTS], dy[tail + CONTACTS + 1], dy[tail + CONTACTS + 2] = power, damping, friction
