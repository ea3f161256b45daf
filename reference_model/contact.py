"""Forces and losses at the slider's corners and sides (Eqs. 1-6), and of a journal, in frozen modes.

A model has a list of contacts, each with its own law (`parameters.Contact`). Each corner meets only the
infinite wall on its side; the two corners of a side have one law. Each contact has a `state.Mode` that is
constant between two events; `reference_model.events` finds the end of a mode.
"""

import math

from reference_model.compiled import inlined
from reference_model.laws import damped_force, friction_force, point_force, side_force
from reference_model.linkage import Array
from reference_model.parameters import PAPER_SWITCHING, Contact
from reference_model.state import WORKS, Mode, Records, Touch
from reference_model.trigonometry import cos_sin

Pose = tuple[float, float, float, float, float, float]
"""Position x, y (m) and angle (rad) of the slider, and their rates (m/s, rad/s)."""


@inlined
def corner_arm(corner: Contact, c5: float, s5: float) -> tuple[float, float]:
    """Return the arm A(theta_5) s of a corner, from the slider's centre in the fixed frame (Eq. 2), m."""
    return c5 * corner.x - s5 * corner.y, s5 * corner.x + c5 * corner.y


@inlined
def corner_motion(contacts: Records, pose: Pose, touches: Records) -> tuple[float, float]:
    """Write gaps, rates and slips of the corners (Eqs. 3-6); return cosine and sine of the angle."""
    x5, _, angle, vx5, vy5, w5 = pose
    c5, s5 = cos_sin(angle)
    for k in range(contacts.size):
        corner, touch = contacts[k], touches[k]
        if corner.other >= 0:
            rx, ry = corner_arm(corner, c5, s5)
            touch.gap = corner.inward * (x5 + rx - corner.wall)
            touch.rate = corner.inward * (vx5 - w5 * ry)
            touch.slip = vy5 + w5 * rx
    return c5, s5


@inlined
def side_motion(contact: Contact, one: Touch, other: Touch) -> tuple[float, float, float]:
    """Return corner `one`'s share in the force of its side, and gap rate and slip of the resultant's point.

    Where neither corner is inside there is no force, and the deeper one has the share of a touch: all.
    """
    d1, d2 = -one.gap, -other.gap
    f1, f2, _ = side_force(contact, d1, d2, contact.one_side)
    share = f1 / (f1 + f2) if f1 + f2 > 0.0 else (1.0 if d1 > d2 else 0.0)
    rate = share * one.rate + (1.0 - share) * other.rate
    return share, rate, share * one.slip + (1.0 - share) * other.slip


@inlined
def point_contact(
    contact: Contact, mode: Mode, elastic: float, depth: float, gap_rate: float, slip: float
) -> tuple[float, float]:
    """Return normal force and friction (N) of a contact from its elastic force, in its mode (Eqs. 9-13)."""
    if mode.clipped:
        return 0.0, 0.0
    normal = damped_force(contact, elastic, depth, -gap_rate, mode.speed)
    return normal, friction_force(contact, normal, slip, mode.regime)


@inlined
def slider_forces(
    contacts: Records, pose: Pose, modes: Records, touches: Records
) -> tuple[float, float, float, float, float]:
    """Write the states of the corners; return the force of both sides on the slider and the lost power.

    These are Fx, Fy (N), the moment about the centre (N m), and the power lost by damping and friction (W).
    """
    c5, s5 = corner_motion(contacts, pose, touches)
    Fx = Fy = M = damping = friction = 0.0
    for lower in range(contacts.size):
        contact, upper = contacts[lower], contacts[lower].other
        if upper < lower:
            continue
        one, other = touches[lower], touches[upper]
        for k in (lower, upper):
            touches[k].normal = touches[k].friction = touches[k].stored = 0.0
        closed1, closed2 = modes[lower].speed > 0.0, modes[upper].speed > 0.0
        if not closed1 and not closed2:
            continue
        d1, d2 = -one.gap, -other.gap
        if contact.one_side:
            f1, f2, one.stored = side_force(contact, d1, d2, contact.one_side)
            share, gap_rate, slip = side_motion(contact, one, other)
            keeper = lower if closed1 else upper
            normal, tangential = point_contact(contact, modes[keeper], f1 + f2, max(d1, d2), gap_rate, slip)
            one.normal, one.friction = share * normal, share * tangential
            other.normal, other.friction = (1.0 - share) * normal, (1.0 - share) * tangential
            damping -= (normal - f1 - f2) * gap_rate
            friction -= tangential * slip
        else:
            both = closed1 and closed2
            f1, f2, one.stored = side_force(contact, d1 if closed1 else 0.0, d2 if closed2 else 0.0, both)
            for k in (lower, upper):
                touch, mode = touches[k], modes[k]
                if mode.speed > 0.0:
                    elastic = f1 if k == lower else f2
                    if both and contact.law == PAPER_SWITCHING:
                        normal = elastic
                        tangential = friction_force(contact, elastic, touch.slip, mode.regime)
                    else:
                        normal, tangential = point_contact(
                            contact, mode, elastic, -touch.gap, touch.rate, touch.slip
                        )
                    touch.normal, touch.friction = normal, tangential
                    damping -= (normal - elastic) * touch.rate
                    friction -= tangential * touch.slip
        for k in (lower, upper):
            rx, ry = corner_arm(contacts[k], c5, s5)
            Nx = contacts[k].inward * touches[k].normal
            Fx += Nx
            Fy += touches[k].friction
            M += rx * touches[k].friction - ry * Nx
    return Fx, Fy, M, damping, friction


@inlined
def journal_motion(
    journal: Contact, e: tuple[float, float], v: tuple[float, float], w: tuple[float, float], touch: Touch
) -> tuple[float, float]:
    """Write gap, rate and slip of the journal; return its normal n.

    `e` (m) and its rate `v` (m/s) lead from bearing to journal; `w` are the rates of journal and bearing
    (rad/s).
    """
    size = math.sqrt(e[0] * e[0] + e[1] * e[1])
    if size == 0.0:  # centred: no direction yet; the gap closes at the speed of the centres
        touch.gap, touch.slip = journal.clearance, 0.0
        touch.rate = -math.sqrt(v[0] * v[0] + v[1] * v[1])
        return 1.0, 0.0
    nx, ny = e[0] / size, e[1] / size
    touch.gap, touch.rate = journal.clearance - size, -(nx * v[0] + ny * v[1])
    # P relative to the journal's centre is (R_b - |e|) n, relative to the bearing's R_b n.
    touch.slip = nx * v[1] - ny * v[0] + w[0] * (journal.radius - size) - w[1] * journal.radius
    return nx, ny


@inlined
def journal_force(
    journal: Contact, mode: Mode, nx: float, ny: float, touch: Touch
) -> tuple[float, float, float, float]:
    """Write the journal's forces, from its gap, rate and slip.

    Return the force on the bearing at P, x and y (N), and the power lost by damping and friction (W).
    """
    touch.normal = touch.friction = touch.stored = 0.0
    if mode.speed == 0.0:
        return 0.0, 0.0, 0.0, 0.0
    depth = -touch.gap
    elastic = point_force(journal.K, journal.n, depth)
    normal, tangential = point_contact(journal, mode, elastic, depth, touch.rate, touch.slip)
    touch.normal, touch.friction = normal, tangential
    touch.stored = elastic * max(depth, 0.0) / (journal.n + 1.0)
    # `tangential` brakes the journal along t = (-n_y, n_x), and drags the bearing along with it.
    Gx, Gy = normal * nx + tangential * ny, normal * ny - tangential * nx
    return Gx, Gy, -(normal - elastic) * touch.rate, -tangential * touch.slip


@inlined
def normal_force(contacts: Records, touches: Records, k: int) -> float:
    """Return the normal force (N) of a contact; if a side is one contact, that of both its corners."""
    force: float = touches[k].normal
    if contacts[k].one_side:
        force += touches[contacts[k].other].normal
    return force


@inlined
def write_tail(dy: Array, touches: Records, power: float, damping: float, friction: float) -> None:
    """Write the derivatives of impulses and works: normal forces (N), power of drive and losses (W)."""
    works = dy.size - WORKS
    for k in range(touches.size):
        dy[works - touches.size + k] = touches[k].normal
    dy[works], dy[works + 1], dy[works + 2] = power, damping, friction
