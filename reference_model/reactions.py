"""Joint reactions and the motor's torque by inverse dynamics, body after body.

What a joint exerts on its higher-numbered body, in the fixed frame. From the slider inwards each body's
balance of forces and moments gives the next joint; rod 2 and the rocker share the two unknowns at B.
"""

import math

from reference_model.compiled import kernel
from reference_model.constants import Constants
from reference_model.forces import Array

REACTIONS = (
    *(f"reaction_{joint}_{axis}" for joint in "OABHCF" for axis in "xy"),
    "crank_torque",
    "guide_force",
    "guide_moment",
)
"""N, N m. The guide's two only exist for an ideal slider."""


@kernel
def inertial_force(mass: float, gravity: float, body: Array) -> tuple[float, float]:
    """Return m (a - g), what all forces but the weight add up to, N."""
    return mass * body[6], mass * (body[7] + gravity)


@kernel
def tip_of(body: Array, arm: float) -> tuple[float, float]:
    """Return the point of a rod at `arm` (m) beyond its centroid."""
    return body[0] + arm * math.cos(body[2]), body[1] + arm * math.sin(body[2])


@kernel
def reactions(
    c: Constants, bodies: Array, Fx: float, Fy: float, ideal_slider: bool, ideal_pin: bool,
    G: tuple[float, float, float, float], out: Array,
) -> None:  # fmt: skip
    """Write the reactions in the order of `REACTIONS`.

    Parameters
    ----------
    c, bodies
        Constants; motion of all bodies (5, 9).
    Fx, Fy
        Contact force on a slider with clearance, N.
    ideal_slider, ideal_pin
        What the guide and the pin A are.
    G
        With clearance at A: force of the journal on rod 2 (N) and its point of application (m).
    out
        Shape (15,).
    """
    f1x, f1y = inertial_force(c.m1, c.gravity, bodies[0])
    f2x, f2y = inertial_force(c.m2, c.gravity, bodies[1])
    f3x, f3y = inertial_force(c.m3, c.gravity, bodies[2])
    f4x, f4y = inertial_force(c.m4, c.gravity, bodies[3])
    f5x, f5y = inertial_force(c.m5, c.gravity, bodies[4])
    Bx, By = tip_of(bodies[2], 0.0)
    Cx, Cy = tip_of(bodies[2], c.L3 - c.Ls3)
    Dx, Dy = tip_of(bodies[3], c.L4 - c.Ls4)  # the pin F
    # Moment of all that acts on rod 4 about C: the reaction at C has none.
    spin4 = c.J4 * bodies[3, 8] + (bodies[3, 0] - Cx) * f4y - (bodies[3, 1] - Cy) * f4x
    guide = 0.0
    RFx, RFy = f5x - Fx, f5y - Fy
    if ideal_slider:
        # (F - C) x (-R_F) = spin4 with R_Fy known; the guide takes what is left of the slider's balance in x.
        RFx = (spin4 + (Dx - Cx) * RFy) / (Dy - Cy)
        guide = f5x - RFx
    RCx, RCy = f4x + RFx, f4y + RFy
    # Moments: rod 2 about B, with R_A = R_B + f2; rocker about H.
    spin2 = c.J2 * bodies[1, 8] + (bodies[1, 0] - Bx) * f2y - (bodies[1, 1] - By) * f2x
    spin3 = c.J3 * bodies[2, 8] + (bodies[2, 0] - c.Hx) * f3y - (bodies[2, 1] - c.Hy) * f3x
    spin3 += (Cx - c.Hx) * RCy - (Cy - c.Hy) * RCx
    if ideal_pin:
        Ax, Ay = tip_of(bodies[1], -c.Ls2)
        ax, ay, bx, by = Ax - Bx, Ay - By, Bx - c.Hx, By - c.Hy
        right = spin2 - ax * f2y + ay * f2x
        # ax R_By - ay R_Bx = right; bx R_By - by R_Bx = spin3
        determinant = ax * by - ay * bx
        RBx = (right * bx - spin3 * ax) / determinant
        RBy = (right * by - spin3 * ay) / determinant
        RAx, RAy = RBx + f2x, RBy + f2y
    else:
        RAx, RAy, Ax, Ay = G
        RBx, RBy = RAx - f2x, RAy - f2y
    RHx, RHy = f3x - RBx + RCx, f3y - RBy + RCy
    ROx, ROy = f1x + RAx, f1y + RAy
    # Crank about O: its weight and inertia act at the centroid, -R_A at A.
    torque = c.J1 * bodies[0, 8] + bodies[0, 0] * f1y - bodies[0, 1] * f1x + Ax * RAy - Ay * RAx
    out[0], out[1], out[2], out[3], out[4], out[5] = ROx, ROy, RAx, RAy, RBx, RBy
    out[6], out[7], out[8], out[9], out[10], out[11] = RHx, RHy, RCx, RCy, RFx, RFy
    out[12], out[13] = torque, guide
    # All other forces on an ideal slider pass through its centre.
    out[14] = c.J5 * bodies[4, 8] if ideal_slider else 0.0
