"""The driven four-bar O-A-B-H in closed form.

With a driven crank and ideal revolutes the rocker's tip C(t) is a known function of time, whatever the
slider does. Unit vectors u_i = (cos theta_i, sin theta_i) and their normals n_i = (-sin, cos) are enough:
no angle is ever computed.
"""

import math
from typing import NamedTuple

from reference_model.compiled import bare, inlined, kernel
from reference_model.constants import Constants
from reference_model.forces import Array
from reference_model.trigonometry import cos_sin

Tip = tuple[float, float, float, float, float, float]
TIP_ROWS = 8
"""Of what `rocker_tips` writes: a tip, and cosine and sine of the crank's angle."""


class FourBar(NamedTuple):
    """Rod 2 and rocker at one time: direction cosines, rates (rad/s), angular accelerations (rad/s^2)."""

    c2: float
    s2: float
    c3: float
    s3: float
    w2: float
    w3: float
    a2: float
    a3: float


class Links(NamedTuple):
    """Those of the constants that the four-bar needs, see `Constants`."""

    omega: float
    L1: float
    L2: float
    L3: float
    Ls3: float
    Hx: float
    Hy: float
    rocker_branch: float


@inlined
def four_bar(c: Constants, t: float) -> FourBar:
    """Return the motion of rod 2 and rocker at time `t`."""
    theta1 = c.theta0 + c.omega * t
    return four_bar_at(c, math.cos(theta1), math.sin(theta1))


@inlined
def four_bar_at(c: Constants | Links, c1: float, s1: float) -> FourBar:
    """Return the motion of rod 2 and rocker from cosine and sine of the crank's angle.

    Loop closure (rows 3-8 of Eq. 16): with A the crank tip, e the unit vector from A to H and
    n = (-e_y, e_x): B = A + a e + h n. Rates from L1 w1 n1 + L2 w2 n2 = Ls3 w3 n3 dotted with u2 and u3,
    angular accelerations from its derivative in the same way.
    """
    Ax, Ay = c.L1 * c1, c.L1 * s1
    ex, ey = c.Hx - Ax, c.Hy - Ay
    d2 = ex * ex + ey * ey
    d = math.sqrt(d2)
    ex, ey = ex / d, ey / d
    a = (d2 + c.L2 * c.L2 - c.Ls3 * c.Ls3) / (2.0 * d)
    h = c.rocker_branch * math.sqrt(c.L2 * c.L2 - a * a)
    # From A to B, and from H to B = A + a e + h n.
    c2, s2 = (a * ex - h * ey) / c.L2, (a * ey + h * ex) / c.L2
    c3, s3 = ((a - d) * ex - h * ey) / c.Ls3, ((a - d) * ey + h * ex) / c.Ls3
    n3u2 = -s3 * c2 + c3 * s2  # = -n2 . u3
    w3 = c.L1 * c.omega * (-s1 * c2 + c1 * s2) / (c.Ls3 * n3u2)
    w2 = c.L1 * c.omega * (-s1 * c3 + c1 * s3) / (c.L2 * n3u2)
    u2u3 = c2 * c3 + s2 * s3
    u1u2, u1u3 = c1 * c2 + s1 * s2, c1 * c3 + s1 * s3
    inward1, inward2, inward3 = c.L1 * c.omega * c.omega, c.L2 * w2 * w2, c.Ls3 * w3 * w3
    a3 = (inward3 * u2u3 - inward1 * u1u2 - inward2) / (c.Ls3 * n3u2)
    a2 = (inward3 - inward1 * u1u3 - inward2 * u2u3) / (c.L2 * n3u2)
    return FourBar(c2, s2, c3, s3, w2, w3, a2, a3)


@inlined
def rocker_tip(c: Constants, t: float) -> Tip:
    """Return the rocker's tip C: position (m), velocity (m/s), acceleration (m/s^2), each x and y."""
    theta1 = c.theta0 + c.omega * t
    c1, s1 = cos_sin(theta1)
    return rocker_tip_at(c, c1, s1)


@inlined
def rocker_tip_at(c: Constants | Links, c1: float, s1: float) -> Tip:
    """Return what `rocker_tip` does, from cosine and sine of the crank's angle."""
    f = four_bar_at(c, c1, s1)
    return (
        c.Hx + c.L3 * f.c3,
        c.Hy + c.L3 * f.s3,
        -c.L3 * f.w3 * f.s3,
        c.L3 * f.w3 * f.c3,
        -c.L3 * (f.a3 * f.s3 + f.w3 * f.w3 * f.c3),
        c.L3 * (f.a3 * f.c3 - f.w3 * f.w3 * f.s3),
    )


@bare
def rocker_tips(c: Constants, t: float, h: float, shares: Array, out: Array) -> None:
    """Write the rocker's tip at all times t + shares h (s) at once, the same to the last bit as `rocker_tip`.

    Parameters
    ----------
    c, t, h
        Constants, s, s.
    shares
        Shape (n,).
    out
        Written, shape (TIP_ROWS, n): what `rocker_tip` returns, then cosine and sine of the crank's angle.
    """
    # Rows and links by themselves and no length that the compiler knows: only so does it take the times side
    # by side in the processor's vectors, which halves what a time costs.
    Cx, Cy, vCx, vCy, aCx, aCy, cosine, sine = out[0], out[1], out[2], out[3], out[4], out[5], out[6], out[7]
    links = Links(c.omega, c.L1, c.L2, c.L3, c.Ls3, c.Hx, c.Hy, c.rocker_branch)
    for i in range(shares.size):
        theta1 = c.theta0 + c.omega * (t + shares[i] * h)
        cosine[i], sine[i] = cos_sin(theta1)
    for i in range(shares.size):
        Cx[i], Cy[i], vCx[i], vCy[i], aCx[i], aCy[i] = rocker_tip_at(links, cosine[i], sine[i])


@kernel
def reaches_line(c: Constants, times: Array) -> bool:
    """Return whether rod 4 reaches the ideal slider's line at all `times` (s)."""
    for t in times:
        Cx, _, _, _, _, _ = rocker_tip(c, t)
        if not abs(c.line_x - Cx) <= c.L4:
            return False
    return True


@kernel
def rod4_from_slider(c: Constants, t: float, x5: float, vx5: float) -> tuple[float, float]:
    """Return angle (rad) and rate (rad/s) of rod 4 that put the slider's centre at `x5` with speed `vx5`.

    NaN where rod 4 does not reach that line.
    """
    Cx, _, vCx, _, _, _ = rocker_tip(c, t)
    c4 = (x5 - Cx) / c.L4
    s4 = c.slider_branch * math.sqrt(1.0 - c4 * c4)
    return math.atan2(s4, c4), (vCx - vx5) / (c.L4 * s4)
