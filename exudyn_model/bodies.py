"""The five bodies: their numbers, where each stands among the coordinates, and the pins that join them."""

from typing import NamedTuple

from exudyn_model.parameters import Mechanism

CRANK, ROD2, ROCKER, ROD4, SLIDER = range(5)
FRAME = -1

# Among the coordinates of one body: of its centre (m), and its angle (rad)
X, Y, ANGLE = range(3)
PER_BODY = 3

# Among those of all five, and among their rates
CRANK_X, CRANK_Y, CRANK_ANGLE = range(0, 3)
ROD2_X, ROD2_Y, ROD2_ANGLE = range(3, 6)
ROCKER_X, ROCKER_Y, ROCKER_ANGLE = range(6, 9)
ROD4_X, ROD4_Y, ROD4_ANGLE = range(9, 12)
SLIDER_X, SLIDER_Y, SLIDER_ANGLE = range(12, 15)
COORDINATES = 15


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
