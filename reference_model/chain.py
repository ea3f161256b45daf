"""Clearance at the crank pin A: rocker, rod 2, rod 4 and slider as an open chain from the pivot H.

Free coordinates theta_2, theta_3 and, where the slider has clearance too, theta_4, theta_5. The chain is cut
at A, where journal and bearing only touch, so its equations have no constraint:

    rod 2     (J2 + m2 b^2) a2 - m2 b Ls3 (n2 . n3) a3                            = Q2,  b = L2 - Ls2
    rocker    -m2 b Ls3 (n2 . n3) a2 + (J3 + (m2 + m3) Ls3^2 + (m4 + m5) L3^2) a3
              + (m4 Ls4 + m5 L4) L3 (n3 . n4) a4                                   = Q3
    rod 4     (m4 Ls4 + m5 L4) L3 (n3 . n4) a3 + I4 a4                             = Q4
    slider    J5 a5                                                                = Q5

with a_i = theta_i'' and Q the forces' moments less the centrifugal terms. An ideal slider ties theta_4 to
theta_3, w4 = kappa w3; the third and fourth equation are then added with weights 1 and kappa.
"""

import math

from reference_model.compiled import kernel
from reference_model.constants import Constants
from reference_model.forces import Array, bearing_forces, slider_forces
from reference_model.journal import Bearing, bearing_contact


@kernel
def ideal_rod4(c: Constants, theta3: float, w3: float) -> tuple[float, float, float]:
    """Return theta_4 (rad), kappa = w4 / w3, and theta_4'' - kappa theta_3'' (rad/s^2) with an ideal slider.

    From L3 c3 + L4 c4 = x5 - H_x = const, differentiated twice.
    """
    c3, s3 = math.cos(theta3), math.sin(theta3)
    c4 = (c.line_x - c.Hx - c.L3 * c3) / c.L4
    s4 = c.slider_branch * math.sqrt(1.0 - c4 * c4)
    kappa = -c.L3 * s3 / (c.L4 * s4)
    w4 = kappa * w3
    return math.atan2(s4, c4), kappa, -(c.L3 * c3 * w3 * w3 + c.L4 * c4 * w4 * w4) / (c.L4 * s4)


@kernel
def bearing_motion(c: Constants, t: float, theta2: float, theta3: float, w2: float, w3: float) -> Bearing:
    """Return the contact at A: the bearing sits at H + Ls3 u3 - L2 u2."""
    c2, s2, c3, s3 = math.cos(theta2), math.sin(theta2), math.cos(theta3), math.sin(theta3)
    Ax, Ay = c.Hx + c.Ls3 * c3 - c.L2 * c2, c.Hy + c.Ls3 * s3 - c.L2 * s2
    vAx, vAy = -c.Ls3 * w3 * s3 + c.L2 * w2 * s2, c.Ls3 * w3 * c3 - c.L2 * w2 * c2
    return bearing_contact(c, t, Ax, Ay, vAx, vAy, w2)


@kernel
def slider_motion(
    c: Constants, theta3: float, theta4: float, theta5: float, w3: float, w4: float, w5: float
) -> tuple[float, float, float, float, float, float]:
    """Return x, y, angle of the slider and their rates: it sits at H + L3 u3 + L4 u4."""
    c3, s3, c4, s4 = math.cos(theta3), math.sin(theta3), math.cos(theta4), math.sin(theta4)
    return (
        c.Hx + c.L3 * c3 + c.L4 * c4,
        c.Hy + c.L3 * s3 + c.L4 * s4,
        theta5,
        -c.L3 * w3 * s3 - c.L4 * w4 * s4,
        c.L3 * w3 * c3 + c.L4 * w4 * c4,
        w5,
    )


@kernel
def ideal_slider_motion(
    c: Constants, theta3: float, w3: float
) -> tuple[float, float, float, float, float, float]:
    """Return x, y, angle of the slider and their rates where it is ideal."""
    theta4, kappa, _ = ideal_rod4(c, theta3, w3)
    return slider_motion(c, theta3, theta4, 0.0, w3, kappa * w3, 0.0)


@kernel
def generalized_forces(
    c: Constants, t: float, theta2: float, theta3: float, theta4: float, w2: float, w3: float, w4: float,
    Fx: float, Fy: float, modes: Array, contacts: Array,
) -> tuple[float, float, float, float, float, float]:  # fmt: skip
    """Return Q2, Q3, Q4 (N m), the motor's power, and the powers lost in the bearing (damping, friction; W).

    `Fx`, `Fy` is the contact force on the slider; column JOURNAL of `contacts` is written.
    """
    c2, s2, c3, s3 = math.cos(theta2), math.sin(theta2), math.cos(theta3), math.sin(theta3)
    c4, s4 = math.cos(theta4), math.sin(theta4)
    bearing = bearing_motion(c, t, theta2, theta3, w2, w3)
    Gx, Gy, damping, friction = bearing_forces(c, bearing, modes, contacts)
    # Velocity of the material point P of rod 2 per unit w2: -L2 n2 + z x (P - A), and per unit w3: Ls3 n3.
    Ax, Ay = c.Hx + c.Ls3 * c3 - c.L2 * c2, c.Hy + c.Ls3 * s3 - c.L2 * s2
    p2x, p2y = c.L2 * s2 - (bearing.Py - Ay), -c.L2 * c2 + (bearing.Px - Ax)
    b = c.L2 - c.Ls2
    # Weight and centrifugal force of rod 2 at its centroid H + Ls3 u3 - b u2.
    f2x = c.m2 * (c.Ls3 * w3 * w3 * c3 - b * w2 * w2 * c2)
    f2y = c.m2 * (c.Ls3 * w3 * w3 * s3 - b * w2 * w2 * s2 - c.gravity)
    Q2 = -b * (-s2 * f2x + c2 * f2y) + Gx * p2x + Gy * p2y
    tip_x = Fx + c.first_moment * w4 * w4 * c4
    tip_y = Fy + c.first_moment * w4 * w4 * s4 - c.moving_mass * c.gravity
    Q3 = c.Ls3 * (-s3 * (f2x + Gx) + c3 * (f2y + Gy - c.m3 * c.gravity)) + c.L3 * (-s3 * tip_x + c3 * tip_y)
    end_x = c.first_moment * c.L3 * w3 * w3 * c3 + c.L4 * Fx
    end_y = c.first_moment * (c.L3 * w3 * w3 * s3 - c.gravity) + c.L4 * Fy
    Q4 = -s4 * end_x + c4 * end_y
    # The crank turns uniformly: the motor balances its weight and the bearing's reaction at P.
    torque = c.m1 * c.gravity * c.Ls1 * math.cos(c.theta0 + c.omega * t) + bearing.Px * Gy - bearing.Py * Gx
    return Q2, Q3, Q4, torque * c.omega, damping, friction


@kernel
def inertias(c: Constants, theta2: float, theta3: float, theta4: float) -> tuple[float, float, float, float]:
    """Return M22, M23, M33, M34 of the mass matrix, kg m^2; M44 is `I4`."""
    b = c.L2 - c.Ls2
    M23 = -c.m2 * b * c.Ls3 * math.cos(theta2 - theta3)
    M33 = c.J3 + (c.m2 + c.m3) * c.Ls3**2 + c.moving_mass * c.L3**2
    return c.J2 + c.m2 * b * b, M23, M33, c.first_moment * c.L3 * math.cos(theta3 - theta4)


@kernel
def equations_both(
    c: Constants, t: float, y: Array, modes: Array, dy: Array, contacts: Array
) -> tuple[float, float, float]:
    """Write the derivatives of theta_2..theta_5 and their rates into dy[:8].

    Returns the motor's power and the power lost by damping and by friction, W.
    """
    slider = slider_motion(c, y[1], y[2], y[3], y[5], y[6], y[7])
    Fx, Fy, M, damping, friction = slider_forces(c, slider, modes, contacts)
    Q2, Q3, Q4, power, damping_A, friction_A = generalized_forces(
        c, t, y[0], y[1], y[2], y[4], y[5], y[6], Fx, Fy, modes, contacts
    )
    M22, M23, M33, M34 = inertias(c, y[0], y[1], y[2])
    a3 = (Q3 - M23 * Q2 / M22 - M34 * Q4 / c.I4) / (M33 - M23 * M23 / M22 - M34 * M34 / c.I4)
    for i in range(4):
        dy[i] = y[4 + i]
    dy[4], dy[5], dy[6], dy[7] = (Q2 - M23 * a3) / M22, a3, (Q4 - M34 * a3) / c.I4, M / c.J5
    return power, damping + damping_A, friction + friction_A


@kernel
def equations_pin(
    c: Constants, t: float, y: Array, modes: Array, dy: Array, contacts: Array
) -> tuple[float, float, float]:
    """Write the derivatives of theta_2, theta_3 and their rates into dy[:4]; returns as `equations_both`."""
    theta4, kappa, rest = ideal_rod4(c, y[1], y[3])
    Q2, Q3, Q4, power, damping, friction = generalized_forces(
        c, t, y[0], y[1], theta4, y[2], y[3], kappa * y[3], 0.0, 0.0, modes, contacts
    )
    M22, M23, M33, M34 = inertias(c, y[0], y[1], theta4)
    Q = Q3 + kappa * Q4 - (M34 + kappa * c.I4) * rest
    a3 = (Q - M23 * Q2 / M22) / (M33 + kappa * (2.0 * M34 + kappa * c.I4) - M23 * M23 / M22)
    dy[0], dy[1], dy[2], dy[3] = y[2], y[3], (Q2 - M23 * a3) / M22, a3
    return power, damping, friction
