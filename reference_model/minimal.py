"""Clearance at the slider: two free coordinates behind the driven four-bar.

With ideal revolutes and a driven crank the rocker's tip C is a known function of time, and only theta_4 and
theta_5 are free:

    I4 theta4'' = -S4 n4 . (C'' - g) + L4 n4 . F,   n4 = (-s4, c4)
    J5 theta5'' = M

F and M are the force and moment of all corners, and of a workpiece, on the slider. These equations are the
projection of Eqs. 14-21 onto their constraints.
"""

from typing import NamedTuple

import numpy as np

from reference_model import linkage, workpiece
from reference_model.compiled import inlined
from reference_model.contact import Pose, corner_motion, slider_forces, write_tail
from reference_model.linkage import Array, Mechanism
from reference_model.state import NODES, Nodes, Records
from reference_model.trigonometry import cos_sin
from reference_model.workpiece import Load

four_bar = inlined(linkage.four_bar)
load_force = inlined(workpiece.load_force)
Tip = tuple[float, float, float, float, float, float]
"""Position (m), velocity (m/s) and acceleration (m/s^2) of the rocker's tip C, each x and y."""


class Minimal(NamedTuple):
    """The formulation in theta_4 and theta_5: a state holds these, their rates, and integrals."""

    mechanism: Mechanism
    contacts: Records
    load: Load
    table: Array
    """Cosine, sine of the crank's angle and `Tip` at the nodes of a step (`tabulate`), shape (8, nodes)."""


def minimal(m: Mechanism, contacts: Records, load: Load) -> Minimal:
    """Return the formulation for a press."""
    return Minimal(m, contacts, load, np.empty((8, NODES - 1)))


@inlined
def tip_from_crank(m: Mechanism, c1: float, s1: float) -> Tip:
    """Return the motion of C from cosine and sine of the crank's angle."""
    _, _, c3, s3, _, w3, _, a3 = four_bar(m, c1, s1)
    x, y = m.L3 * c3, m.L3 * s3
    return m.Hx + x, m.Hy + y, -w3 * y, w3 * x, -a3 * y - w3 * w3 * x, a3 * x - w3 * w3 * y


def tabulate(model: Minimal, t: float, h: float, shares: Array) -> None:
    """Write the tip at all times t + shares h (s).

    The loops are vectorized, four times at once; else a run takes 11 to 14 % longer. The compiler vectorizes
    them only if each row is an array of its own, whose length it does not know.
    """
    m, table = model.mechanism, model.table
    cosine, sine, Cx, Cy = table[0], table[1], table[2], table[3]
    vCx, vCy, aCx, aCy = table[4], table[5], table[6], table[7]
    for i in range(shares.size):
        cosine[i], sine[i] = cos_sin(m.theta0 + m.omega * (t + shares[i] * h))
    for i in range(shares.size):
        Cx[i], Cy[i], vCx[i], vCy[i], aCx[i], aCy[i] = tip_from_crank(m, cosine[i], sine[i])


@inlined
def slider_pose(m: Mechanism, tip: Tip, y: Array) -> tuple[Pose, float, float]:
    """Return the slider's motion, and cosine and sine of theta_4."""
    Cx, Cy, vCx, vCy, _, _ = tip
    c4, s4 = cos_sin(y[0])
    vx, vy = vCx - m.L4 * y[2] * s4, vCy + m.L4 * y[2] * c4
    return (Cx + m.L4 * c4, Cy + m.L4 * s4, y[1], vx, vy, y[3]), c4, s4


@inlined
def tip_at(table: Array, i: int) -> Tip:
    """Return the motion of C at a node; POINT has the column of the step's start."""
    n = i % (NODES - 1)
    return table[2, n], table[3, n], table[4, n], table[5, n], table[6, n], table[7, n]


def motion(model: Minimal, t: float, i: int, modes: Records, nodes: Nodes) -> None:
    """Write gaps, rates and slips of a state."""
    pose, _, _ = slider_pose(model.mechanism, tip_at(model.table, i), nodes.y[i])
    corner_motion(model.contacts, pose, nodes.touches[i])


def derivative(model: Minimal, t: float, i: int, modes: Records, nodes: Nodes) -> None:
    """Write the derivatives of coordinates and rates; see `formulations.derivative`.

    The drive's power is that of the pin C on rod 4, as the motion of the bodies before C is prescribed.
    """
    y, dy, slider = nodes.y[i], nodes.dy[i], nodes.slider[i]
    m, tip = model.mechanism, tip_at(model.table, i)
    _, _, vCx, vCy, aCx, aCy = tip
    pose, c4, s4 = slider_pose(m, tip, y)
    Fx, Fy, M, damping, friction = slider_forces(model.contacts, pose, modes, nodes.touches[i])
    if pose[1] < model.load.surface:
        Fy += load_force(model.load, pose[1])
    w4 = y[2]
    bx, by = aCx, aCy + m.gravity  # acceleration of C relative to free fall
    a4 = (m.S4 * (s4 * bx - c4 * by) + m.L4 * (c4 * Fy - s4 * Fx)) / m.I4
    dy[0], dy[1], dy[2], dy[3] = w4, y[3], a4, M / m.J5
    turn_x, turn_y = -(a4 * s4 + w4 * w4 * c4), a4 * c4 - w4 * w4 * s4
    slider.x, slider.y, slider.angle, slider.vx, slider.vy, slider.omega = pose
    slider.ax, slider.ay, slider.alpha = aCx + m.L4 * turn_x, aCy + m.L4 * turn_y, dy[3]
    # The pin at C pushes rod 4 with the inertia of the two bodies less gravity, contact and load.
    Px = (m.m4 + m.m5) * bx + m.S4 * turn_x - Fx
    Py = (m.m4 + m.m5) * by + m.S4 * turn_y - Fy
    write_tail(dy, nodes.touches[i], Px * vCx + Py * vCy, damping, friction)
