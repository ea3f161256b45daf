"""Motion of all five bodies from the few coordinates that a formulation carries.

A motion has one row a body: x, y, theta, their rates and their second derivatives, shape (5, 9), SI.
"""

import math

import numpy as np

from reference_model.chain import ideal_rod4
from reference_model.compiled import kernel, over_arrays
from reference_model.constants import Constants
from reference_model.forces import Array
from reference_model.linkage import four_bar


@kernel
def point(
    body: Array,
    arm: float,
    theta: float,
    w: float,
    a: float,
    start: tuple[float, float, float, float, float, float],
) -> tuple[float, float, float, float, float, float]:
    """Return the motion of the point `arm` along a rod from `start` (x, y, vx, vy, ax, ay).

    Writes angle, rate and acceleration of the rod into columns 2, 5 and 8 of `body`.
    """
    body[2], body[5], body[8] = theta, w, a
    cos, sin = math.cos(theta), math.sin(theta)
    x, y, vx, vy, ax, ay = start
    return (
        x + arm * cos,
        y + arm * sin,
        vx - arm * w * sin,
        vy + arm * w * cos,
        ax - arm * (a * sin + w * w * cos),
        ay + arm * (a * cos - w * w * sin),
    )


@kernel
def place(body: Array, at: tuple[float, float, float, float, float, float]) -> None:
    """Write the centroid's motion into a row."""
    body[0], body[1], body[3], body[4], body[6], body[7] = at


@kernel
def crank_motion(c: Constants, t: float, bodies: Array) -> None:
    """Write the driven crank, row 0."""
    origin = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    place(bodies[0], point(bodies[0], c.Ls1, c.theta0 + c.omega * t, c.omega, 0.0, origin))


@kernel
def chain_motion(
    c: Constants, angles: tuple[float, float, float, float], rates: tuple[float, float, float, float],
    seconds: tuple[float, float, float, float], bodies: Array,
) -> None:  # fmt: skip
    """Write rod 2, rocker, rod 4 and slider, rows 1-4, from theta_2 .. theta_5 and their derivatives."""
    pivot = (c.Hx, c.Hy, 0.0, 0.0, 0.0, 0.0)
    pin_B = point(bodies[2], c.Ls3, angles[1], rates[1], seconds[1], pivot)
    place(bodies[2], pin_B)
    # Rod 2 is reached from its far end.
    place(bodies[1], point(bodies[1], -(c.L2 - c.Ls2), angles[0], rates[0], seconds[0], pin_B))
    tip = point(bodies[2], c.L3, angles[1], rates[1], seconds[1], pivot)
    place(bodies[3], point(bodies[3], c.Ls4, angles[2], rates[2], seconds[2], tip))
    place(bodies[4], point(bodies[3], c.L4, angles[2], rates[2], seconds[2], tip))
    bodies[4, 2], bodies[4, 5], bodies[4, 8] = angles[3], rates[3], seconds[3]


@kernel
def motion_slider_clearance(c: Constants, t: float, y: Array, dy: Array, bodies: Array) -> None:
    """Fill `bodies` where theta_4 and theta_5 are free."""
    f = four_bar(c, t)
    crank_motion(c, t, bodies)
    theta2, theta3 = math.atan2(f.s2, f.c2), math.atan2(f.s3, f.c3)
    chain_motion(
        c, (theta2, theta3, y[0], y[1]), (f.w2, f.w3, y[2], y[3]), (f.a2, f.a3, dy[2], dy[3]), bodies
    )


@kernel
def motion_pin_clearance(c: Constants, t: float, y: Array, dy: Array, bodies: Array) -> None:
    """Fill `bodies` where theta_2 and theta_3 are free and the slider is ideal."""
    theta4, kappa, rest = ideal_rod4(c, y[1], y[3])
    crank_motion(c, t, bodies)
    chain_motion(
        c, (y[0], y[1], theta4, 0.0), (y[2], y[3], kappa * y[3], 0.0),
        (dy[2], dy[3], kappa * dy[3] + rest, 0.0), bodies,
    )  # fmt: skip


@kernel
def motion_both_clearances(c: Constants, t: float, y: Array, dy: Array, bodies: Array) -> None:
    """Fill `bodies` where theta_2 .. theta_5 are free."""
    crank_motion(c, t, bodies)
    chain_motion(c, (y[0], y[1], y[2], y[3]), (y[4], y[5], y[6], y[7]), (dy[4], dy[5], dy[6], dy[7]), bodies)


@kernel
def motion_multipliers(y: Array, dy: Array, bodies: Array) -> None:
    """Fill `bodies` from 15 coordinates."""
    for i in range(5):
        for m in range(3):
            bodies[i, m], bodies[i, 3 + m], bodies[i, 6 + m] = (
                y[3 * i + m],
                y[15 + 3 * i + m],
                dy[15 + 3 * i + m],
            )


@kernel
def _ideal_bodies(c: Constants, t: float, bodies: Array) -> None:
    """Fill `bodies` where none is free; nan where rod 4 does not reach the slider's line."""
    f = four_bar(c, t)
    theta3 = math.atan2(f.s3, f.c3)
    theta4, kappa, rest = ideal_rod4(c, theta3, f.w3)
    crank_motion(c, t, bodies)
    chain_motion(
        c, (math.atan2(f.s2, f.c2), theta3, theta4, 0.0), (f.w2, f.w3, kappa * f.w3, 0.0),
        (f.a2, f.a3, kappa * f.a3 + rest, 0.0), bodies,
    )  # fmt: skip


def ideal_motion(c: Constants, times: Array) -> Array:
    """Return the motion of the ideal mechanism, closed form over all times, shape (5, 9, n).

    NaN where rod 4 does not reach the slider's line.
    """
    out = np.empty((5, 9, times.size))
    with np.errstate(invalid="ignore", divide="ignore"):
        over_arrays(_ideal_bodies)(c, times, out)
    return out
