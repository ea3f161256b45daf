"""Accelerations by balance of forces where the crank pin has clearance: three angles are free.

The crank rotates as it is driven; rod 2, carried by the rocker's centroid B, hears of it through the contact
force at the pin alone. Rocker, rod 2 and rod 4 are described by their angles, from the frame's pivot H on:
B = H + b u3, rod 2's centre B - r u2, C = H + L3 u3, rod 4's centre C + s u4, the slider C + L4 u4, with u
the unit vector of an angle and n its derivative. D'Alembert's principle for each angle gives a linear system
for their second derivatives (Eqs. 14-21 with the joints' forces eliminated).
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from exudyn_model.accelerations import Forces
from exudyn_model.bodies import ROCKER_ANGLE, ROD2_ANGLE, ROD4_ANGLE
from exudyn_model.compiled import kernel


class FreeAngles(NamedTuple):
    """Angles (rad) of rod 2, rocker and rod 4, and their rates (rad/s)."""

    theta2: float
    w2: float
    theta3: float
    w3: float
    theta4: float
    w4: float


@kernel
def free_angular_accelerations(
    angles: FreeAngles, forces: Forces, linkage: Any
) -> tuple[float, float, float, float]:
    """Solve for the angular accelerations of rod 2, rocker and rod 4, and for an ideal slider's guide force.

    Parameters
    ----------
    angles : FreeAngles
    forces : Forces
        The moment on the slider is not read; an ideal slider has no contact force.
    linkage : record
        From ``constants.linkage_record``.

    Returns
    -------
    alpha2, alpha3, alpha4 : float
        rad/s^2.
    guide : float
        Force of the guide on an ideal slider along x, N; 0 on one with clearance.
    """
    theta2, w2, theta3, w3, theta4, w4 = angles
    fx, fy, pin_x, pin_y, pin_moment = forces.fx, forces.fy, forces.pin_x, forces.pin_y, forces.pin_moment
    to_b, length3, length4 = linkage.rocker_to_b, linkage.rocker_length, linkage.rod4_length
    centre2, centre4 = linkage.rod2_length - linkage.rod2_centroid, linkage.rod4_centroid
    m2, m4, m5 = linkage.rod2_mass, linkage.rod4_mass, linkage.slider_mass
    c2, s2 = np.cos(theta2), np.sin(theta2)
    c3, s3 = np.cos(theta3), np.sin(theta3)
    c4, s4 = np.cos(theta4), np.sin(theta4)
    cos23, sin23 = c2 * c3 + s2 * s3, s3 * c2 - c3 * s2
    cos34, sin34 = c3 * c4 + s3 * s4, s4 * c3 - c4 * s3
    first4 = m4 * centre4 + m5 * length4
    g = linkage.gravity

    # Equations of rocker, rod 2 and rod 4: inertias of each and between them
    inertia3 = linkage.rocker_inertia + (linkage.rocker_mass + m2) * to_b**2 + (m4 + m5) * length3 * length3
    inertia2 = linkage.rod2_inertia + m2 * centre2**2
    inertia4 = linkage.rod4_inertia + m4 * centre4**2 + m5 * length4**2
    between23, between34 = -m2 * to_b * centre2 * cos23, length3 * first4 * cos34
    # What is accelerated towards the centres of rotation, by n . u of the other angle; weights; forces
    moment3 = (
        m2 * to_b * centre2 * sin23 * w2 * w2
        + length3 * first4 * sin34 * w4 * w4
        - g * c3 * ((linkage.rocker_mass + m2) * to_b + (m4 + m5) * length3)
        + to_b * (c3 * pin_y - s3 * pin_x)
        + length3 * (c3 * fy - s3 * fx)
    )
    moment2 = (
        -m2 * to_b * centre2 * sin23 * w3 * w3
        + g * c2 * m2 * centre2
        + pin_moment
        - centre2 * (c2 * pin_y - s2 * pin_x)
    )
    moment4 = -length3 * first4 * sin34 * w3 * w3 - g * c4 * first4 + length4 * (c4 * fy - s4 * fx)

    # Rod 2 eliminated, then rod 4: alpha4 = offset + slope alpha3
    inertia = inertia3 - between23**2 / inertia2
    moment = moment3 - between23 * moment2 / inertia2
    if linkage.ideal_slider:
        # The slider's x is not accelerated; the guide's force has the arms d x / d theta
        arm3, arm4 = -length3 * s3, -length4 * s4
        offset = (length3 * c3 * w3 * w3 + length4 * c4 * w4 * w4) / arm4
        slope = -arm3 / arm4
        # The principle for a rotation of the rocker that takes rod 4 along
        alpha3 = (moment + slope * moment4 - (between34 + slope * inertia4) * offset) / (
            inertia + slope * (2.0 * between34 + slope * inertia4)
        )
        alpha4 = offset + slope * alpha3
        guide = (between34 * alpha3 + inertia4 * alpha4 - moment4) / arm4
    else:
        offset, slope = moment4 / inertia4, -between34 / inertia4
        alpha3 = (moment - between34 * offset) / (inertia + between34 * slope)
        alpha4, guide = offset + slope * alpha3, 0.0
    return (moment2 - between23 * alpha3) / inertia2, alpha3, alpha4, guide


@kernel
def slider_acceleration_with_pin_clearance(
    q: NDArray[np.float64], v: NDArray[np.float64], forces: Forces, linkage: Any
) -> tuple[float, float, float]:
    """Return the slider's ax, ay (m/s^2) and alpha (rad/s^2).

    Parameters
    ----------
    q, v : ndarray, shape (15,)
        x, y, angle of the five bodies and their rates.
    forces : Forces
        Of the contacts.
    linkage : record
        From ``constants.linkage_record``.
    """
    angles = FreeAngles(
        q[ROD2_ANGLE], v[ROD2_ANGLE], q[ROCKER_ANGLE], v[ROCKER_ANGLE], q[ROD4_ANGLE], v[ROD4_ANGLE]
    )
    _, alpha3, alpha4, _ = free_angular_accelerations(angles, forces, linkage)
    length3, c3, s3, w3 = linkage.rocker_length, np.cos(angles.theta3), np.sin(angles.theta3), angles.w3
    length4, c4, s4, w4 = linkage.rod4_length, np.cos(angles.theta4), np.sin(angles.theta4), angles.w4
    ax = -length3 * (alpha3 * s3 + w3 * w3 * c3) - length4 * (alpha4 * s4 + w4 * w4 * c4)
    ay = length3 * (alpha3 * c3 - w3 * w3 * s3) + length4 * (alpha4 * c4 - w4 * w4 * s4)
    if linkage.ideal_slider:
        return 0.0, ay, 0.0
    return ax, ay, forces.moment / linkage.slider_inertia
