"""One point against one surface: the record of its constants, and the damped normal force (Eqs. 9-11)."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from exudyn_model.compiled import kernel
from exudyn_model.parameters import Contact

_SURFACE = (
    "stiffness",
    "exponent",
    "damping",
    "impact_speed_floor",
    "friction",
    "static_speed",
    "transition_speed",
)
_COMMON = ("kind", "current", "step", "stays_open", "mass")


def law_type(*geometry: str) -> np.dtype[np.void]:
    """Return the type of a record with the constants of a contact, among them those named in ``geometry``.

    "kind" is the law of a side of the slider (``laws.LAWS``), 0 elsewhere; "current" is 1 where the damping
    has no memory. Two fields belong to the step in progress (``five_bodies.step_choice``): "step", its length
    (s), and "stays_open", 1 where what is open at its start stays without force to its end.
    """
    return np.dtype([(name, np.float64) for name in (*_SURFACE, *_COMMON, *geometry)])


def surface_law(kind: np.dtype[np.void], contact: Contact, step: float, mass: float) -> NDArray[np.void]:
    """Make such a record, shape (1,): constants in SI units, step (s), mass that the contact carries (kg)."""
    law = np.zeros(1, kind)
    for name in _SURFACE:
        law[name] = getattr(contact, name)
    law["current"] = contact.impact_speed == "current"
    law["step"], law["mass"] = step, mass
    return law


@kernel
def elastic_force(gap: float, law: Any) -> float:
    """Eq. 9 for a negative gap (m): K depth^n, in N."""
    force: float = law.stiffness * (-gap) ** law.exponent
    return force


@kernel
def damped(elastic: float, depth_rate: float, impact_speed: float, law: Any) -> float:
    """Eq. 11: elastic (1 + C depth_rate / impact_speed) in N, at least 0: a surface cannot pull.

    Without memory the impact speed (m/s) is replaced by sqrt(depth_rate^2 + floor^2).
    """
    if law.current > 0.0:
        impact_speed = np.sqrt(depth_rate * depth_rate + law.impact_speed_floor * law.impact_speed_floor)
    force: float = elastic * (1.0 + law.damping * depth_rate / impact_speed)
    return max(force, 0.0)
