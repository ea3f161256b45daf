"""Put the linkage together at t = 0: positions by angles, velocities from the constraints' Jacobian.

Exudyn accepts initial values that violate its joints without a word, so both are checked against the
list of joints (``bodies.pins``) that Exudyn's joints are also built from.
"""

import math
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from exudyn_model.bodies import (
    ANGLE,
    COORDINATES,
    CRANK_ANGLE,
    FRAME,
    PER_BODY,
    SLIDER_ANGLE,
    SLIDER_X,
    Pin,
    X,
    Y,
    pins,
)
from exudyn_model.parameters import Mechanism, Parameters

# One angle, or many, rad
Angles = TypeVar("Angles", float, NDArray[np.float64])

# Crank positions tried in one cycle: 0.1 degrees apart, where the linkage hardly changes
_POSITIONS = 3600
# Two of each of the six pins
_ROWS = 12


@dataclass(frozen=True)
class InitialState:
    """Positions (x, y, angle; m, rad) and velocities of the five bodies, each of shape (5, 3)."""

    positions: NDArray[np.float64]
    velocities: NDArray[np.float64]


def assemble(parameters: Parameters) -> InitialState:
    """Place all bodies at t = 0 and give them velocities that fit the joints and the drive.

    Raises
    ------
    ValueError
        If the linkage cannot be closed at the start or somewhere in a crank cycle.
    """
    mechanism, initial = parameters.mechanism, parameters.initial
    if mechanism.ideal_slider:
        offset, angle, vx, omega = mechanism.reference_offset, 0.0, 0.0, 0.0
        reach = [offset]
    else:
        offset, angle, vx, omega = initial.offset, initial.angle, initial.vx, initial.omega
        reach = [-parameters.contact.clearance, parameters.contact.clearance]
    _require_full_cycle(mechanism, reach)
    positions = place(mechanism, mechanism.crank_angle, mechanism.guide_x + offset, angle)
    velocities = _velocities(mechanism, positions, parameters.drive.omega, vx, omega)
    _require_consistent(mechanism, positions, velocities)
    return InitialState(positions, velocities)


def place(
    mechanism: Mechanism, crank_angle: float, slider_x: float, slider_angle: float
) -> NDArray[np.float64]:
    """Return the positions (x, y, angle) of the five bodies, shape (5, 3), for given crank and slider.

    Raises
    ------
    ValueError
        If the linkage does not close there.
    """
    crank, rod2, rocker, rod4 = mechanism.crank, mechanism.rod2, mechanism.rocker, mechanism.rod4
    crank_tip = crank.length * _unit(crank_angle)
    pivot = np.array(mechanism.rocker_pivot)
    cosine, towards_pivot = _at_pivot(mechanism, crank_angle)
    _require_closed(cosine, "crank, rod 2 and rocker", crank_angle)
    rocker_angle = float(towards_pivot + mechanism.rocker_branch * np.arccos(cosine))
    joint_b = pivot + rocker.centroid * _unit(rocker_angle)
    along_rod2 = joint_b - crank_tip
    rod2_angle = math.atan2(along_rod2[1], along_rod2[0])
    rocker_tip = pivot + rocker.length * _unit(rocker_angle)
    cosine = _at_rocker_tip(mechanism, rocker_angle, slider_x)
    _require_closed(cosine, "rod 4 and slider", crank_angle)
    rod4_angle = mechanism.slider_branch * math.acos(cosine)
    centres = [
        crank.centroid * _unit(crank_angle),
        crank_tip + rod2.centroid * _unit(rod2_angle),
        joint_b,
        rocker_tip + rod4.centroid * _unit(rod4_angle),
        rocker_tip + rod4.length * _unit(rod4_angle),
    ]
    centres[-1][X] = slider_x  # not the round-off of cos(arccos)
    angles = [crank_angle, rod2_angle, rocker_angle, rod4_angle, slider_angle]
    return np.column_stack([centres, angles])


def _at_pivot(mechanism: Mechanism, crank_angle: Angles) -> tuple[Angles, Angles]:
    """Return the cosine of the angle at H in the triangle A, H, B, and the direction from A to H (rad).

    By the law of cosines; the side HB is the rocker up to its centroid. There is a triangle where the cosine
    is within -1 and 1.
    """
    length, arm = mechanism.rod2.length, mechanism.rocker.centroid
    span_x = mechanism.rocker_pivot[0] - mechanism.crank.length * np.cos(crank_angle)
    span_y = mechanism.rocker_pivot[1] - mechanism.crank.length * np.sin(crank_angle)
    squared = span_x**2 + span_y**2
    with np.errstate(divide="ignore"):  # A in H: not closed either
        cosine = (length**2 - squared - arm**2) / (2 * arm * np.sqrt(squared))
    return cosine, np.arctan2(span_y, span_x)


def _at_rocker_tip(mechanism: Mechanism, rocker_angle: Angles, slider_x: float) -> Angles:
    """Return the cosine of the angle of rod 4 from C, which ends on the slider's vertical."""
    tip_x = mechanism.rocker_pivot[0] + mechanism.rocker.length * np.cos(rocker_angle)
    cosine: Angles = (slider_x - tip_x) / mechanism.rod4.length
    return cosine


def _unit(angle: float) -> NDArray[np.float64]:
    return np.array([math.cos(angle), math.sin(angle)])


def _require_closed(cosine: float, parts: str, crank_angle: float) -> None:
    # At exactly 1 the linkage is stretched: it closes, but its velocities are not determined
    if not abs(cosine) < 1:
        degrees = math.degrees(crank_angle) % 360
        raise ValueError(f"mechanism: {parts} cannot be assembled at a crank angle of {degrees:.2f} degrees")


def _require_full_cycle(mechanism: Mechanism, reach: list[float]) -> None:
    """Try the whole cycle, from the start on, with the slider on each line that it can reach."""
    cycle = np.linspace(
        mechanism.crank_angle, mechanism.crank_angle + 2 * math.pi, _POSITIONS, endpoint=False
    )
    lines = [mechanism.guide_x + offset for offset in reach]
    with np.errstate(invalid="ignore"):
        cosine, towards_pivot = _at_pivot(mechanism, cycle)
        rocker_angle = towards_pivot + mechanism.rocker_branch * np.arccos(cosine)
        # No number where there is no triangle: this is not less than 1 either
        closed = [np.abs(_at_rocker_tip(mechanism, rocker_angle, line)) < 1 for line in lines]
    for angle in cycle[~np.all(closed, axis=0)]:
        for line in lines:
            place(mechanism, float(angle), line, 0.0)  # says which parts do not meet


def _pin_ends(
    pin: Pin, positions: NDArray[np.float64]
) -> list[tuple[int, NDArray[np.float64], NDArray[np.float64]]]:
    """Return both ends of a pin: body, point in the fixed frame, arm from the body's centre to it."""
    ends = []
    for body, (along, across) in ((pin.first, pin.first_point), (pin.second, pin.second_point)):
        if body == FRAME:
            ends.append((body, np.array([along, across]), np.zeros(2)))
        else:
            arm = along * _unit(positions[body, ANGLE])
            ends.append((body, positions[body, [X, Y]] + arm, arm))
    return ends


def _jacobian(mechanism: Mechanism, positions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Differentiate the twelve joint rows by the fifteen coordinates, shape (12, 15)."""
    rows = np.zeros((_ROWS, COORDINATES))
    for number, pin in enumerate(pins(mechanism)):
        for sign, (body, _, arm) in zip((-1, 1), _pin_ends(pin, positions), strict=True):
            if body != FRAME:
                block = rows[2 * number : 2 * number + 2, PER_BODY * body : PER_BODY * (body + 1)]
                block += sign * np.array([[1.0, 0.0, -arm[1]], [0.0, 1.0, arm[0]]])
    return rows


def _velocities(
    mechanism: Mechanism, positions: NDArray[np.float64], crank_speed: float, vx: float, omega: float
) -> NDArray[np.float64]:
    """Solve for the velocities of all bodies, shape (5, 3), from twelve joints and three given speeds."""
    given = np.zeros((3, COORDINATES))
    given[[0, 1, 2], [CRANK_ANGLE, SLIDER_X, SLIDER_ANGLE]] = 1.0
    matrix = np.vstack([_jacobian(mechanism, positions), given])
    right_side = np.concatenate([np.zeros(_ROWS), [crank_speed, vx, omega]])
    return np.linalg.solve(matrix, right_side).reshape(-1, PER_BODY)


def _require_consistent(
    mechanism: Mechanism, positions: NDArray[np.float64], velocities: NDArray[np.float64]
) -> None:
    gaps = [np.subtract(*(point for _, point, _ in _pin_ends(pin, positions))) for pin in pins(mechanism)]
    speeds = _jacobian(mechanism, positions) @ velocities.ravel()
    # Lengths are near 1 m: round-off of a few operations is some 1e-16, of the linear solve some 1e-14
    if np.max(np.abs(gaps)) > 1e-13 or np.max(np.abs(speeds)) > 1e-12 * (1 + np.max(np.abs(velocities))):
        raise AssertionError("initial positions or velocities do not fit the joints")
