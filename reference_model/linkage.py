"""Closed form of the linkage: driven four-bar O-A-B-H, rod 4, and the motion of all five bodies.

With a driven crank and ideal revolutes the rocker's tip C(t) is a known function of time, whatever the slider
does. Unit vectors u_i = (cos theta_i, sin theta_i) and their normals n_i = (-sin, cos) are enough for it: no
angle is ever computed. The functions take numbers or arrays and need no compiler: `four_bar` and `ideal_rod4`
are compiled into the equations of motion, the others serve the ideal mechanism, starts, reactions, energies.

The motion of the bodies is an array of shape (5, 9, n). Each body has x, y, theta, their rates and their
second derivatives, SI.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Mechanism(NamedTuple):
    """Lengths, masses and drive of the press (Fig. 4, Tables 1 and 2), SI."""

    omega: float
    """Crank speed, rad/s, counter-clockwise positive."""
    theta0: float
    """Crank angle at t = 0, rad."""
    m1: float
    """Masses of the five bodies, kg."""
    m2: float
    m3: float
    m4: float
    m5: float
    J1: float
    """Inertias about the centroids, kg m^2."""
    J2: float
    J3: float
    J4: float
    J5: float
    Ls1: float
    """Distances of the centroids from the first pin, m."""
    Ls2: float
    Ls3: float
    """Also the distance from the rocker's pivot H to B, where rod 2 is pinned."""
    Ls4: float
    L1: float
    """Lengths of the rods, m."""
    L2: float
    L3: float
    L4: float
    Hx: float
    """Position of the rocker's pivot, m."""
    Hy: float
    rocker_branch: float
    """+1: B lies left of the line from A to H; -1: right."""
    slider_branch: float
    """-1: the slider hangs below the rocker's tip; +1: it stands above."""
    line_x: float
    """x of the ideal slider's line, guide_x + reference_offset, m."""
    gravity: float
    """Acceleration of gravity along -y, m/s^2."""
    S4: float
    """m4 Ls4 + m5 L4, first moment of rod 4 and slider about the tip C, kg m."""
    I4: float
    """J4 + m4 Ls4^2 + m5 L4^2, inertia of rod 4 and slider about the tip C, kg m^2."""

    @property
    def masses(self) -> tuple[float, ...]:
        """Masses of the five bodies, kg."""
        return self.m1, self.m2, self.m3, self.m4, self.m5

    @property
    def inertias(self) -> tuple[float, ...]:
        """Inertias of the five bodies, kg m^2."""
        return self.J1, self.J2, self.J3, self.J4, self.J5


def four_bar(m: Mechanism, c1: Any, s1: Any) -> tuple[Any, Any, Any, Any, Any, Any, Any, Any]:
    """Return the motion of rod 2 and rocker from cosine and sine of the crank's angle.

    Loop closure (rows 3-8 of Eq. 16): with A the crank tip, e the unit vector from A to H and
    n = (-e_y, e_x): B = A + a e + h n. Rates from L1 w1 n1 + L2 w2 n2 = Ls3 w3 n3 dotted with u2 and u3,
    angular accelerations from its derivative in the same way. Results are the direction cosines of rod 2 and
    rocker, c2, s2, c3, s3, their rates (rad/s) and angular accelerations (rad/s^2).
    """
    ex, ey = m.Hx - m.L1 * c1, m.Hy - m.L1 * s1
    d2 = ex * ex + ey * ey
    d = np.sqrt(d2)
    ex, ey = ex / d, ey / d
    a = (d2 + m.L2 * m.L2 - m.Ls3 * m.Ls3) / (2.0 * d)
    h = m.rocker_branch * np.sqrt(m.L2 * m.L2 - a * a)
    # From A to B, and from H to B = A + a e + h n.
    c2, s2 = (a * ex - h * ey) / m.L2, (a * ey + h * ex) / m.L2
    c3, s3 = ((a - d) * ex - h * ey) / m.Ls3, ((a - d) * ey + h * ex) / m.Ls3
    n3u2 = c3 * s2 - s3 * c2  # = -n2 . u3
    w3 = m.L1 * m.omega * (c1 * s2 - s1 * c2) / (m.Ls3 * n3u2)
    w2 = m.L1 * m.omega * (c1 * s3 - s1 * c3) / (m.L2 * n3u2)
    u2u3, u1u2, u1u3 = c2 * c3 + s2 * s3, c1 * c2 + s1 * s2, c1 * c3 + s1 * s3
    inward1, inward2, inward3 = m.L1 * m.omega * m.omega, m.L2 * w2 * w2, m.Ls3 * w3 * w3
    a3 = (inward3 * u2u3 - inward1 * u1u2 - inward2) / (m.Ls3 * n3u2)
    a2 = (inward3 - inward1 * u1u3 - inward2 * u2u3) / (m.L2 * n3u2)
    return c2, s2, c3, s3, w2, w3, a2, a3


def ideal_rod4(m: Mechanism, c3: Any, s3: Any, w3: Any) -> tuple[Any, Any, Any, Any]:
    """Return c4, s4 of rod 4, kappa = w4 / w3 and mu = theta_4'' - kappa theta_3'' with an ideal slider.

    They follow from the rocker's direction cosines and rate (rad/s) by L3 c3 + L4 c4 = x5 - H_x = const,
    differentiated twice. mu is in rad/s^2; all are nan where rod 4 does not reach the line.
    """
    c4 = (m.line_x - m.Hx - m.L3 * c3) / m.L4
    s4 = m.slider_branch * np.sqrt(1.0 - c4 * c4)
    kappa = -m.L3 * s3 / (m.L4 * s4)
    w4 = kappa * w3
    return c4, s4, kappa, -(m.L3 * c3 * w3 * w3 + m.L4 * c4 * w4 * w4) / (m.L4 * s4)


def rod4_from_slider(m: Mechanism, x5: float, vx5: float) -> tuple[float, float]:
    """Return angle (rad) and rate (rad/s) of rod 4 at t = 0 with the slider's centre at `x5` and speed `vx5`.

    Both are nan where rod 4 does not reach that far.
    """
    _, _, c3, s3, _, w3, _, _ = four_bar(m, np.cos(m.theta0), np.sin(m.theta0))
    c4 = (x5 - m.Hx - m.L3 * c3) / m.L4
    with np.errstate(invalid="ignore"):
        s4 = m.slider_branch * np.sqrt(1.0 - c4 * c4)
    return float(np.arctan2(s4, c4)), float((-m.L3 * w3 * s3 - vx5) / (m.L4 * s4))


Turn = tuple[Any, Any, Any, Any, Any]
"""Motion of a rod: direction cosines, angle (rad), rate (rad/s), second derivative (rad/s^2)."""


def turning(theta: Any, w: Any, a: Any) -> Turn:
    """Return a rod's motion from its angle (rad) and that angle's derivatives."""
    return np.cos(theta), np.sin(theta), theta, w, a


def _along(start: tuple[Any, ...], arm: float, turn: Turn) -> tuple[Any, ...]:
    """Return the motion (x, y, vx, vy, ax, ay) of the point `arm` along a rod from `start`."""
    cos, sin, _, w, a = turn
    cos, sin, square = arm * cos, arm * sin, w * w
    x, y, vx, vy, ax, ay = start
    return (
        x + cos,
        y + sin,
        vx - w * sin,
        vy + w * cos,
        ax - a * sin - square * cos,
        ay + a * cos - square * sin,
    )


def bodies_from_rods(
    m: Mechanism, t: Array, rods: tuple[Turn, Turn, Turn], slider: tuple[Any, Any, Any]
) -> Array:
    """Return the motion of all bodies, shape (5, 9, n); `slider` is theta_5 and its derivatives."""
    out = np.zeros((5, 9, t.size))
    origin, pivot = (0.0,) * 6, (m.Hx, m.Hy, 0.0, 0.0, 0.0, 0.0)
    crank, (rod2, rocker, rod4) = turning(m.theta0 + m.omega * t, m.omega, 0.0), rods
    pin_B, tip = _along(pivot, m.Ls3, rocker), _along(pivot, m.L3, rocker)
    centres = (
        _along(origin, m.Ls1, crank),
        _along(pin_B, m.Ls2 - m.L2, rod2),  # reached from its far end
        pin_B,
        _along(tip, m.Ls4, rod4),
        _along(tip, m.L4, rod4),
    )
    turns = (crank[2:], rod2[2:], rocker[2:], rod4[2:], slider)
    for body, centre, turn in zip(out, centres, turns, strict=True):
        for derivative in range(3):
            body[3 * derivative], body[3 * derivative + 1] = centre[2 * derivative : 2 * derivative + 2]
            body[3 * derivative + 2] = turn[derivative]
    return out


def four_bar_rods(m: Mechanism, t: Any) -> tuple[Turn, Turn]:
    """Return the motion of rod 2 and rocker at times `t` (s)."""
    theta1 = m.theta0 + m.omega * t
    c2, s2, c3, s3, w2, w3, a2, a3 = four_bar(m, np.cos(theta1), np.sin(theta1))
    return (c2, s2, np.arctan2(s2, c2), w2, a2), (c3, s3, np.arctan2(s3, c3), w3, a3)


def rod4_of_ideal_slider(m: Mechanism, rocker: Turn) -> Turn:
    """Return the motion of rod 4 where the slider is ideal; nan where rod 4 does not reach its line."""
    c3, s3, _, w3, a3 = rocker
    c4, s4, kappa, mu = ideal_rod4(m, c3, s3, w3)
    return c4, s4, np.arctan2(s4, c4), kappa * w3, kappa * a3 + mu


def ideal_motion(m: Mechanism, t: Array) -> Array:
    """Return the motion of the ideal mechanism, shape (5, 9, n); nan where rod 4 does not reach its line."""
    rod2, rocker = four_bar_rods(m, t)
    with np.errstate(invalid="ignore", divide="ignore"):
        return bodies_from_rods(m, t, (rod2, rocker, rod4_of_ideal_slider(m, rocker)), (0.0, 0.0, 0.0))
