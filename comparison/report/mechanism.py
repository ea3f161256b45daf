"""Positions of the press's joints from the crank angle, for drawings only.

Both models compute their own; a drawing needs a tenth of a millimetre and neglects the clearances.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import cos, hypot, radians, sin, sqrt
from typing import Any, NamedTuple

Point = tuple[float, float]


class Joints(NamedTuple):
    """Positions, m: crank's bearing O, crank pin A, B on the rocker, its pivot H, its tip C, slider F."""

    O: Point  # noqa: E741 - the paper's name
    A: Point
    B: Point
    H: Point
    C: Point
    F: Point


def joints(mechanism: Mapping[str, Any], crank_angle_deg: float) -> Joints | None:
    """Return the joints' positions; None where the mechanism cannot be assembled.

    Parameters
    ----------
    mechanism
        Section ``mechanism`` of a scene.
    crank_angle_deg
        From the x axis, counter-clockwise.
    """
    angle, crank = radians(crank_angle_deg), float(mechanism["crank"]["length"])
    pin = (crank * cos(angle), crank * sin(angle))
    pivot = (float(mechanism["rocker_pivot"][0]), float(mechanism["rocker_pivot"][1]))
    rocker, rod2 = mechanism["rocker"], mechanism["rod2"]
    middle = _crossing(pin, rod2["length"], pivot, rocker["centroid"], mechanism["rocker_branch"])
    if middle is None:
        return None
    reach = rocker["length"] / rocker["centroid"]
    tip = (pivot[0] + reach * (middle[0] - pivot[0]), pivot[1] + reach * (middle[1] - pivot[1]))
    guide = float(mechanism["guide_x"])
    left = mechanism["rod4"]["length"] ** 2 - (guide - tip[0]) ** 2
    if left < 0.0:
        return None
    slider = (guide, tip[1] + mechanism["slider_branch"] * sqrt(left))
    return Joints((0.0, 0.0), pin, middle, pivot, tip, slider)


def _crossing(a: Point, from_a: float, b: Point, from_b: float, side: int) -> Point | None:
    """Return where two circles cross, on the left (1) or right (-1) of the line from a to b."""
    distance = hypot(b[0] - a[0], b[1] - a[1])
    along = (distance**2 + from_a**2 - from_b**2) / (2 * distance)
    height = from_a**2 - along**2
    if height < 0.0:
        return None
    x, y = (b[0] - a[0]) / distance, (b[1] - a[1]) / distance
    across = side * sqrt(height)
    return a[0] + along * x - across * y, a[1] + along * y + across * x
