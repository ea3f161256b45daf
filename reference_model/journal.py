"""Clearance at the crank pin A: a journal on the crank in a bearing of rod 2 (Figs. 7 and 8).

The paper gives no formulas. e runs from the bearing's centre A' to the journal's A; the gap is c - |e|, the
normal n = e / |e|. Both forces act at the bearing's surface point P = A' + R_b n, with the point law of Eqs.
9-11 for the conformal pair and the friction of Eqs. 12-13 on the relative velocity of the two materials at P.
"""

import math

from reference_model.compiled import inlined
from reference_model.contact import FRICTION, GAP, JOURNAL, MEMORY, NORMAL, RATE, SLIP, STORED, point_contact
from reference_model.laws import point_force
from reference_model.linkage import Array
from reference_model.parameters import Law


@inlined
def journal_motion(
    law: Law, ex: float, ey: float, vx: float, vy: float, w1: float, w2: float, contacts: Array
) -> tuple[float, float]:
    """Write gap, rate and slip of the journal; return the normal n.

    Parameters
    ----------
    law
        The contact.
    ex, ey, vx, vy
        e and its rate, m, m/s.
    w1, w2
        Rates of crank and rod 2, rad/s.
    contacts
        Written: column JOURNAL.
    """
    e = math.sqrt(ex * ex + ey * ey)
    if e == 0.0:  # centred: no direction yet; the gap closes at the speed of the centres
        contacts[GAP + JOURNAL], contacts[SLIP + JOURNAL] = law.pin_clearance, 0.0
        contacts[RATE + JOURNAL] = -math.sqrt(vx * vx + vy * vy)
        return 1.0, 0.0
    nx, ny = ex / e, ey / e
    contacts[GAP + JOURNAL], contacts[RATE + JOURNAL] = law.pin_clearance - e, -(nx * vx + ny * vy)
    # P relative to the journal's centre is (R_b - |e|) n, relative to the bearing's R_b n.
    contacts[SLIP + JOURNAL] = nx * vy - ny * vx + w1 * (law.bearing_radius - e) - w2 * law.bearing_radius
    return nx, ny


@inlined
def journal_force(
    law: Law, modes: Array, nx: float, ny: float, contacts: Array
) -> tuple[float, float, float, float]:
    """Write the journal's forces, from its motion.

    Returns
    -------
    Gx, Gy, damping, friction
        Force of the crank on rod 2 at P (N); power lost by damping and friction (W).
    """
    contacts[NORMAL + JOURNAL] = contacts[FRICTION + JOURNAL] = contacts[STORED + JOURNAL] = 0.0
    if modes[MEMORY + JOURNAL] == 0.0:
        return 0.0, 0.0, 0.0, 0.0
    gap, rate, slip = contacts[GAP + JOURNAL], contacts[RATE + JOURNAL], contacts[SLIP + JOURNAL]
    elastic = point_force(law.Kj, law.n, -gap)
    normal, tangential = point_contact(law, modes, JOURNAL, elastic, -gap, rate, slip)
    contacts[NORMAL + JOURNAL], contacts[FRICTION + JOURNAL] = normal, tangential
    contacts[STORED + JOURNAL] = elastic * max(-gap, 0.0) / (law.n + 1.0)
    # `tangential` brakes the journal along t = (-n_y, n_x), and drags the bearing along with it.
    Gx, Gy = normal * nx + tangential * ny, normal * ny - tangential * nx
    return Gx, Gy, -(normal - elastic) * rate, -tangential * slip
