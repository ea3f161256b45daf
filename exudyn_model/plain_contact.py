"""The contact force of ``contact`` in plain Python: easier to read, and a check on the compiled form.

It reads the same memory and gives the same forces to round-off, as an ``ObjectGenericODE2`` user function
too; each call takes some ten times as long.
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exudyn_model.parameters import Contact, Slider


def slider_force(
    q: list[float], v: list[float], contact: Contact, slider: Slider, step: float, corners: NDArray[np.void]
) -> tuple[float, float, float]:
    """Contact force (N) and moment about the slider's centre (N m) in a trial state.

    Parameters
    ----------
    q, v : list of float, length 3
        Slider's x from the guide's centre line, y, angle, and their rates (m, rad, s).
    contact, slider : Contact, Slider
    step : float
        Integration step, s.
    corners : ndarray, shape (4,)
        State of the corners at the start of the step; see ``contact.corner_states``.
    """
    force_x, force_y, moment = 0.0, 0.0, 0.0
    places = [(side, end) for end in (-1, 1) for side in (-1, 1)]  # ll, lr, ul, ur
    for (side, end), memory in zip(places, corners, strict=True):
        # Arm of the corner, turned by the slider's angle
        across, along = side * slider.width / 2, end * slider.length / 2
        arm_x = across * math.cos(q[2]) - along * math.sin(q[2])
        arm_y = across * math.sin(q[2]) + along * math.cos(q[2])
        wall = side * (slider.width / 2 + contact.clearance)
        gap = side * (wall - q[0] - arm_x)
        rate = -side * (v[0] - v[2] * arm_y)
        slip = v[1] + v[2] * arm_x
        if gap >= 0:
            continue
        impact_speed = memory["impact_speed"] or _impact_speed(
            memory["gap"], memory["rate"], gap, rate, step, contact
        )
        # Eqs. 9-11; a wall cannot pull
        elastic = contact.stiffness * (-gap) ** contact.exponent
        normal = max(elastic * (1 - contact.damping * rate / impact_speed), 0.0)
        # Eqs. 13-14
        ramp = (abs(slip) - contact.static_speed) / (contact.transition_speed - contact.static_speed)
        friction = -math.copysign(contact.friction * min(max(ramp, 0.0), 1.0) * normal, slip)
        force_x -= side * normal
        force_y += friction
        moment += arm_x * friction + arm_y * side * normal
    return force_x, force_y, moment


def _impact_speed(
    gap0: float, rate0: float, gap1: float, rate1: float, step: float, contact: Contact
) -> float:
    """Speed at which a corner that was open at the step's start touches before its end."""

    def gap_at(share: float) -> float:
        """Cubic Hermite interpolant of the gap."""
        rest = 1 - share
        ends = gap0 * (1 + 2 * share) * rest**2 + gap1 * (1 + 2 * rest) * share**2
        return ends + step * share * rest * (rate0 * rest - rate1 * share)

    low, high = 0.0, 1.0
    for _ in range(60):  # halved down to round-off
        middle = 0.5 * (low + high)
        low, high = (middle, high) if gap_at(middle) > 0 else (low, middle)
    return max(-(rate0 + low * (rate1 - rate0)), contact.impact_speed_floor)


def force_user_function(
    contact: Contact, slider: Slider, step: float, corners: NDArray[np.void]
) -> Callable[[Any, float, int, list[float], list[float]], tuple[float, float, float]]:
    """``forceUserFunction`` of an ``ObjectGenericODE2`` on the slider's node, without compiled code."""

    def force(mbs: Any, t: float, number: int, q: list[float], v: list[float]) -> tuple[float, float, float]:
        del mbs, t, number
        return slider_force(q, v, contact, slider, step, corners)

    return force
