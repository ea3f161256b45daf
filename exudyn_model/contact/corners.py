"""Contact of the slider's corners with the walls of its guide: a user function of Exudyn, its core compiled.

Each of the four corners is a sharp point and sees the infinite wall on its own side, at the guide's
centre line +- (half width + clearance). ``side_law`` gives the normal forces of the two corners of a side
from the depths of both, ``point_contact`` friction and the memory of the impact speeds.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exudyn_model.compiled import direct, kernel
from exudyn_model.parameters import Guide, Slider
from exudyn_model.point_contact import friction_force, impact_speed_in_force, law_type, surface_law
from exudyn_model.side_law import LAWS, side_normals

_LAW = law_type("half_width", "half_length", "clearance", "kind", "side_stiffness")

# (mbs, t, object number, coordinates, velocities) -> generalized forces
ForceUserFunction = Callable[[Any, float, int, list[float], list[float]], tuple[float, ...]]


def contact_law(contact: Guide, slider: Slider, step: float) -> NDArray[np.void]:
    """Collect the constants of the kernels in one record, shape (1,); lengths in m, the step in s."""
    law = surface_law(_LAW, contact, step)
    law["half_width"] = slider.width / 2
    law["half_length"] = slider.length / 2
    law["clearance"] = contact.clearance
    law["kind"] = LAWS.index(contact.law)
    law["side_stiffness"] = contact.side_stiffness
    return law


@kernel
def corner_motion(
    number: int, x: float, angle: float, vx: float, vy: float, omega: float, law: Any
) -> tuple[float, float, float, float, float]:
    """Gap (m, positive open), its rate, slip speed along +y (m/s), and arm (m) of one corner.

    ``x`` counts from the guide's centre line.
    """
    sx = -law.half_width if number % 2 == 0 else law.half_width
    sy = -law.half_length if number < 2 else law.half_length
    cosine, sine = np.cos(angle), np.sin(angle)
    rx, ry = cosine * sx - sine * sy, sine * sx + cosine * sy
    outward = -1.0 if number % 2 == 0 else 1.0
    # Not as a difference of distances from the centre line, which are a hundred times the clearance: a depth
    # of 1e-11 m, at rest in the "strip" law, is to keep its digits
    gap = law.clearance - outward * (x - sine * sy) + 2.0 * law.half_width * np.sin(0.5 * angle) ** 2
    rate = -outward * (vx - omega * ry)
    return gap, rate, vy + omega * rx, rx, ry


@kernel
def corner_load(
    number: int, normal: float, slip: float, rx: float, ry: float, law: Any
) -> tuple[float, float, float]:
    """Fx, fy (N) and the moment about the slider's centre (N m) of one corner's normal force and friction."""
    inward = normal if number % 2 == 0 else -normal
    friction = friction_force(normal, slip, law)
    return inward, friction, rx * friction - ry * inward


@kernel
def slider_force(
    x: float,
    angle: float,
    vx: float,
    vy: float,
    omega: float,
    law: NDArray[np.void],
    corners: NDArray[np.void],
) -> tuple[float, float, float]:
    """Resultant of all corners on the slider: fx, fy (N) and the moment about its centre (N m).

    Parameters
    ----------
    x, angle, vx, vy, omega : float
        Slider's x from the guide's centre line (m), angle (rad) and velocities, at the end of the step.
    law : ndarray, shape (1,)
        From :func:`contact_law`.
    corners : ndarray, shape (5,)
        State of the contacts at the start of the step.
    """
    constants = law[0]
    fx, fy, moment = 0.0, 0.0, 0.0
    for lower in range(2):
        upper = lower + 2
        gap0, rate0, slip0, rx0, ry0 = corner_motion(lower, x, angle, vx, vy, omega, constants)
        gap1, rate1, slip1, rx1, ry1 = corner_motion(upper, x, angle, vx, vy, omega, constants)
        if gap0 < 0.0 or gap1 < 0.0:
            speed0 = impact_speed_in_force(corners[lower], gap0, rate0, constants)
            speed1 = impact_speed_in_force(corners[upper], gap1, rate1, constants)
            normals = side_normals(-gap0, -rate0, speed0, -gap1, -rate1, speed1, constants)
            load0 = corner_load(lower, normals[0], slip0, rx0, ry0, constants)
            load1 = corner_load(upper, normals[1], slip1, rx1, ry1, constants)
            fx += load0[0] + load1[0]
            fy += load0[1] + load1[1]
            moment += load0[2] + load1[2]
    return fx, fy, moment


@kernel
def frozen_slider_force(
    x: float,
    angle: float,
    vx: float,
    vy: float,
    omega: float,
    law: NDArray[np.void],
    corners: NDArray[np.void],
) -> tuple[float, float, float]:
    """:func:`slider_force` of the corners alone that are in contact: those with a frozen impact speed.

    For steps that end at each touch. Inside such a step a corner that was open stays without force, even
    where a trial state lies behind the wall: the motion of a trial step is smooth up to the touch that it
    is to locate.
    """
    constants = law[0]
    fx, fy, moment = 0.0, 0.0, 0.0
    for lower in range(2):
        upper = lower + 2
        speed0, speed1 = corners[lower].impact_speed, corners[upper].impact_speed
        if speed0 > 0.0 or speed1 > 0.0:
            gap0, rate0, slip0, rx0, ry0 = corner_motion(lower, x, angle, vx, vy, omega, constants)
            gap1, rate1, slip1, rx1, ry1 = corner_motion(upper, x, angle, vx, vy, omega, constants)
            normals = side_normals(-gap0, -rate0, speed0, -gap1, -rate1, speed1, constants)
            load0 = corner_load(lower, normals[0], slip0, rx0, ry0, constants)
            load1 = corner_load(upper, normals[1], slip1, rx1, ry1, constants)
            fx += load0[0] + load1[0]
            fy += load0[1] + load1[1]
            moment += load0[2] + load1[2]
    return fx, fy, moment


def force_user_function(law: NDArray[np.void], corners: NDArray[np.void]) -> ForceUserFunction:
    """``forceUserFunction`` of an ``ObjectGenericODE2`` on the slider's node.

    The node's reference x must be the guide's centre line and its other references zero, so that the
    coordinates that Exudyn passes are those of :func:`slider_force`.
    """
    found = direct(slider_force, 0.0, 0.0, 0.0, 0.0, 0.0, law, corners)

    def force(mbs: Any, t: float, number: int, q: list[float], v: list[float]) -> tuple[float, ...]:
        del mbs, t, number
        # Exudyn passes lists, which numba would copy element by element: scalars are 7 us faster a call
        return found(q[0], q[2], v[0], v[1], v[2], law, corners)

    return force
