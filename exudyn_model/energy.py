"""Audit of the energy: work of motor and gravity against what is stored and what contacts dissipate.

Stored energies follow from a state. Works are integrals over time, summed up step by step by the trapezoidal
rule, of the same order as the integration. All five bodies are counted.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from exudyn_model.compiled import kernel
from exudyn_model.contact import corner_motion
from exudyn_model.journal import crank_and_rod2, pin_motion
from exudyn_model.parameters import Mechanism
from exudyn_model.point_contact import PIN
from exudyn_model.side_law import elastic_normals, side_energy

ENERGIES = tuple(
    f"energy_{name}" for name in ("drive", "gravity", "kinetic", "contact", "damping", "friction", "residual")
)

# Powers (W) in the last state and their integrals (J); energies of the initial state (J)
_AUDIT = np.dtype(
    [
        (name, np.float64)
        for name in (
            "drive_power",
            "damping_power",
            "friction_power",
            "drive",
            "damping",
            "friction",
            "initial_height",
            "initial_stored",
        )
    ]
)


def new_audit() -> NDArray[np.void]:
    """Make the sums of the audit, before the initial state, shape (1,)."""
    return np.zeros(1, _AUDIT)


def mass_diagonal(mechanism: Mechanism) -> NDArray[np.float64]:
    """Masses and inertias that belong to x, y, angle of the five bodies, shape (15,); kg, kg m^2."""
    bodies = (mechanism.crank, mechanism.rod2, mechanism.rocker, mechanism.rod4, mechanism.slider)
    return np.array([value for body in bodies for value in (body.mass, body.mass, body.inertia)])


@kernel
def audit_energy(
    index: int,
    q: NDArray[np.float64],
    v: NDArray[np.float64],
    torque: float,
    masses: NDArray[np.float64],
    linkage: Any,
    law: Any,
    pin_law: Any,
    contacts: NDArray[np.void],
    audit: Any,
    energies: NDArray[np.float64],
) -> None:
    """Fill ``energies`` (J, in the order of ``ENERGIES``) for accepted state ``index``.

    Drive, gravity, damping and friction count from t = 0, kinetic and contact energy are those stored now.
    The residual is work of motor and gravity less the increase of what is stored, less what is dissipated.

    Parameters
    ----------
    index : int
        Number of steps from t = 0.
    q, v : ndarray, shape (15,)
        The slider's x counts from the guide's centre line.
    torque : float
        Motor on crank, N m.
    masses : ndarray, shape (15,)
        From :func:`mass_diagonal`.
    linkage, law, pin_law : record
        From ``accelerations``, ``contact`` and ``journal``.
    contacts : ndarray, shape (5,)
        Renewed with this state.
    audit : record
        From :func:`new_audit`; changed in place.
    energies : ndarray, shape (7,)
    """
    kinetic, height = 0.5 * np.sum(masses * v * v), 0.0
    for body in range(5):
        height += linkage.gravity * masses[3 * body] * q[3 * body + 1]
    contact, damping_power, friction_power = 0.0, 0.0, 0.0
    if not linkage.ideal_slider:
        for side in range(2):
            lower, upper = -contacts[side].gap, -contacts[side + 2].gap
            contact += side_energy(lower, upper, law)
            elastic = elastic_normals(lower, upper, lower > 0.0 and upper > 0.0, law)
            for end in range(2):
                state = contacts[side + 2 * end]
                if state.gap < 0.0:
                    # The wall takes up N times the speed of penetration, and stores the elastic part of it
                    damping_power += (elastic[end] - state.normal) * state.rate
                    slip = corner_motion(side + 2 * end, q[12], q[14], v[12], v[13], v[14], law)[2]
                    friction_power -= state.friction * slip
    if not linkage.ideal_pin and contacts[PIN].gap < 0.0:
        state = contacts[PIN]
        elastic_force = pin_law.stiffness * (-state.gap) ** pin_law.exponent
        contact += elastic_force * -state.gap / (pin_law.exponent + 1.0)
        damping_power += (elastic_force - state.normal) * state.rate
        slip = pin_motion(crank_and_rod2(q, v), pin_law)[2]
        friction_power -= state.friction * slip
    drive_power = torque * v[2]
    if index == 0:
        audit.initial_height, audit.initial_stored = height, kinetic + contact
    else:
        half = 0.5 * law.step
        audit.drive += half * (audit.drive_power + drive_power)
        audit.damping += half * (audit.damping_power + damping_power)
        audit.friction += half * (audit.friction_power + friction_power)
    audit.drive_power, audit.damping_power = drive_power, damping_power
    audit.friction_power = friction_power
    gravity = audit.initial_height - height
    stored = kinetic + contact - audit.initial_stored
    energies[0], energies[1], energies[2], energies[3] = audit.drive, gravity, kinetic, contact
    energies[4], energies[5] = audit.damping, audit.friction
    energies[6] = audit.drive + gravity - stored - audit.damping - audit.friction
