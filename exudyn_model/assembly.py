"""Put the linkage together at t = 0: positions by angles, velocities from the constraints' Jacobian.

Exudyn accepts initial values that violate its joints without a word, so both are checked against the
list of joints that ``mechanism`` also builds Exudyn's joints from.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exudyn_model.parameters import Mechanism, Parameters

CRANK, ROD2, ROCKER, ROD4, SLIDER = range(5)
FRAME = -1

# Crank positions tried in one turn: 0.1 degrees apart, where the linkage hardly changes
_POSITIONS = 3600


class Pin(NamedTuple):
    """A revolute joint between a point of one body and a point of another, in body coordinates, m.

    ``first`` may be ``FRAME``; then ``first_point`` is fixed in space.
    """

    name: str
    first: int
    first_point: tuple[float, float]
    second: int
    second_point: tuple[float, float]


def pins(mechanism: Mechanism) -> list[Pin]:
    """List the six revolute joints O, A, H, B, C, F (rows 1 to 12 of the constraints, Eq. 16)."""
    crank, rod2, rocker, rod4 = mechanism.crank, mechanism.rod2, mechanism.rocker, mechanism.rod4
    return [
        Pin("O", FRAME, (0.0, 0.0), CRANK, (-crank.centroid, 0.0)),
        Pin("A", CRANK, (crank.to_tip, 0.0), ROD2, (-rod2.centroid, 0.0)),
        Pin("H", FRAME, mechanism.rocker_pivot, ROCKER, (-rocker.centroid, 0.0)),
        Pin("B", ROD2, (rod2.to_tip, 0.0), ROCKER, (0.0, 0.0)),
        Pin("C", ROCKER, (rocker.to_tip, 0.0), ROD4, (-rod4.centroid, 0.0)),
        Pin("F", ROD4, (rod4.to_tip, 0.0), SLIDER, (0.0, 0.0)),
    ]


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
        If the linkage cannot be closed at the start or somewhere in a turn of the crank.
    """
    mechanism, initial = parameters.mechanism, parameters.initial
    if mechanism.ideal_slider:
        offset, angle, vx, omega = mechanism.reference_offset, 0.0, 0.0, 0.0
        reach = [offset]
    else:
        offset, angle, vx, omega = initial.offset, initial.angle, initial.vx, initial.omega
        reach = [-parameters.contact.clearance, parameters.contact.clearance]
    _require_full_turn(mechanism, reach)
    positions = place(mechanism, mechanism.crank_angle, mechanism.guide_x + offset, angle)
    velocities = _velocities(mechanism, positions, parameters.drive.omega, vx, omega)
    _require_consistent(mechanism, positions, velocities)
    return InitialState(positions, velocities)


def place(
    mechanism: Mechanism, crank_angle: float, slider_x: float, slider_angle: float
) -> NDArray[np.float64]:
    """Positions (x, y, angle) of the five bodies, shape (5, 3), for given crank and slider.

    Raises
    ------
    ValueError
        If the linkage does not close there.
    """
    crank, rod2, rocker, rod4 = mechanism.crank, mechanism.rod2, mechanism.rocker, mechanism.rod4
    crank_tip = crank.length * _unit(crank_angle)
    pivot = np.array(mechanism.rocker_pivot)
    # Law of cosines at H in the triangle A, H, B, whose side HB is the rocker up to its centroid
    span = pivot - crank_tip
    distance = math.hypot(*span)
    cosine = (rod2.length**2 - distance**2 - rocker.centroid**2) / (2 * rocker.centroid * distance)
    _require_closed(cosine, "crank, rod 2 and rocker", crank_angle)
    rocker_angle = math.atan2(span[1], span[0]) + mechanism.rocker_branch * math.acos(cosine)
    joint_b = pivot + rocker.centroid * _unit(rocker_angle)
    along_rod2 = joint_b - crank_tip
    rod2_angle = math.atan2(along_rod2[1], along_rod2[0])
    # Rod 4 ends on the slider's vertical
    rocker_tip = pivot + rocker.length * _unit(rocker_angle)
    cosine = (slider_x - rocker_tip[0]) / rod4.length
    _require_closed(cosine, "rod 4 and slider", crank_angle)
    rod4_angle = mechanism.slider_branch * math.acos(cosine)
    centres = [
        crank.centroid * _unit(crank_angle),
        crank_tip + rod2.centroid * _unit(rod2_angle),
        joint_b,
        rocker_tip + rod4.centroid * _unit(rod4_angle),
        rocker_tip + rod4.length * _unit(rod4_angle),
    ]
    centres[-1][0] = slider_x  # not the round-off of cos(arccos)
    angles = [crank_angle, rod2_angle, rocker_angle, rod4_angle, slider_angle]
    return np.column_stack([centres, angles])


def _unit(angle: float) -> NDArray[np.float64]:
    return np.array([math.cos(angle), math.sin(angle)])


def _require_closed(cosine: float, parts: str, crank_angle: float) -> None:
    # At exactly 1 the linkage is stretched: it closes, but its velocities are not determined
    if not abs(cosine) < 1:
        degrees = math.degrees(crank_angle) % 360
        raise ValueError(f"mechanism: {parts} cannot be assembled at a crank angle of {degrees:.2f} degrees")


def _require_full_turn(mechanism: Mechanism, reach: list[float]) -> None:
    """Try the whole turn, from the start on, with the slider on each line that it can reach."""
    for turn in np.arange(_POSITIONS) * (2 * math.pi / _POSITIONS):
        for offset in reach:
            place(mechanism, mechanism.crank_angle + turn, mechanism.guide_x + offset, 0.0)


def _pin_ends(
    pin: Pin, positions: NDArray[np.float64]
) -> list[tuple[int, NDArray[np.float64], NDArray[np.float64]]]:
    """Both ends of a pin: body, point in the fixed frame, arm from the body's centre to it."""
    ends = []
    for body, (along, across) in ((pin.first, pin.first_point), (pin.second, pin.second_point)):
        if body == FRAME:
            ends.append((body, np.array([along, across]), np.zeros(2)))
        else:
            arm = along * _unit(positions[body, 2])
            ends.append((body, positions[body, :2] + arm, arm))
    return ends


def _jacobian(mechanism: Mechanism, positions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Differentiate the twelve joint rows by the fifteen coordinates, shape (12, 15)."""
    rows = np.zeros((12, 15))
    for number, pin in enumerate(pins(mechanism)):
        for sign, (body, _, arm) in zip((-1, 1), _pin_ends(pin, positions), strict=True):
            if body != FRAME:
                block = rows[2 * number : 2 * number + 2, 3 * body : 3 * body + 3]
                block += sign * np.array([[1.0, 0.0, -arm[1]], [0.0, 1.0, arm[0]]])
    return rows


def _velocities(
    mechanism: Mechanism, positions: NDArray[np.float64], crank_speed: float, vx: float, omega: float
) -> NDArray[np.float64]:
    """Velocities of all bodies, shape (5, 3), from twelve joints and three given speeds."""
    given = np.zeros((3, 15))
    given[[0, 1, 2], [2, 12, 14]] = 1.0  # crank angle, slider x, slider angle
    matrix = np.vstack([_jacobian(mechanism, positions), given])
    right_side = np.concatenate([np.zeros(12), [crank_speed, vx, omega]])
    return np.linalg.solve(matrix, right_side).reshape(5, 3)


def _require_consistent(
    mechanism: Mechanism, positions: NDArray[np.float64], velocities: NDArray[np.float64]
) -> None:
    gaps = [np.subtract(*(point for _, point, _ in _pin_ends(pin, positions))) for pin in pins(mechanism)]
    speeds = _jacobian(mechanism, positions) @ velocities.ravel()
    # Lengths are near 1 m: round-off of a few operations is some 1e-16, of the linear solve some 1e-14
    if np.max(np.abs(gaps)) > 1e-13 or np.max(np.abs(speeds)) > 1e-12 * (1 + np.max(np.abs(velocities))):
        raise AssertionError("initial positions or velocities do not fit the joints")
