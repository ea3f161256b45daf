"""The ideal press in closed form, for any arrangement of its parts: to be compared with printed facts.

Written for this study alone. The two models have their own loop closures, and a run of the scene ``ideal``
by each of them checks this one.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product
from math import inf, isfinite
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from comparison.tables.arrays import Array

Points = NDArray[np.complex128]
"""Points of the plane as x + iy, m."""


class Lengths(NamedTuple):
    """Table 1, m."""

    crank: float
    rod2: float
    rocker: float
    rocker_centroid: float
    rod4: float


def lengths_of(mechanism: Mapping[str, Any]) -> Lengths:
    """Return the lengths of a scene's mechanism."""
    rocker = mechanism["rocker"]
    crank, rod2, rod4 = (mechanism[part]["length"] for part in ("crank", "rod2", "rod4"))
    return Lengths(crank, rod2, rocker["length"], rocker["centroid"], rod4)


@dataclass(frozen=True)
class Topology:
    """The two-valued choices of an arrangement, 1 or -1 but for the pin."""

    crank: int
    """1: counter-clockwise, -1: clockwise."""
    rocker: int
    """1: joint B lies to the left of the line from A to H, -1: to its right."""
    slider: int
    """-1: rod 4 points down from the rocker's tip, 1: up."""
    pin: str
    """Where rod 2 is attached to the rocker: ``"centroid"`` or ``"tip"``."""
    side: int
    """-1: the guide is to the left of the crank pivot, 1: to its right."""

    def words(self, text: str) -> str:
        """Fill words for crank, B, pin, slider and guide into a text with five places."""
        return text.format(
            "counter-clockwise" if self.crank > 0 else "clockwise",
            "left" if self.rocker > 0 else "right",
            self.pin,
            "above" if self.slider > 0 else "below",
            "left" if self.side < 0 else "right",
        )

    def __str__(self) -> str:
        return self.words("crank {}, B {} of A–H, rod 2 at the rocker's {}, slider {}, guide {}")


_CHOICES = product((1, -1), (1, -1), (-1, 1), ("centroid", "tip"), (-1, 1))
TOPOLOGIES = tuple(Topology(*choices) for choices in _CHOICES)


class Geometry(NamedTuple):
    """What Table 1 leaves out, m."""

    pivot_x: float
    pivot_y: float
    guide: float


@dataclass(frozen=True)
class Motion:
    """One crank cycle; every array has shape (n,)."""

    assembled: float
    """The smallest margin (m) by which two links reach each other; negative where the linkage cannot be
    assembled at some crank angle."""
    A: Points
    B: Points
    C: Points
    F: Points
    """Joints; F is the slider."""
    velocity: Array
    acceleration: Array
    """Of the slider, positive upwards, at a crank speed of 1 rad/s: m/s and m/s^2."""
    tangent: Array
    """Tangent of rod 4's angle to the guide."""


@np.errstate(divide="ignore", invalid="ignore", over="ignore")
def motion(geometry: Geometry, topology: Topology, lengths: Lengths, angle: Array) -> Motion:
    """Move the press to crank angles, counter-clockwise from the x axis either way, rad, shape (n,).

    Where links do not reach each other the half chord is set to zero: `Motion.assembled` shows by how much
    they miss. Velocities follow from rigid rods: their ends have the same velocity along them.
    """
    H = complex(geometry.pivot_x, geometry.pivot_y)
    lever = lengths.rocker if topology.pin == "tip" else lengths.rocker_centroid
    rotation = 1j * topology.crank
    A = lengths.crank * np.exp(1j * angle)
    A1, A2 = rotation * A, -A

    gap = np.abs(H - A)
    along = (gap**2 + lengths.rod2**2 - lever**2) / (2 * gap)
    chord = lengths.rod2**2 - along**2
    B = A + (along + 1j * topology.rocker * np.sqrt(np.maximum(chord, 0.0))) * (H - A) / gap

    # |B - A| is constant and B turns about H: the rocker's rate, and its derivative.
    rod, arm = B - A, 1j * (B - H)
    rate = _dot(rod, A1) / _dot(rod, arm)
    B1 = rate * arm
    rate1 = (_dot(rod, A2) - np.abs(B1 - A1) ** 2 + rate**2 * _dot(rod, B - H)) / _dot(rod, arm)
    C = H + (lengths.rocker / lever) * (B - H)
    C1 = 1j * rate * (C - H)
    C2 = (1j * rate1 - rate**2) * (C - H)

    # height^2 = rod4^2 - across^2, differentiated once and twice; across' = -C.real'.
    across = geometry.guide - C.real
    fall = lengths.rod4**2 - across**2
    height = topology.slider * np.sqrt(np.maximum(fall, 0.0))
    height1 = across * C1.real / height
    height2 = (across * C2.real - C1.real**2 - height1**2) / height
    F = geometry.guide + 1j * (C.imag + height)
    assembled = min(_margin(chord, lengths.rod2), _margin(fall, lengths.rod4))
    return Motion(assembled, A, B, C, F, C1.imag + height1, C2.imag + height2, np.abs(across / height))


def _dot(a: Points, b: Points) -> Array:
    return np.asarray(a.real * b.real + a.imag * b.imag)


def _margin(square: Array, length: float) -> float:
    smallest = float(square.min()) / length
    return smallest if isfinite(smallest) else -inf
