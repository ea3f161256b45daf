"""Clearance at the crank pin A: a journal on the crank in a bearing of rod 2 (Figs. 7 and 8).

The paper gives no formulas. e runs from the bearing's centre to the journal's; the gap is c - |e|, the
normal n = e / |e|. Both forces act at the bearing's surface point P = A_bearing + R_b n, with the point law
of Eqs. 9-11 for the conformal pair and the friction of Eqs. 12-13 on the relative velocity of the two
materials at P.
"""

import math
from typing import NamedTuple

from reference_model.compiled import kernel
from reference_model.constants import Constants

JOURNAL = 4
"""Number of this contact, after the four corners."""


class Bearing(NamedTuple):
    """The journal's contact in one state; m, m/s."""

    gap: float
    rate: float
    slip: float
    """Of the journal's material along t = (-n_y, n_x), relative to the bearing's."""
    nx: float
    ny: float
    Px: float
    """Point of contact in the fixed frame."""
    Py: float


@kernel
def bearing_contact(
    c: Constants, t: float, Ax: float, Ay: float, vAx: float, vAy: float, w2: float
) -> Bearing:
    """Return the contact between the driven crank's journal and a bearing at A = (Ax, Ay).

    Parameters
    ----------
    c, t
        Constants, time (s).
    Ax, Ay, vAx, vAy
        Centre of the bearing and its velocity, m, m/s.
    w2
        Angular velocity of rod 2, rad/s.
    """
    c1, s1 = math.cos(c.theta0 + c.omega * t), math.sin(c.theta0 + c.omega * t)
    ex, ey = c.L1 * c1 - Ax, c.L1 * s1 - Ay
    vx, vy = -c.L1 * c.omega * s1 - vAx, c.L1 * c.omega * c1 - vAy
    e = math.sqrt(ex * ex + ey * ey)
    if e == 0.0:  # centred: no direction yet; the gap closes at the speed of the centres
        speed = math.sqrt(vx * vx + vy * vy)
        return Bearing(c.pin_clearance, -speed, 0.0, 1.0, 0.0, Ax + c.bearing_radius, Ay)
    nx, ny = ex / e, ey / e
    # P relative to the journal's centre is (R_b - |e|) n, relative to the bearing's R_b n.
    slip = -ny * vx + nx * vy + c.omega * (c.bearing_radius - e) - w2 * c.bearing_radius
    rate = -(nx * vx + ny * vy)
    return Bearing(
        c.pin_clearance - e, rate, slip, nx, ny, Ax + c.bearing_radius * nx, Ay + c.bearing_radius * ny
    )
