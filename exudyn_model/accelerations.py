"""Accelerations of the slider by balance of forces at one state of the mechanism.

Exudyn's own accelerations are not used: with constraints at position level they carry the Newton
iteration's error divided by the square of the step. Here they follow from positions, velocities and
contact forces alone, so they are as accurate as the state.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from exudyn_model.compiled import kernel
from exudyn_model.parameters import Parameters
from exudyn_model.rocker_tip import tip_jerk

_LINKAGE = np.dtype(
    [
        (name, np.float64)
        for name in (
            "crank_length",
            "rod2_length",
            "rocker_to_b",
            "rocker_length",
            "rod2_centroid",
            "rod2_mass",
            "rod2_inertia",
            "rocker_mass",
            "rocker_inertia",
            "rod4_centroid",
            "rod4_length",
            "rod4_mass",
            "rod4_inertia",
            "slider_mass",
            "slider_inertia",
            "gravity",
            "guide_x",
            "pivot_x",
            "pivot_y",
            "rocker_branch",
            "crank_angle",
            "omega",
            "tip_jerk",
        )
    ]
    + [("ideal_slider", np.bool_), ("ideal_pin", np.bool_)]
)


def linkage_record(parameters: Parameters) -> NDArray[np.void]:
    """Collect the constants of linkage and drive for the kernels (SI units, rad), shape (1,)."""
    mechanism = parameters.mechanism
    linkage = np.zeros(1, _LINKAGE)
    linkage["crank_length"] = mechanism.crank.length
    linkage["rod2_length"] = mechanism.rod2.length
    linkage["rocker_to_b"] = mechanism.rocker.centroid
    linkage["rocker_length"] = mechanism.rocker.length
    for name, rod in (("rod2", mechanism.rod2), ("rod4", mechanism.rod4)):
        linkage[f"{name}_centroid"] = rod.centroid
        linkage[f"{name}_mass"] = rod.mass
        linkage[f"{name}_inertia"] = rod.inertia
    linkage["rocker_mass"] = mechanism.rocker.mass
    linkage["rocker_inertia"] = mechanism.rocker.inertia
    linkage["rod4_length"] = mechanism.rod4.length
    linkage["slider_mass"] = mechanism.slider.mass
    linkage["slider_inertia"] = mechanism.slider.inertia
    linkage["gravity"] = mechanism.gravity
    linkage["guide_x"] = mechanism.guide_x
    linkage["pivot_x"], linkage["pivot_y"] = mechanism.rocker_pivot
    linkage["rocker_branch"] = mechanism.rocker_branch
    linkage["crank_angle"] = mechanism.crank_angle
    linkage["omega"] = parameters.drive.omega
    linkage["ideal_slider"] = mechanism.ideal_slider
    linkage["ideal_pin"] = parameters.journal is None
    if parameters.journal is None:
        linkage["tip_jerk"] = tip_jerk(linkage[0])
    return linkage


@kernel
def rocker_tip_acceleration(
    q: NDArray[np.float64], v: NDArray[np.float64], linkage: Any
) -> tuple[float, float]:
    """Find the acceleration of joint C (m/s^2), with the crank at constant speed.

    Second derivative of the loop O-A-B-H, resolved along rod 2 so that its own angular acceleration drops
    out. ``q`` and ``v``, shape (15,), hold x, y, angle of the five bodies and their rates.
    """
    c1, s1, w1 = np.cos(q[2]), np.sin(q[2]), v[2]
    c2, s2, w2 = np.cos(q[5]), np.sin(q[5]), v[5]
    c3, s3, w3 = np.cos(q[8]), np.sin(q[8]), v[8]
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
    """Find rod 4's angular acceleration (rad/s^2) from its angle, C's acceleration and the contact force.

    Rod 4 and the slider together turn about C, which moves as the drive makes it; taking moments about C
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
    """Find the slider's ax, ay (m/s^2) and alpha (rad/s^2) under the contact's fx, fy (N) and moment (N m).

    With an ideal crank pin; else see ``loose_pin``.

    Loose slider: it turns under the contact's moment alone. Ideal slider: its x stays, which gives rod 4's
    angular acceleration directly.
    """
    cx, cy = rocker_tip_acceleration(q, v, linkage)
    cosine, sine, w4 = np.cos(q[11]), np.sin(q[11]), v[11]
    length = linkage.rod4_length
    if linkage.ideal_slider:
        alpha4 = (cx - length * w4 * w4 * cosine) / (length * sine)
        return 0.0, cy + length * (alpha4 * cosine - w4 * w4 * sine), 0.0
    alpha4 = rod4_acceleration(q[11], cx, cy, fx, fy, linkage)
    ax = cx - length * (alpha4 * sine + w4 * w4 * cosine)
    ay = cy + length * (alpha4 * cosine - w4 * w4 * sine)
    return ax, ay, moment / linkage.slider_inertia
