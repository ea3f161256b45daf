"""Contact forces in frozen modes: from the motion of slider and rod 2 to forces, moments and losses.

What a contact does between two events is its *mode*: `memory` > 0 is the impact speed frozen at its touch
(0: no contact), `regime` its friction regime, `clipped` whether the wall would have to pull, `inside` whether
its gap is closed. That differs from `memory` > 0 only under the law foundation, where a contact is a side's
and kept by the corner that touched first. Within one mode the forces are smooth; `reference_model.events`
finds where a mode ends.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from reference_model.compiled import bare, inlined, kernel, overload
from reference_model.constants import Constants, has_sides
from reference_model.contact import (
    corner_arm,
    corner_gap,
    damping_factor,
    elastic_force,
    inward,
    is_damped,
    point_force,
)
from reference_model.foundation import resultant
from reference_model.friction import friction_force
from reference_model.journal import JOURNAL, Bearing
from reference_model.trigonometry import cos_sin

Array = NDArray[np.float64]

CONTACTS = 5
"""Four corners and the journal."""
MEMORY, REGIME, CLIPPED, INSIDE = 0, 1, 2, 3
"""Rows of the modes, shape (MODES, CONTACTS)."""
MODES = 4
GAP, RATE, SLIP, NORMAL, FRICTION = 0, 1, 2, 3, 4
"""Rows of the contact states, shape (5, CONTACTS): m, m/s, m/s, N, N.

Of a side in contact under the law foundation the slip is, at both its corners, that of the resultant's point.
"""


@kernel
def no_contacts() -> Array:
    """Return contact states, shape (5, CONTACTS), of contacts that do not exist: open for ever."""
    contacts = np.zeros((5, CONTACTS))
    contacts[GAP] = np.inf
    return contacts


def touches_with_sides(c: Constants) -> bool:
    """Return whether the slider's contacts are those of whole sides: the law foundation."""
    raise NotImplementedError


@overload(touches_with_sides, by_law=True)
def _touches_with_sides(c) -> Any:  # type: ignore[no-untyped-def]
    marked = has_sides(c.fields)
    return lambda c: marked


def of_side(c: Constants, k: int) -> bool:
    """Return whether contact `k` is one of a whole side, which the corner that touched first keeps."""
    raise NotImplementedError


@overload(of_side, by_law=True)
def _of_side(c, k) -> Any:  # type: ignore[no-untyped-def]
    # An overload of its own: as a call of `touches_with_sides` it made runs under the other laws 5 % slower.
    if has_sides(c.fields):
        return lambda c, k: k != JOURNAL
    return lambda c, k: False


@inlined
def other_corner(k: int) -> int:
    """Return the number of the other corner of a corner's side."""
    return k + 2 if k < 2 else k - 2


@bare
def side_motion(c: Constants, contacts: Array, k: int) -> tuple[float, float, float]:
    """Return corner `k`'s share in the elastic force of its side; gap rate and slip of the resultant's point.

    From gaps (m), rates and slips (m/s) of the corners in `contacts`, shape (5, CONTACTS).
    """
    other = other_corner(k)
    _, share = resultant(c, -contacts[GAP, k], -contacts[GAP, other])
    rest = 1.0 - share
    rate = share * contacts[RATE, k] + rest * contacts[RATE, other]
    return share, rate, share * contacts[SLIP, k] + rest * contacts[SLIP, other]


@inlined
def normal_force(c: Constants, contacts: Array, k: int) -> float:
    """Return the normal force (N) of a contact; of a side's under the law foundation that at both corners."""
    force = contacts[NORMAL, k]
    if of_side(c, k):
        force += contacts[NORMAL, other_corner(k)]
    return float(force)


@bare
def foundation_forces(
    c: Constants, c5: float, s5: float, modes: Array, contacts: Array
) -> tuple[float, float, float, float, float]:
    """Evaluate the sides under the law foundation, as `slider_forces` does, from the corners' motion."""
    Fx = Fy = M = damping = friction = 0.0
    for side in range(2):
        k = side if modes[MEMORY, side] > 0.0 else side + 2
        if modes[MEMORY, k] == 0.0:
            continue
        elastic, _ = resultant(c, -contacts[GAP, k], -contacts[GAP, other_corner(k)])
        share, gap_rate, slip = side_motion(c, contacts, k)
        normal = 0.0
        if modes[CLIPPED, k] == 0.0:
            normal = elastic * damping_factor(c, -gap_rate, modes[MEMORY, k])
        tangential = friction_force(c, normal, slip, int(modes[REGIME, k]))
        for i in (k, other_corner(k)):
            part = share if i == k else 1.0 - share
            rx, ry = corner_arm(c, i, c5, s5)
            contacts[NORMAL, i], contacts[FRICTION, i] = part * normal, part * tangential
            contacts[SLIP, i] = slip
            Fx += inward(i) * part * normal
            Fy += part * tangential
            M += part * (rx * tangential - ry * inward(i) * normal)
        damping -= (normal - elastic) * gap_rate
        friction -= tangential * slip
    return Fx, Fy, M, damping, friction


@inlined
def slider_forces(
    c: Constants, slider: tuple[float, float, float, float, float, float], modes: Array, contacts: Array
) -> tuple[float, float, float, float, float]:
    """Evaluate the four corners.

    Parameters
    ----------
    c
        Constants.
    slider
        x, y, angle and their rates (m, rad, m/s, rad/s).
    modes
        Shape (MODES, CONTACTS).
    contacts
        Written: columns 0-3.

    Returns
    -------
    Fx, Fy, M, damping, friction
        Force (N) and moment about the centre (N m) on the slider; power lost by damping and friction (W).
    """
    x5, _, angle, vx5, vy5, w5 = slider
    c5, s5 = cos_sin(angle)
    for k in range(4):
        rx, ry = corner_arm(c, k, c5, s5)
        contacts[GAP, k] = corner_gap(c, k, x5 + rx)
        contacts[RATE, k] = inward(k) * (vx5 - w5 * ry)
        contacts[SLIP, k] = vy5 + w5 * rx
        contacts[NORMAL, k] = contacts[FRICTION, k] = 0.0
    if touches_with_sides(c):
        return foundation_forces(c, c5, s5, modes, contacts)
    Fx = Fy = M = damping = friction = 0.0
    for k in range(4):
        speed = modes[MEMORY, k]
        if speed > 0.0:
            other = other_corner(k)
            both = modes[MEMORY, other] > 0.0
            rate, slip = -contacts[RATE, k], contacts[SLIP, k]
            elastic = elastic_force(c, -contacts[GAP, k], -contacts[GAP, other], both)
            normal = elastic
            if is_damped(c, both):
                normal = 0.0 if modes[CLIPPED, k] > 0.0 else elastic * damping_factor(c, rate, speed)
            tangential = friction_force(c, normal, slip, int(modes[REGIME, k]))
            rx, ry = corner_arm(c, k, c5, s5)
            Nx = inward(k) * normal
            contacts[NORMAL, k], contacts[FRICTION, k] = normal, tangential
            Fx += Nx
            Fy += tangential
            M += rx * tangential - ry * Nx
            damping += (normal - elastic) * rate
            friction -= tangential * slip
    return Fx, Fy, M, damping, friction


@kernel
def bearing_forces(
    c: Constants, bearing: Bearing, modes: Array, contacts: Array
) -> tuple[float, float, float, float]:
    """Evaluate the journal's contact at A.

    Parameters
    ----------
    c, bearing, modes
        Constants, the contact's state, modes (MODES, CONTACTS).
    contacts
        Written: column JOURNAL.

    Returns
    -------
    Gx, Gy, damping, friction
        Force of the crank on rod 2 at the point of contact (N); power lost by damping and friction (W).
    """
    contacts[GAP, JOURNAL], contacts[RATE, JOURNAL] = bearing.gap, bearing.rate
    contacts[SLIP, JOURNAL] = bearing.slip
    contacts[NORMAL, JOURNAL] = contacts[FRICTION, JOURNAL] = 0.0
    if modes[MEMORY, JOURNAL] == 0.0:
        return 0.0, 0.0, 0.0, 0.0
    elastic = point_force(c.Kj, c.n, -bearing.gap)
    normal = 0.0
    if modes[CLIPPED, JOURNAL] == 0.0:
        normal = elastic * damping_factor(c, -bearing.rate, modes[MEMORY, JOURNAL])
    # Friction brakes the journal and drags the bearing along with it.
    drag = -friction_force(c, normal, bearing.slip, int(modes[REGIME, JOURNAL]))
    contacts[NORMAL, JOURNAL], contacts[FRICTION, JOURNAL] = normal, drag
    Gx, Gy = normal * bearing.nx - drag * bearing.ny, normal * bearing.ny + drag * bearing.nx
    return Gx, Gy, -(normal - elastic) * bearing.rate, drag * bearing.slip
