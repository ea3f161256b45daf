"""The slider's acceleration where the crank pin has clearance: three angles are free.

The crank turns as it is driven; rod 2, carried by the rocker's centroid B, hears of it through the contact
force at the pin alone. Rocker, rod 2 and rod 4 are described by their angles, from the frame's pivot H on:
B = H + b u3, rod 2's centre B - r u2, C = H + L3 u3, rod 4's centre C + s u4, the slider C + L4 u4, with u
the unit vector of an angle and n its derivative. D'Alembert's principle for each angle gives a linear system
for their second derivatives (Eqs. 15-21 with the joints' forces eliminated).
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from exudyn_model.compiled import kernel


@kernel
def loose_pin_acceleration(
    q: NDArray[np.float64],
    v: NDArray[np.float64],
    pin_x: float,
    pin_y: float,
    pin_moment: float,
    fx: float,
    fy: float,
    moment: float,
    linkage: Any,
) -> tuple[float, float, float]:
    """Find the slider's ax, ay (m/s^2) and alpha (rad/s^2).

    Parameters
    ----------
    q, v : ndarray, shape (15,)
        x, y, angle of the five bodies and their rates.
    pin_x, pin_y, pin_moment : float
        Contact force on rod 2 (N) and its moment about rod 2's centre (N m).
    fx, fy, moment : float
        Contact force (N) and moment (N m) on a loose slider.
    linkage : record
        From ``accelerations.linkage_record``.
    """
    to_b, length3, length4 = linkage.rocker_to_b, linkage.rocker_length, linkage.rod4_length
    centre2, centre4 = linkage.rod2_length - linkage.rod2_centroid, linkage.rod4_centroid
    m2, m4, m5 = linkage.rod2_mass, linkage.rod4_mass, linkage.slider_mass
    c2, s2, w2 = np.cos(q[5]), np.sin(q[5]), v[5]
    c3, s3, w3 = np.cos(q[8]), np.sin(q[8]), v[8]
    c4, s4, w4 = np.cos(q[11]), np.sin(q[11]), v[11]
    cos23, sin23 = c2 * c3 + s2 * s3, s3 * c2 - c3 * s2
    cos34, sin34 = c3 * c4 + s3 * s4, s4 * c3 - c4 * s3
    first4 = m4 * centre4 + m5 * length4
    fourth = linkage.rod4_inertia + m4 * centre4**2 + m5 * length4**2
    g = linkage.gravity

    # Rows: angles of rocker, rod 2 and rod 4, then x of an ideal slider, which stays
    matrix, right = np.zeros((4, 4)), np.zeros(4)
    matrix[0, 0] = (
        linkage.rocker_inertia + (linkage.rocker_mass + m2) * to_b**2 + (m4 + m5) * length3 * length3
    )
    matrix[0, 1] = matrix[1, 0] = -m2 * to_b * centre2 * cos23
    matrix[0, 2] = matrix[2, 0] = length3 * first4 * cos34
    matrix[1, 1] = linkage.rod2_inertia + m2 * centre2**2
    matrix[2, 2] = fourth
    # What is accelerated towards the centres of rotation, by n . u of the other angle; weights; forces
    right[0] = (
        m2 * to_b * centre2 * sin23 * w2 * w2
        + length3 * first4 * sin34 * w4 * w4
        - g * c3 * ((linkage.rocker_mass + m2) * to_b + (m4 + m5) * length3)
        + to_b * (c3 * pin_y - s3 * pin_x)
        + length3 * (c3 * fy - s3 * fx)
    )
    right[1] = (
        -m2 * to_b * centre2 * sin23 * w3 * w3
        + g * c2 * m2 * centre2
        + pin_moment
        - centre2 * (c2 * pin_y - s2 * pin_x)
    )
    right[2] = -length3 * first4 * sin34 * w3 * w3 - g * c4 * first4 + length4 * (c4 * fy - s4 * fx)
    matrix[3, 3] = 1.0
    if linkage.ideal_slider:
        matrix[0, 3] = matrix[3, 0] = -length3 * s3
        matrix[2, 3] = matrix[3, 2] = -length4 * s4
        matrix[3, 3] = 0.0
        right[3] = length3 * c3 * w3 * w3 + length4 * c4 * w4 * w4
    found = np.linalg.solve(matrix, right)
    alpha3, alpha4 = found[0], found[2]
    ax = -length3 * (alpha3 * s3 + w3 * w3 * c3) - length4 * (alpha4 * s4 + w4 * w4 * c4)
    ay = length3 * (alpha3 * c3 - w3 * w3 * s3) + length4 * (alpha4 * c4 - w4 * w4 * s4)
    if linkage.ideal_slider:
        return 0.0, ay, 0.0
    return ax, ay, moment / linkage.slider_inertia
