"""Clearance at the slider: two free coordinates behind the driven four-bar.

With ideal revolutes and a driven crank the rocker's tip C is a known function of time, and only theta_4 and
theta_5 are free:

    I theta4'' = -(m4 Ls4 + m5 L4) n4 . (C'' - g) + L4 n4 . F,   n4 = (-s4, c4)
    J5 theta5'' = M

F and M are force and moment of all corners on the slider; I = J4 + m4 Ls4^2 + m5 L4^2. It is the projection
of Eqs. 14-21 onto their constraints.
"""

from reference_model.compiled import inlined
from reference_model.constants import Constants
from reference_model.forces import Array, slider_forces
from reference_model.linkage import Tip
from reference_model.trigonometry import cos_sin


@inlined
def slider_motion(c: Constants, tip: Tip, y: Array) -> tuple[float, float, float, float, float, float]:
    """Return x, y, angle of the slider and their rates; `y` starts with theta_4, theta_5 and their rates."""
    Cx, Cy, vCx, vCy, _, _ = tip
    c4, s4 = cos_sin(y[0])
    return (
        Cx + c.L4 * c4,
        Cy + c.L4 * s4,
        y[1],
        vCx - c.L4 * y[2] * s4,
        vCy + c.L4 * y[2] * c4,
        y[3],
    )


@inlined
def slider_row(c: Constants, tip: Tip, y: Array, dy: Array, out: Array) -> None:
    """Write x, y, angle of the slider, their rates and their second derivatives into out[:9]."""
    Cx, Cy, vCx, vCy, aCx, aCy = tip
    c4, s4 = cos_sin(y[0])
    w4, a4 = y[2], dy[2]
    out[0], out[1], out[2] = Cx + c.L4 * c4, Cy + c.L4 * s4, y[1]
    out[3], out[4], out[5] = vCx - c.L4 * w4 * s4, vCy + c.L4 * w4 * c4, y[3]
    out[6], out[7] = aCx - c.L4 * (a4 * s4 + w4 * w4 * c4), aCy + c.L4 * (a4 * c4 - w4 * w4 * s4)
    out[8] = dy[3]


@inlined
def equations(
    c: Constants, tip: Tip, y: Array, modes: Array, dy: Array, contacts: Array
) -> tuple[float, float, float]:
    """Write the derivatives of theta_4, theta_5 and their rates into dy[:4].

    `tip` is what `rocker_tip` says of the time. Returns the power of the pin C on rod 4, the power lost by
    damping and by friction, W.
    """
    Cx, Cy, vCx, vCy, aCx, aCy = tip
    c4, s4 = cos_sin(y[0])
    w4 = y[2]
    slider = (
        Cx + c.L4 * c4,
        Cy + c.L4 * s4,
        y[1],
        vCx - c.L4 * w4 * s4,
        vCy + c.L4 * w4 * c4,
        y[3],
    )
    Fx, Fy, M, damping, friction = slider_forces(c, slider, modes, contacts)
    bx, by = aCx, aCy + c.gravity  # acceleration of C relative to free fall
    a4 = (c.first_moment * (s4 * bx - c4 * by) + c.L4 * (c4 * Fy - s4 * Fx)) / c.I4
    dy[0], dy[1], dy[2], dy[3] = w4, y[3], a4, M / c.J5
    # Force of the pin at C on rod 4: what moves the two bodies, less gravity and contact.
    Px = c.moving_mass * bx - c.first_moment * (a4 * s4 + w4 * w4 * c4) - Fx
    Py = c.moving_mass * by + c.first_moment * (a4 * c4 - w4 * w4 * s4) - Fy
    return Px * vCx + Py * vCy, damping, friction
