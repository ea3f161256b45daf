"""Equations of motion in the fewest coordinates: rod 4 and the slider behind the driven four-bar.

With ideal revolutes and a clearance only at the slider, two coordinates are free, theta_4 and theta_5:

    I theta4'' = -(m4 Ls4 + m5 L4) n4 . (C'' - g) + L4 n4 . F,   n4 = (-s4, c4)
    J5 theta5'' = M

F and M are force and moment of all corners on the slider, C the rocker's tip, a known function of time;
I = J4 + m4 Ls4^2 + m5 L4^2. It is the projection of Eqs. 15-21 onto their constraints.

The state y holds theta_4, theta_5 (rad), their rates (rad/s), and then the audit's integrals: the four
corners' impulses (N s), the work of the pin C on rod 4 and of gravity, the losses by damping and by
friction (J).

What a corner does between two events is its *mode*: `memory` > 0 is the impact speed frozen at its touch
(0: no contact), `regime` its friction regime, `clipped` whether the wall would have to pull. Within one
mode the right-hand side is smooth; `reference_model.events` finds where a mode ends.
"""

import math

import numpy as np
from numpy.typing import NDArray

from reference_model.compiled import kernel
from reference_model.contact import corner_arm, corner_gap, inward, normal_force
from reference_model.friction import friction_force
from reference_model.linkage import rocker_tip
from reference_model.parameters import Constants

Array = NDArray[np.float64]
Modes = NDArray[np.float64]
"""Shape (3, 4): rows memory, regime, clipped; one column a corner."""

FREE = 4
"""Coordinates and rates; the integrals follow."""
STATES = FREE + 8
MEMORY, REGIME, CLIPPED = 0, 1, 2


@kernel
def corner_motion(
    c: Constants, corner: int, x5: float, vx5: float, vy5: float, w5: float, c5: float, s5: float
) -> tuple[float, float, float, float, float]:
    """Return gap (m), its rate, tangential speed (m/s, along +y) and arm x, y (m) of one corner."""
    rx, ry = corner_arm(c, corner, c5, s5)
    gap = corner_gap(c, corner, x5 + rx)
    return gap, inward(corner) * (vx5 - w5 * ry), vy5 + w5 * rx, rx, ry


@kernel
def corner_state(c: Constants, corner: int, t: float, y: Array) -> tuple[float, float, float]:
    """Return gap (m), its rate (m/s) and tangential speed (m/s) of one corner in state `y`, shape (>= 4,)."""
    Cx, _, vCx, vCy, _, _ = rocker_tip(c, t)
    c4, s4 = math.cos(y[0]), math.sin(y[0])
    c5, s5 = math.cos(y[1]), math.sin(y[1])
    vx5, vy5 = vCx - c.L4 * y[2] * s4, vCy + c.L4 * y[2] * c4
    gap, rate, slip, _, _ = corner_motion(c, corner, Cx + c.L4 * c4, vx5, vy5, y[3], c5, s5)
    return gap, rate, slip


@kernel
def right_hand_side(c: Constants, t: float, y: Array, modes: Modes, dy: Array, corners: Array) -> None:
    """Evaluate the equations of motion in frozen `modes`.

    Parameters
    ----------
    c
        Constants of the scene.
    t
        Time, s.
    y
        State, shape (STATES,); only the first four matter.
    modes
        Shape (3, 4).
    dy
        Written: time derivative of `y`, shape (STATES,).
    corners
        Written, shape (3, 4): gap (m), gap rate (m/s) and tangential speed (m/s) of each corner.
    """
    Cx, _, vCx, vCy, aCx, aCy = rocker_tip(c, t)
    c4, s4 = math.cos(y[0]), math.sin(y[0])
    c5, s5 = math.cos(y[1]), math.sin(y[1])
    w4, w5 = y[2], y[3]
    x5 = Cx + c.L4 * c4
    vx5, vy5 = vCx - c.L4 * w4 * s4, vCy + c.L4 * w4 * c4
    Fx = Fy = M = damping = friction = 0.0
    for k in range(4):
        gap, rate, slip, rx, ry = corner_motion(c, k, x5, vx5, vy5, w5, c5, s5)
        corners[0, k], corners[1, k], corners[2, k] = gap, rate, slip
        normal = 0.0
        if modes[MEMORY, k] > 0.0 and gap < 0.0:
            if modes[CLIPPED, k] == 0.0:
                normal = normal_force(c, -gap, -rate, modes[MEMORY, k])
                tangential = friction_force(c, normal, slip, int(modes[REGIME, k]))
                Nx = inward(k) * normal
                Fx += Nx
                Fy += tangential
                M += rx * tangential - ry * Nx
                friction -= tangential * slip
            # What the spring gives back less than the wall's force returns is lost in damping.
            damping += (normal_force(c, -gap, 0.0, 1.0) - normal) * rate
        dy[FREE + k] = normal
    # Acceleration of C relative to free fall.
    bx, by = aCx, aCy + c.gravity
    dy[0], dy[1] = w4, w5
    dy[2] = (c.first_moment * (s4 * bx - c4 * by) + c.L4 * (c4 * Fy - s4 * Fx)) / c.I4
    dy[3] = M / c.J5
    # Force of the pin at C on rod 4: what moves the two bodies, less gravity and contact.
    ex, ey = -dy[2] * s4 - w4 * w4 * c4, dy[2] * c4 - w4 * w4 * s4
    Px = c.moving_mass * bx + c.first_moment * ex - Fx
    Py = c.moving_mass * by + c.first_moment * ey - Fy
    dy[8] = Px * vCx + Py * vCy
    dy[9] = -c.gravity * (c.moving_mass * vCy + c.first_moment * w4 * c4)
    dy[10] = damping
    dy[11] = friction
