"""The slider-crank inside the press, and its closed form.

With the rocker's pivot on the crank's, crank, rod 2 and rocker are one triangle that turns with the crank: a
crank of the rocker's length. What is left is the slider-crank of the textbooks with an offset guide.
"""

import numpy as np

CHANGES = {
    "mechanism.rocker_pivot": [0.0, 0.0],
    "mechanism.rod2.length": 0.11,
    "mechanism.rocker.length": 0.2,
    "mechanism.rocker.centroid": 0.1,
    "mechanism.rod4.length": 0.6,
    "mechanism.rod4.centroid": 0.25,
    "mechanism.guide_x": 0.05,
    "mechanism.reference_offset": 0.0,
    "output.groups": ["accelerations", "joints"],
    "drive.cycles": 1.0,
}
"""To the scene "ideal"; any triangle will do, and a rod 4 that is longer than rocker and offset together."""


def closed_form(scene, time):
    """Return y, velocity, acceleration of the slider, and the torque by which the crank keeps its speed."""
    m, g, omega = (
        scene["mechanism"],
        scene["environment"]["gravity"],
        scene["drive"]["speed_rpm"] * np.pi / 30,
    )
    crank, rod2, rocker, rod4 = (m[name] for name in ("crank", "rod2", "rocker", "rod4"))
    a, b, c = crank["length"], rod2["length"], rocker["centroid"]
    u1 = np.exp(1j * (np.radians(m["crank_angle_deg"]) + omega * time))
    # Law of cosines; B lies left of the line from A to O, so that the rocker lags behind the crank.
    beta = m["rocker_branch"] * np.arccos((a * a + c * c - b * b) / (2 * a * c))
    u3 = u1 * np.exp(-1j * beta)
    C, vC, aC = (rocker["length"] * u3 * (1j * omega) ** order for order in range(3))
    # Rod 4 reaches from C across by w and down by r.
    L4 = rod4["length"]
    w, dw, ddw = m["guide_x"] + m["reference_offset"] - C.real, -vC.real, -aC.real
    r = np.sqrt(L4**2 - w**2)
    dr = -w * dw / r
    ddr = -(dw**2 + w * ddw + dr**2) / r
    down = -m["slider_branch"]
    y, vy, ay = (C - 1j * down * r).imag, (vC - 1j * down * dr).imag, (aC - 1j * down * ddr).imag
    omega4 = down * dw / r
    alpha4 = down * (ddw / r - dw * dr / r**2)
    share = rod4["centroid"] / L4
    v4, a4 = vC + share * (dw - 1j * down * dr), aC + share * (ddw - 1j * down * ddr)
    A, B = a * u1, c * u3
    triangle = (
        crank["mass"] * crank["centroid"] * u1
        + rod2["mass"] * (A + rod2["centroid"] / b * (B - A))
        + rocker["mass"] * B
    )
    power = (
        g * (1j * omega * triangle).imag
        + rod4["mass"] * ((a4 * v4.conj()).real + g * v4.imag)
        + rod4["inertia"] * omega4 * alpha4
        + m["slider"]["mass"] * (ay + g) * vy
    )
    return {"slider_y": y, "slider_vy": vy, "slider_ay": ay, "crank_torque": power / omega}
