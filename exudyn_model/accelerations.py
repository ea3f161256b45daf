"""Accelerations of the slider by balance of forces, where the crank pin is ideal (Eqs. 14-21, reduced).

Exudyn's own accelerations are not used: with constraints at position level they carry the Newton
iteration's error divided by the square of the step. Here they follow from positions, velocities and
contact forces alone, so they are as accurate as the state.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from exudyn_model.bodies import CRANK_ANGLE, ROCKER_ANGLE, ROD2_ANGLE, ROD4_ANGLE
from exudyn_model.compiled import kernel


class Forces(NamedTuple):
    """Contact forces (N) and moments about the centres (N m) on the slider and on rod 2."""

    fx: float
    fy: float
    moment: float
    pin_x: float
    pin_y: float
    pin_moment: float


@kernel
def rocker_tip_acceleration(
    q: NDArray[np.float64], v: NDArray[np.float64], linkage: Any
) -> tuple[float, float]:
    """Return the acceleration of joint C (m/s^2), with the crank at constant speed.

    Second derivative of the loop O-A-B-H, resolved along rod 2 so that its own angular acceleration drops
    out. ``q`` and ``v``, shape (15,), hold x, y, angle of the five bodies and their rates.
    """
    c1, s1, w1 = np.cos(q[CRANK_ANGLE]), np.sin(q[CRANK_ANGLE]), v[CRANK_ANGLE]
    c2, s2, w2 = np.cos(q[ROD2_ANGLE]), np.sin(q[ROD2_ANGLE]), v[ROD2_ANGLE]
    c3, s3, w3 = np.cos(q[ROCKER_ANGLE]), np.sin(q[ROCKER_ANGLE]), v[ROCKER_ANGLE]
    # Towards the pivots: A about O, B about A, B about H
    ax = -linkage.crank_length * w1 * w1 * c1 - linkage.rod2_length * w2 * w2 * c2
    ay = -linkage.crank_length * w1 * w1 * s1 - linkage.rod2_length * w2 * w2 * s2
    bx = ax + linkage.rocker_to_b * w3 * w3 * c3
    by = ay + linkage.rocker_to_b * w3 * w3 * s3
    alpha3 = (bx * c2 + by * s2) / (linkage.rocker_to_b * (c3 * s2 - s3 * c2))
    length = linkage.rocker_length
    return length * (-alpha3 * s3 - w3 * w3 * c3), length * (alpha3 * c3 - w3 * w3 * s3)


@kernel
def rod4_acceleration(
    angle: float, tip_ax: float, tip_ay: float, fx: float, fy: float, linkage: Any
) -> float:
    """Return rod 4's angular acceleration (rad/s^2) from its angle, C's acceleration and the contact force.

    Rod 4 and the slider together rotate about C, which moves as the drive makes it; taking moments about C
    leaves this as the only unknown.
    """
    cosine, sine = np.cos(angle), np.sin(angle)
    length, centroid = linkage.rod4_length, linkage.rod4_centroid
    first_moment = linkage.rod4_mass * centroid + linkage.slider_mass * length
    second_moment = linkage.rod4_inertia + linkage.rod4_mass * centroid**2 + linkage.slider_mass * length**2
    # Across rod 4: the centripetal parts point along it and have no moment about C
    across = -sine * tip_ax + cosine * (tip_ay + linkage.gravity)
    found: float = (length * (-sine * fx + cosine * fy) - first_moment * across) / second_moment
    return found


@kernel
def slider_acceleration(
    q: NDArray[np.float64], v: NDArray[np.float64], fx: float, fy: float, moment: float, linkage: Any
) -> tuple[float, float, float]:
    """Return the slider's ax, ay (m/s^2) and alpha (rad/s^2) under the contact's fx, fy (N) and moment (N m).

    With an ideal crank pin; else see ``free_rocker``.

    A slider with clearance rotates under the contact's moment alone. An ideal slider's x stays, which gives
    rod 4's angular acceleration directly.
    """
    cx, cy = rocker_tip_acceleration(q, v, linkage)
    cosine, sine, w4 = np.cos(q[ROD4_ANGLE]), np.sin(q[ROD4_ANGLE]), v[ROD4_ANGLE]
    length = linkage.rod4_length
    if linkage.ideal_slider:
        alpha4 = (cx - length * w4 * w4 * cosine) / (length * sine)
        return 0.0, cy + length * (alpha4 * cosine - w4 * w4 * sine), 0.0
    alpha4 = rod4_acceleration(q[ROD4_ANGLE], cx, cy, fx, fy, linkage)
    ax = cx - length * (alpha4 * sine + w4 * w4 * cosine)
    ay = cy + length * (alpha4 * cosine - w4 * w4 * sine)
    return ax, ay, moment / linkage.slider_inertia
