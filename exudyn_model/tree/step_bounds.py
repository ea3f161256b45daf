"""Bounds of the gaps' accelerations over a step of a tree: most steps hold no crossing by these alone.

The angles of a step are polynomials of degree five (``motion``). Polynomials lie between the least and
the greatest of their Bernstein coefficients [1]_, which bounds angular accelerations and rates over the step;
those of the bodies' points follow. Unless stated otherwise, a bound holds over the whole step.

References
----------
.. [1] Farouki, The Bernstein polynomial basis: a centennial retrospective, Comput. Aided Geom. Des. 29 (2012)
   379-419, section 5.
"""

from typing import Any, NamedTuple

import numpy as np

from exudyn_model.compiled import kernel
from exudyn_model.contact.journal import PinMotion
from exudyn_model.contact.states import ACROSS, ALONG
from exudyn_model.tree.motion import TreeState


class Rotation(NamedTuple):
    """Bounds of one angle's motion over a step.

    Attributes
    ----------
    least, greatest : float
        Angular acceleration, rad/s^2.
    speed : float
        Absolute value of the rate, rad/s.
    swing : float
        Distance of the angle from that at the step's end, rad.
    """

    least: float
    greatest: float
    speed: float
    swing: float


@kernel
def rotation_bounds(
    x0: float, v0: float, a0: float, x1: float, v1: float, a1: float, step: float
) -> Rotation:
    """Bound the quintic Hermite polynomial of an angle: arguments as for ``motion.quintic``."""
    # Bernstein coefficients of the rate: v0, early, middle, late, v1; four times their differences over the
    # step are those of the acceleration
    early, late = v0 + 0.25 * step * a0, v1 - 0.25 * step * a1
    middle = 5.0 * (x1 - x0) / step - early - late - v0 - v1
    a_early, a_late = 4.0 / step * (middle - early), 4.0 / step * (late - middle)
    speed = max(max(abs(v0), abs(v1)), max(abs(early), max(abs(middle), abs(late))))
    return Rotation(
        min(min(a0, a1), min(a_early, a_late)), max(max(a0, a1), max(a_early, a_late)), speed, step * speed
    )


@kernel
def point_acceleration_bounds(
    along: float, across: float, angle: float, rotation: Rotation
) -> tuple[float, float]:
    """Bound the second derivative (m/s^2) of along cos(angle) + across sin(angle): least and greatest.

    ``along`` and ``across`` are lengths (m), ``angle`` that at the step's end.
    """
    cosine, sine = np.cos(angle), np.sin(angle)
    value, slope = along * cosine + across * sine, across * cosine - along * sine
    centripetal = rotation.speed * rotation.speed
    # Value and slope change by at most this part of the lengths
    slack = max(abs(rotation.least), abs(rotation.greatest)) + centripetal
    slack *= rotation.swing * (abs(along) + abs(across))
    low, high = rotation.least * slope, rotation.greatest * slope
    return (
        min(low, high) - max(value, 0.0) * centripetal - slack,
        max(low, high) - min(value, 0.0) * centripetal + slack,
    )


@kernel
def slider_acceleration_bounds(
    step: float, state: TreeState, rotation3: Rotation, rotation4: Rotation, linkage: Any
) -> tuple[float, float]:
    """Bound the acceleration (m/s^2) of the slider's centre along x: least and greatest.

    Parameters
    ----------
    step : float
        s.
    state : TreeState
        At the step's end.
    rotation3, rotation4 : Rotation
        Of rocker and rod 4.
    linkage : record
        From ``constants.linkage_record``.
    """
    if linkage.ideal_pin:
        tip_ax, change = state.tip.ax, linkage.tip_jerk * step
        tip_least, tip_greatest = tip_ax - change, tip_ax + change
    else:
        tip_least, tip_greatest = point_acceleration_bounds(
            linkage.rocker_length, 0.0, state.theta3, rotation3
        )
    least, greatest = point_acceleration_bounds(linkage.rod4_length, 0.0, state.theta4, rotation4)
    return tip_least + least, tip_greatest + greatest


@kernel
def corner_acceleration_bounds(
    number: int, x_least: float, x_greatest: float, angle: float, rotation5: Rotation, law: Any
) -> tuple[float, float]:
    """Bound the second derivative (m/s^2) of a corner's gap, from bounds of the slider's along x."""
    half_length = ALONG[number] * law.half_length
    # gap = clearance -+ (x - half_length sin(angle)) + half_width (1 - cos(angle))
    if ACROSS[number] < 0.0:
        least, greatest = point_acceleration_bounds(-law.half_width, -half_length, angle, rotation5)
        return x_least + least, x_greatest + greatest
    least, greatest = point_acceleration_bounds(-law.half_width, half_length, angle, rotation5)
    return least - x_greatest, greatest - x_least


@kernel
def pin_acceleration_bounds(
    journal: PinMotion,
    step: float,
    rotation2: Rotation,
    rotation3: Rotation,
    w2: float,
    linkage: Any,
    law: Any,
) -> tuple[float, float]:
    """Bound the second derivative (m/s^2) of (c^2 - e^2) / (2 c), with e from bearing to journal.

    The gap c - |e| has no second derivative where the pin is centred. The greatest one holds as long as the
    pin is open.

    Parameters
    ----------
    journal : PinMotion
        At the step's end.
    step : float
        s.
    rotation2, rotation3 : Rotation
        Of rod 2 and rocker.
    w2 : float
        Rate of rod 2 at the step's end, rad/s.
    linkage, law : record
        From ``constants.linkage_record`` and ``contact.journal.journal_law``.
    """
    curvature2 = max(abs(rotation2.least), abs(rotation2.greatest)) + rotation2.speed * rotation2.speed
    curvature3 = max(abs(rotation3.least), abs(rotation3.greatest)) + rotation3.speed * rotation3.speed
    change = linkage.crank_length * linkage.omega * linkage.omega
    change += linkage.rod2_length * curvature2 + linkage.rocker_to_b * curvature3
    # Without what the rotation of the surfaces adds to the slip
    across = journal.slip - w2 * law.bearing_radius
    across += linkage.omega * (law.bearing_radius - law.clearance + journal.gap)
    speed = np.hypot(journal.rate, across) + step * change
    distance = law.clearance - journal.gap + step * speed
    return -(distance * change + speed * speed) / law.clearance, change
