"""The contact forces of the Exudyn model in plain Python: easier to read, and a check on the compiled form.

They read the same states of the contacts and give the same forces to round-off, as ``ObjectGenericODE2`` user
functions too; each call takes some ten times as long. No run uses them: ``exudyn_contact.py`` measures them,
and ``tests/exudyn_model`` holds the compiled forms against them.
"""

import cmath
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exudyn_model.compiled import ForceUserFunction
from exudyn_model.contact.states import CORNERS, PIN
from exudyn_model.parameters import Contact, Guide, Journal, Mechanism, Slider


def slider_force(
    q: list[float], v: list[float], contact: Guide, slider: Slider, step: float, corners: NDArray[np.void]
) -> tuple[float, float, float]:
    """Contact force (N) and moment about the slider's centre (N m) in a trial state.

    Parameters
    ----------
    q, v : list of float, length 3
        Slider's x from the guide's centre line, y, angle, and their rates (m, rad, s).
    contact, slider : Guide, Slider
    step : float
        Integration step, s.
    corners : ndarray, shape (5,)
        States of the contacts at the start of the step: see ``contact.states``.
    """
    force_x, force_y, moment = 0.0, 0.0, 0.0
    for side in (-1, 1):
        if contact.law == "foundation":
            load = _foundation_force(side, q, v, contact, slider, step, corners)
            force_x, force_y, moment = force_x + load[0], force_y + load[1], moment + load[2]
            continue
        touching = []
        for end in (-1, 1):
            # Arm of the corner, rotated by the slider's angle
            across, along = side * slider.width / 2, end * slider.length / 2
            arm_x = across * math.cos(q[2]) - along * math.sin(q[2])
            arm_y = across * math.sin(q[2]) + along * math.cos(q[2])
            wall = side * (slider.width / 2 + contact.clearance)
            gap = side * (wall - q[0] - arm_x)
            rate = -side * (v[0] - v[2] * arm_y)
            if gap < 0:
                memory = corners[CORNERS.index(("l" if end < 0 else "u") + ("l" if side < 0 else "r"))]
                touching.append((-gap, -rate, impact_speed(memory, gap, rate, step, contact), arm_x, arm_y))
        elastic, damped = _elastic([depth for depth, *_ in touching], contact)
        for (_, depth_rate, at_impact, arm_x, arm_y), force in zip(touching, elastic, strict=True):
            # Eq. 11; a wall cannot pull
            normal = force * _damping(depth_rate, at_impact, contact) if damped else force
            tangential = friction(normal, v[1] + v[2] * arm_x, contact)
            force_x -= side * normal
            force_y += tangential
            moment += arm_x * tangential + arm_y * side * normal
    return force_x, force_y, moment


def _elastic(depths: list[float], contact: Guide) -> tuple[list[float], bool]:
    """Elastic normal forces (N) of the touching corners of one side; whether they are damped."""
    forces = [contact.stiffness * depth**contact.exponent for depth in depths]
    if len(depths) < 2 or contact.law == "hertz-corners":
        return forces, True
    total = sum(depths)
    if contact.law == "paper-switching":
        # Each corner bears a third of what lies over it alone and a sixth of the other's
        return [contact.side_stiffness * (total + depth) / 6 for depth in depths], False
    harmonic = depths[0] * depths[1] / total
    return [
        force + 4 * contact.side_stiffness * harmonic * (1 - depth / total) ** 2
        for force, depth in zip(forces, depths, strict=True)
    ], True


def _damping(depth_rate: float, at_impact: float, contact: Contact) -> float:
    """Factor of Eq. 11, at least 0; without memory the speed at impact is replaced by the present one."""
    if contact.impact_speed == "current":
        at_impact = math.hypot(depth_rate, contact.impact_speed_floor)
    return max(1 + contact.damping * depth_rate / at_impact, 0.0)


def _foundation_force(
    side: int,
    q: list[float],
    v: list[float],
    contact: Guide,
    slider: Slider,
    step: float,
    corners: NDArray[np.void],
) -> tuple[float, float, float]:
    """Force (N) and moment (N m) of one side on an elastic foundation, in the point of its resultant."""
    rotation, depths, rates, known = cmath.exp(1j * q[2]), [], [], []
    ends = [complex(side * slider.width / 2, end * slider.length / 2) * rotation for end in (-1, 1)]
    for name, arm in zip(("lr", "ur") if side > 0 else ("ll", "ul"), ends, strict=True):
        depths.append(side * (q[0] + arm.real) - slider.width / 2 - contact.clearance)
        rates.append(side * (v[0] - v[2] * arm.imag))
        known.append(corners[CORNERS.index(name)])
    at_impact = max(memory["impact_speed"] for memory in known)
    if max(depths) <= 0:
        return 0.0, 0.0, 0.0
    if at_impact == 0:
        # What was open: the corner that touches first
        touching = [n for n in range(2) if depths[n] > 0]
        first = min(touching, key=lambda n: _touch(known[n], -depths[n], -rates[n], step, contact)[0])
        at_impact = _touch(known[first], -depths[first], -rates[first], step, contact)[1]
    # The pressure falls linearly from the deeper end, to the other one or to where the side leaves the wall
    inside = min(1.0, max(depths) / (max(depths) - min(depths))) if min(depths) < 0 else 1.0
    shallow = max(min(depths), 0.0)
    elastic = contact.side_stiffness * inside * (max(depths) + shallow) / 2
    place = inside * (max(depths) + 2 * shallow) / (3 * (max(depths) + shallow))
    shares = [1 - place, place] if depths[0] > depths[1] else [place, 1 - place]
    normal = elastic * _damping(float(np.dot(shares, rates)), at_impact, contact)
    arm = complex(np.dot(shares, ends))
    force = complex(-side * normal, friction(normal, v[1] + v[2] * arm.real, contact))
    return force.real, force.imag, (arm.conjugate() * force).imag


def friction(normal: float, slip: float, contact: Contact) -> float:
    """Eqs. 12-13, N."""
    ramp = (abs(slip) - contact.static_speed) / (contact.transition_speed - contact.static_speed)
    return -math.copysign(contact.friction * min(max(ramp, 0.0), 1.0) * normal, slip)


def impact_speed(memory: Any, gap: float, rate: float, step: float, contact: Contact) -> float:
    """Impact speed (m/s) that a closed contact's damping refers to; ``memory``: its state before."""
    return float(memory["impact_speed"] or _touch(memory, gap, rate, step, contact)[1])


def _touch(memory: Any, gap1: float, rate1: float, step: float, contact: Contact) -> tuple[float, float]:
    """Fraction of the step at which a contact closes that was open at its start, and the speed there."""
    gap0, rate0 = float(memory["gap"]), float(memory["rate"])

    def gap_at(fraction: float) -> float:
        """Cubic Hermite interpolant of the gap."""
        rest = 1 - fraction
        ends = gap0 * (1 + 2 * fraction) * rest**2 + gap1 * (1 + 2 * rest) * fraction**2
        return ends + step * fraction * rest * (rate0 * rest - rate1 * fraction)

    low, high = 0.0, 1.0
    for _ in range(60):  # halved down to round-off
        middle = 0.5 * (low + high)
        low, high = (middle, high) if gap_at(middle) > 0 else (low, middle)
    return low, max(-(rate0 + low * (rate1 - rate0)), contact.impact_speed_floor)


def corners_user_function(
    contact: Guide, slider: Slider, step: float, corners: NDArray[np.void]
) -> ForceUserFunction:
    """``forceUserFunction`` of an ``ObjectGenericODE2`` on the slider's node, without compiled code."""

    def force(mbs: Any, t: float, number: int, q: list[float], v: list[float]) -> tuple[float, ...]:
        del mbs, t, number
        return slider_force(q, v, contact, slider, step, corners)

    return force


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
        States of the contacts at the start of the step: see ``contact.states``.
    """
    # The plane as complex numbers: a rotation by +90 degrees is a factor of 1j
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
    local = relative * normal_direction.conjugate()  # along the normal, and along it rotated by +90 degrees
    at_impact = impact_speed(contacts[PIN], gap, local.real, step, journal)
    elastic = journal.stiffness * (-gap) ** journal.exponent
    normal = elastic * _damping(-local.real, at_impact, journal)
    force = complex(normal, friction(normal, local.imag, journal)) * normal_direction
    moment1 = -(arm1.conjugate() * force).imag
    moment2 = (arm2.conjugate() * force).imag
    return -force.real, -force.imag, moment1, force.real, force.imag, moment2
