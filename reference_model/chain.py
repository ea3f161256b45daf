"""Clearance at the crank pin A: rod 2, rocker, rod 4 and slider as an open chain from the pivot H.

Free coordinates theta_2, theta_3 and, where the slider has clearance too, theta_4, theta_5. The chain is cut
at A, where journal and bearing only touch, so its equations have no constraint:

    rod 2     (J2 + m2 b^2) a2 - m2 b Ls3 (n2 . n3) a3                            = Q2,  b = L2 - Ls2
    rocker    -m2 b Ls3 (n2 . n3) a2 + (J3 + (m2 + m3) Ls3^2 + (m4 + m5) L3^2) a3
              + S4 L3 (n3 . n4) a4                                               = Q3
    rod 4     S4 L3 (n3 . n4) a3 + I4 a4                                         = Q4
    slider    J5 a5                                                              = Q5

with a_i = theta_i'' and Q_i the moments of forces less centrifugal terms. An ideal slider ties theta_4 to
theta_3, w4 = kappa w3; the third and fourth equation are then added with weights 1 and kappa.

The paper gives no formulas for the journal (Figs. 7 and 8). e runs from the bearing's centre A' to the
journal's A; the gap is c - |e|, the normal n = e / |e|. Both forces act at the bearing's surface point
P = A' + R_b n, with the point law of Eqs. 9-11 for the conformal pair and the friction of Eqs. 12-13 on the
relative velocity of the two materials at P.
"""

from typing import Any, NamedTuple

import numpy as np

from reference_model import linkage, workpiece
from reference_model.compiled import inlined
from reference_model.contact import (
    Pose,
    corner_motion,
    journal_force,
    journal_motion,
    slider_forces,
    write_tail,
)
from reference_model.linkage import Array, Mechanism
from reference_model.parameters import Contact
from reference_model.state import Nodes, Records, Touch
from reference_model.trigonometry import cos_sin
from reference_model.workpiece import Load

ideal_rod4 = inlined(linkage.ideal_rod4)
load_force = inlined(workpiece.load_force)


class Chain(NamedTuple):
    """The formulation cut at A: a state holds theta_2 .. theta_5 (ideal slider: two), rates, integrals."""

    mechanism: Mechanism
    contacts: Records
    """Contacts of the slider's corners, if it has clearance, and last that of the journal."""
    load: Load
    ideal_slider: bool


Rod = tuple[float, float, float]
"""Cosine and sine of a rod's angle, and its rate (rad/s)."""


@inlined
def rods(model: Chain, y: Array) -> tuple[Rod, Rod, Rod, float, float, float, float]:
    """Return rods 2 to 4, theta_5 and its rate, and kappa and mu of `linkage.ideal_rod4`."""
    n = 2 if model.ideal_slider else 4
    c2, s2 = cos_sin(y[0])
    c3, s3 = cos_sin(y[1])
    w2, w3 = y[n], y[n + 1]
    if model.ideal_slider:
        c4, s4, kappa, mu = ideal_rod4(model.mechanism, c3, s3, w3)
        return (c2, s2, w2), (c3, s3, w3), (c4, s4, kappa * w3), 0.0, 0.0, kappa, mu
    c4, s4 = cos_sin(y[2])
    return (c2, s2, w2), (c3, s3, w3), (c4, s4, y[6]), y[3], y[7], 0.0, 0.0


@inlined
def slider_pose(m: Mechanism, rocker: Rod, rod4: Rod, angle: float, w5: float) -> Pose:
    """Return the motion of the slider, whose centre is H + L3 u3 + L4 u4."""
    (c3, s3, w3), (c4, s4, w4) = rocker, rod4
    x, y = m.Hx + m.L3 * c3 + m.L4 * c4, m.Hy + m.L3 * s3 + m.L4 * s4
    return x, y, angle, -m.L3 * w3 * s3 - m.L4 * w4 * s4, m.L3 * w3 * c3 + m.L4 * w4 * c4, w5


@inlined
def crank_pin_motion(
    m: Mechanism, journal: Contact, t: float, rods: tuple[Rod, Rod], touch: Touch
) -> tuple[float, ...]:
    """Write the motion of the contact at A; return n and the point P (m) relative to A' and to O.

    The centre of the bearing is A' = H + Ls3 u3 - L2 u2; `rods` are rod 2 and the rocker.
    """
    (c2, s2, w2), (c3, s3, w3) = rods
    c1, s1 = cos_sin(m.theta0 + m.omega * t)
    x, y = m.Hx + m.Ls3 * c3 - m.L2 * c2, m.Hy + m.Ls3 * s3 - m.L2 * s2
    vx = -m.L1 * m.omega * s1 + m.Ls3 * w3 * s3 - m.L2 * w2 * s2
    vy = m.L1 * m.omega * c1 - m.Ls3 * w3 * c3 + m.L2 * w2 * c2
    e = m.L1 * c1 - x, m.L1 * s1 - y
    nx, ny = journal_motion(journal, e, (vx, vy), (m.omega, w2), touch)
    px, py = journal.radius * nx, journal.radius * ny
    return nx, ny, px, py, x + px, y + py


def motion(model: Chain, t: float, i: int, modes: Records, nodes: Nodes) -> None:
    """Write gaps, rates and slips of a state."""
    m, contacts, touches = model.mechanism, model.contacts, nodes.touches[i]
    rod2, rocker, rod4, angle, w5, _, _ = rods(model, nodes.y[i])
    if not model.ideal_slider:
        corner_motion(contacts, slider_pose(m, rocker, rod4, angle, w5), touches)
    pin = contacts.size - 1
    crank_pin_motion(m, contacts[pin], t, (rod2, rocker), touches[pin])


def tabulate(model: Chain, t: float, h: float, shares: Array) -> None:
    """Do nothing: the crank is the only part of this motion that is a function of time alone."""


def derivative(model: Chain, t: float, i: int, modes: Records, nodes: Nodes) -> None:
    """Write the derivatives of coordinates and rates; see `formulations.derivative`."""
    y, dy, slider, touches = nodes.y[i], nodes.dy[i], nodes.slider[i], nodes.touches[i]
    contacts, pin = model.contacts, model.contacts.size - 1
    m, n = model.mechanism, 2 if model.ideal_slider else 4
    rod2, rocker, rod4, angle, w5, kappa, mu = rods(model, y)
    (c2, s2, w2), (c3, s3, w3), (c4, s4, w4) = rod2, rocker, rod4
    pose = slider_pose(m, rocker, rod4, angle, w5)
    Fx = Fy = M = damping = friction = 0.0
    if not model.ideal_slider:
        Fx, Fy, M, damping, friction = slider_forces(contacts, pose, modes, touches)
    if pose[1] < model.load.surface:
        Fy += load_force(model.load, pose[1])
    nx, ny, px, py, Px, Py = crank_pin_motion(m, contacts[pin], t, (rod2, rocker), touches[pin])
    Gx, Gy, damping_A, friction_A = journal_force(contacts[pin], modes[pin], nx, ny, touches[pin])
    b, m45 = m.L2 - m.Ls2, m.m4 + m.m5
    # Weight and centrifugal force of rod 2 act at its centroid H + Ls3 u3 - b u2, of rod 4 and slider at C.
    f2x = m.m2 * (m.Ls3 * w3 * w3 * c3 - b * w2 * w2 * c2)
    f2y = m.m2 * (m.Ls3 * w3 * w3 * s3 - b * w2 * w2 * s2 - m.gravity)
    f4x, f4y = Fx + m.S4 * w4 * w4 * c4, Fy + m.S4 * w4 * w4 * s4 - m45 * m.gravity
    # The material point P of rod 2 moves with -L2 n2 + z x (P - A') per unit w2, and with Ls3 n3 per unit w3.
    Q2 = -b * (c2 * f2y - s2 * f2x) + px * Gy - py * Gx - m.L2 * (c2 * Gy - s2 * Gx)
    Q3 = m.Ls3 * (c3 * (f2y + Gy - m.m3 * m.gravity) - s3 * (f2x + Gx)) + m.L3 * (c3 * f4y - s3 * f4x)
    end_x = m.S4 * m.L3 * w3 * w3 * c3 + m.L4 * Fx
    end_y = m.S4 * (m.L3 * w3 * w3 * s3 - m.gravity) + m.L4 * Fy
    Q4 = c4 * end_y - s4 * end_x
    M22, M23 = m.J2 + m.m2 * b * b, -m.m2 * b * m.Ls3 * (c2 * c3 + s2 * s3)
    M33 = m.J3 + (m.m2 + m.m3) * m.Ls3 * m.Ls3 + m45 * m.L3 * m.L3
    M34 = m.S4 * m.L3 * (c3 * c4 + s3 * s4)
    if model.ideal_slider:
        Q = Q3 + kappa * Q4 - (M34 + kappa * m.I4) * mu
        a3 = (Q - M23 * Q2 / M22) / (M33 + kappa * (2.0 * M34 + kappa * m.I4) - M23 * M23 / M22)
        a4 = kappa * a3 + mu
    else:
        a3 = (Q3 - M23 * Q2 / M22 - M34 * Q4 / m.I4) / (M33 - M23 * M23 / M22 - M34 * M34 / m.I4)
        a4 = (Q4 - M34 * a3) / m.I4
        dy[2], dy[3], dy[6], dy[7] = w4, w5, a4, M / m.J5
    dy[0], dy[1], dy[n], dy[n + 1] = w2, w3, (Q2 - M23 * a3) / M22, a3
    slider.x, slider.y, slider.angle, slider.vx, slider.vy, slider.omega = pose
    slider.ax = -m.L3 * (a3 * s3 + w3 * w3 * c3) - m.L4 * (a4 * s4 + w4 * w4 * c4)
    slider.ay = m.L3 * (a3 * c3 - w3 * w3 * s3) + m.L4 * (a4 * c4 - w4 * w4 * s4)
    slider.alpha = 0.0 if model.ideal_slider else dy[7]
    # The crank turns uniformly: the motor balances its weight and the bearing's reaction at P.
    c1, _ = cos_sin(m.theta0 + m.omega * t)
    torque = m.m1 * m.gravity * m.Ls1 * c1 + Px * Gy - Py * Gx
    write_tail(dy, touches, torque * m.omega, damping + damping_A, friction + friction_A)


def journal_centre(m: Mechanism, bodies: Array) -> tuple[Any, Any]:
    """Return e = A - A' (m) from the motion of all bodies, shape (5, 9, n): journal relative to bearing."""
    theta1, theta2, theta3 = bodies[0, 2], bodies[1, 2], bodies[2, 2]
    x = m.L1 * np.cos(theta1) - (m.Hx + m.Ls3 * np.cos(theta3) - m.L2 * np.cos(theta2))
    y = m.L1 * np.sin(theta1) - (m.Hy + m.Ls3 * np.sin(theta3) - m.L2 * np.sin(theta2))
    return x, y


def journal_reaction(
    m: Mechanism, radius: float, bodies: Array, normal: Array, friction: Array
) -> tuple[Any, ...]:
    """Return G (N), the force of the journal on rod 2, and its point P (m); the bearing has `radius` (m)."""
    ex, ey = journal_centre(m, bodies)
    size = np.hypot(ex, ey)
    nx, ny = (
        np.divide(e, size, out=np.full_like(size, start), where=size > 0.0)
        for e, start in ((ex, 1.0), (ey, 0.0))
    )
    x, y = m.L1 * np.cos(bodies[0, 2]) - ex, m.L1 * np.sin(bodies[0, 2]) - ey
    P = x + radius * nx, y + radius * ny
    return normal * nx + friction * ny, normal * ny - friction * nx, *P
