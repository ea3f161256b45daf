"""Audit of the energy: work of motor and gravity against what is stored and what contacts dissipate.

Stored energies follow from a state. Works are integrals over time, summed up step by step by the trapezoidal
rule, of the same order as the integration. All five bodies are counted.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from exudyn_model.bodies import (
    CRANK_ANGLE,
    PER_BODY,
    SLIDER,
    SLIDER_ANGLE,
    SLIDER_X,
    SLIDER_Y,
    Y,
)
from exudyn_model.channels import (
    CONTACT,
    DAMPING,
    DISSIPATED_BY_FRICTION,
    DRIVE,
    GRAVITY,
    KINETIC,
    RESIDUAL,
)
from exudyn_model.compiled import kernel
from exudyn_model.constants import Constants
from exudyn_model.contact.gaps import corner_motion
from exudyn_model.contact.journal import crank_and_rod2, pin_motion
from exudyn_model.contact.laws import elastic_normals, side_energy
from exudyn_model.contact.point import elastic_force
from exudyn_model.contact.states import PIN, UPPER
from exudyn_model.parameters import Mechanism

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
    """Return the masses and inertias of x, y, angle of the five bodies, shape (15,); kg, kg m^2."""
    bodies = (mechanism.crank, mechanism.rod2, mechanism.rocker, mechanism.rod4, mechanism.slider)
    return np.array([value for body in bodies for value in (body.mass, body.mass, body.inertia)])


@kernel
def audit_energy(
    time: float,
    q: NDArray[np.float64],
    v: NDArray[np.float64],
    torque: float,
    masses: NDArray[np.float64],
    constants: Constants,
    contacts: NDArray[np.void],
    audit: Any,
    energies: NDArray[np.float64],
) -> None:
    """Fill ``energies`` (J, in the order of ``ENERGIES``) for the accepted state at ``time``.

    Drive, gravity, damping and friction count from t = 0, kinetic and contact energy are those stored now.
    The residual is work of motor and gravity less the increase of what is stored, less what is dissipated.

    Parameters
    ----------
    time : float
        s.
    q, v : ndarray, shape (15,)
        The slider's x counts from the guide's centre line.
    torque : float
        Motor on crank, N m.
    masses : ndarray, shape (15,)
        From :func:`mass_diagonal`.
    constants : Constants
    contacts : ndarray, shape (5,)
        Updated with this state.
    audit : record
        From :func:`new_audit`; changed in place.
    energies : ndarray, shape (7,)
    """
    linkage, law, pin_law = constants.linkage[0], constants.law[0], constants.pin_law[0]
    kinetic, height = 0.5 * np.sum(masses * v * v), 0.0
    for body in range(SLIDER + 1):
        height += linkage.gravity * masses[PER_BODY * body] * q[PER_BODY * body + Y]
    contact, damping_power, friction_power = 0.0, 0.0, 0.0
    if not linkage.ideal_slider:
        for side in range(2):
            lower, upper = -contacts[side].gap, -contacts[side + UPPER].gap
            contact += side_energy(lower, upper, law)
            elastic = elastic_normals(lower, upper, lower > 0.0 and upper > 0.0, law)
            for end in range(2):
                number = side + UPPER * end
                state = contacts[number]
                # On an elastic foundation the corner that is outside bears its part
                if state.gap < 0.0 or elastic[end] > 0.0:
                    # The wall takes up N times the speed of penetration, and stores the elastic part of it
                    damping_power += (elastic[end] - state.normal) * state.rate
                    motion = corner_motion(
                        number, q[SLIDER_X], q[SLIDER_ANGLE], v[SLIDER_X], v[SLIDER_Y], v[SLIDER_ANGLE], law
                    )
                    friction_power -= state.friction * motion.slip
    if not linkage.ideal_pin and contacts[PIN].gap < 0.0:
        state = contacts[PIN]
        elastic_pin = elastic_force(state.gap, pin_law)
        contact += elastic_pin * -state.gap / (pin_law.exponent + 1.0)
        damping_power += (elastic_pin - state.normal) * state.rate
        friction_power -= state.friction * pin_motion(crank_and_rod2(q, v), pin_law).slip
    drive_power = torque * v[CRANK_ANGLE]
    if time == 0.0:
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
    energies[DRIVE], energies[GRAVITY] = audit.drive, gravity
    energies[KINETIC], energies[CONTACT] = kinetic, contact
    energies[DAMPING], energies[DISSIPATED_BY_FRICTION] = audit.damping, audit.friction
    energies[RESIDUAL] = audit.drive + gravity - stored - audit.damping - audit.friction
