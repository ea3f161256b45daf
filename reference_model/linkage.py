"""The driven four-bar O-A-B-H in closed form, and the ideal slider behind it.

With a driven crank and ideal revolutes the rocker's tip C(t) is a known function of time, whatever the
slider does. Unit vectors u_i = (cos theta_i, sin theta_i) and their normals n_i = (-sin, cos) are enough:
no angle is ever computed.
"""

import math

import numpy as np
from numpy.typing import NDArray

from reference_model.compiled import kernel
from reference_model.parameters import Constants


@kernel
def rocker(c: Constants, t: float) -> tuple[float, float, float, float]:
    """Return direction, rate and angular acceleration of the rocker at time `t`.

    Loop closure (rows 3-8 of Eq. 16): with A the crank tip, e the unit vector from A to H and
    n = (-e_y, e_x): B = A + a e + h n. Rates from L1 w1 n1 + L2 w2 n2 = Ls3 w3 n3 dotted with u2 and u3,
    angular accelerations from its derivative in the same way.

    Returns
    -------
    c3, s3, w3, a3
        Cosine and sine of theta_3, its rate (rad/s) and acceleration (rad/s^2).
    """
    theta1 = c.theta0 + c.omega * t
    c1, s1 = math.cos(theta1), math.sin(theta1)
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
    n3u2 = -s3 * c2 + c3 * s2
    w3 = c.L1 * c.omega * (-s1 * c2 + c1 * s2) / (c.Ls3 * n3u2)
    w2 = c.L1 * c.omega * (-s1 * c3 + c1 * s3) / (c.L2 * n3u2)  # n2 . u3 = -n3 . u2
    u1u2, u3u2 = c1 * c2 + s1 * s2, c3 * c2 + s3 * s2
    a3 = (c.Ls3 * w3 * w3 * u3u2 - c.L1 * c.omega * c.omega * u1u2 - c.L2 * w2 * w2) / (c.Ls3 * n3u2)
    return c3, s3, w3, a3


@kernel
def rocker_tip(c: Constants, t: float) -> tuple[float, float, float, float, float, float]:
    """Return the rocker's tip C: position (m), velocity (m/s), acceleration (m/s^2), each x and y."""
    c3, s3, w3, a3 = rocker(c, t)
    return (
        c.Hx + c.L3 * c3,
        c.Hy + c.L3 * s3,
        -c.L3 * w3 * s3,
        c.L3 * w3 * c3,
        -c.L3 * (a3 * s3 + w3 * w3 * c3),
        c.L3 * (a3 * c3 - w3 * w3 * s3),
    )


@kernel
def rod4_from_slider(c: Constants, t: float, x5: float, vx5: float) -> tuple[float, float]:
    """Return angle (rad) and rate (rad/s) of rod 4 that put the slider's centre at `x5` with speed `vx5`.

    NaN where rod 4 does not reach that line.
    """
    Cx, _, vCx, _, _, _ = rocker_tip(c, t)
    c4 = (x5 - Cx) / c.L4
    s4 = c.slider_branch * math.sqrt(1.0 - c4 * c4)
    return math.atan2(s4, c4), (vCx - vx5) / (c.L4 * s4)


@kernel
def ideal_slider(c: Constants, time: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return y, vy, ay (m, m/s, m/s^2) of the slider that is fixed to its line, shape (3, n).

    The ideal mechanism has no freedom left: y5 is a function of the crank angle alone. NaN where rod 4
    does not reach the line.
    """
    out = np.empty((3, time.size))
    for i in range(time.size):
        Cx, Cy, vCx, vCy, aCx, aCy = rocker_tip(c, time[i])
        # (x5 - Cx)^2 + (y5 - Cy)^2 = L4^2, twice differentiated, x5 constant.
        dx = c.line_x - Cx
        dy = c.slider_branch * math.sqrt(c.L4 * c.L4 - dx * dx)
        dvy = dx * vCx / dy
        out[0, i] = Cy + dy
        out[1, i] = vCy + dvy
        out[2, i] = aCy + (dx * aCx - vCx * vCx - dvy * dvy) / dy
    return out
