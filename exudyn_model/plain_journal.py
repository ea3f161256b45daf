"""The contact force of ``journal`` in plain Python, as ``plain_contact`` is that of the corners."""

import cmath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exudyn_model.contact import ForceUserFunction
from exudyn_model.parameters import Journal, Mechanism
from exudyn_model.plain_contact import friction, impact_speed
from exudyn_model.point_contact import PIN


def journal_force(
    q: list[float],
    v: list[float],
    journal: Journal,
    mechanism: Mechanism,
    step: float,
    contacts: NDArray[np.void],
) -> tuple[float, float, float, float, float, float]:
    """Force and moment on the crank, then on rod 2 (N, N m), in a trial state.

    Parameters
    ----------
    q, v : list of float, length 6
        x, y, angle of crank and rod 2, and their rates (m, rad, s).
    journal, mechanism : Journal, Mechanism
    step : float
        Integration step, s.
    contacts : ndarray, shape (5,)
        State of the contacts at the start of the step; see ``point_contact.contact_states``.
    """
    # The plane as complex numbers: a turn by +90 degrees is a factor of 1j
    arm_journal = mechanism.crank.to_tip * cmath.exp(1j * q[2])
    arm_bearing = -mechanism.rod2.centroid * cmath.exp(1j * q[5])
    eccentricity = complex(q[0], q[1]) + arm_journal - complex(q[3], q[4]) - arm_bearing
    gap = journal.clearance - abs(eccentricity)
    if gap >= 0:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    normal_direction = eccentricity / abs(eccentricity)
    # Material of both bodies in the point of the bearing's surface
    point = (journal.radius + journal.clearance) * normal_direction
    arm1, arm2 = arm_journal + point - eccentricity, arm_bearing + point
    relative = complex(v[3], v[4]) + 1j * v[5] * arm2 - complex(v[0], v[1]) - 1j * v[2] * arm1
    local = relative * normal_direction.conjugate()  # along the normal, and along it turned by +90 degrees
    at_impact = impact_speed(contacts[PIN], gap, local.real, step, journal)
    elastic = journal.stiffness * (-gap) ** journal.exponent
    normal = max(elastic * (1 - journal.damping * local.real / at_impact), 0.0)
    force = complex(normal, friction(normal, local.imag, journal)) * normal_direction
    moment1 = -(arm1.conjugate() * force).imag
    moment2 = (arm2.conjugate() * force).imag
    return -force.real, -force.imag, moment1, force.real, force.imag, moment2


def force_user_function(
    journal: Journal, mechanism: Mechanism, step: float, contacts: NDArray[np.void]
) -> ForceUserFunction:
    """``forceUserFunction`` of an ``ObjectGenericODE2`` on the nodes of crank and rod 2."""

    def force(mbs: Any, t: float, number: int, q: list[float], v: list[float]) -> tuple[float, ...]:
        del mbs, t, number
        return journal_force(q, v, journal, mechanism, step, contacts)

    return force
