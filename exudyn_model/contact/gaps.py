"""Gaps of the slider's corners: each sees the infinite wall on its own side (Eqs. 1-6).

A corner is a sharp point; its wall stands at the guide's centre line +- (half width + clearance).
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from exudyn_model.compiled import kernel
from exudyn_model.contact.laws import LAWS
from exudyn_model.contact.point import law_type, surface_law
from exudyn_model.contact.states import ACROSS, ALONG
from exudyn_model.parameters import Guide, Slider

_LAW = law_type("half_width", "half_length", "clearance", "side_stiffness")


def contact_law(contact: Guide, slider: Slider, step: float) -> NDArray[np.void]:
    """Collect the constants of the kernels in one record, shape (1,); lengths in m, the step in s."""
    law = surface_law(_LAW, contact, step, slider.mass)
    law["half_width"] = slider.width / 2
    law["half_length"] = slider.length / 2
    law["clearance"] = contact.clearance
    law["kind"] = LAWS.index(contact.law)
    law["side_stiffness"] = contact.side_stiffness
    return law


class CornerMotion(NamedTuple):
    """Motion of one corner against its wall.

    Attributes
    ----------
    gap, rate : float
        Gap (m), positive where it is open, and its rate (m/s).
    slip : float
        Speed of the corner along +y, m/s.
    arm_x, arm_y : float
        From the slider's centre to the corner, m.
    """

    gap: float
    rate: float
    slip: float
    arm_x: float
    arm_y: float


@kernel
def corner_motion(
    number: int, x: float, angle: float, vx: float, vy: float, omega: float, law: Any
) -> CornerMotion:
    """Return the motion of one of ``CORNERS``; ``x`` counts from the guide's centre line."""
    outward = ACROSS[number]
    sx, sy = outward * law.half_width, ALONG[number] * law.half_length
    cosine, sine = np.cos(angle), np.sin(angle)
    rx, ry = cosine * sx - sine * sy, sine * sx + cosine * sy
    # Not as a difference of distances from the centre line, which are a hundred times the clearance: a depth
    # of 1e-11 m, at rest in the "strip" law, is to keep its digits
    gap = law.clearance - outward * (x - sine * sy) + 2.0 * law.half_width * np.sin(0.5 * angle) ** 2
    rate = -outward * (vx - omega * ry)
    return CornerMotion(gap, rate, vy + omega * rx, rx, ry)
