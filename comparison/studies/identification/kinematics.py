"""The ideal press in closed form, for any arrangement of its parts: to be compared with printed facts.

Written for this study alone. The two models have their own loop closures, and a run of the scene ``ideal``
by each of them checks this one.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from math import inf, isfinite
from typing import NamedTuple

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


@dataclass(frozen=True)
class Topology:
    """The two-valued choices of an arrangement.

    Attributes
    ----------
    crank
        1: counter-clockwise, -1: clockwise.
    rocker
        1: joint B lies to the left of the line from A to H, -1: to its right.
    slider
        -1: rod 4 points down from the rocker's tip, 1: up.
    pin
        Where rod 2 is attached to the rocker: ``"centroid"`` or ``"tip"``.
    side
        -1: the guide is to the left of the crank pivot, 1: to its right.
    """

    crank: int
    rocker: int
    slider: int
    pin: str
    side: int

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


TOPOLOGIES = tuple(
    Topology(*choices) for choices in product((1, -1), (1, -1), (-1, 1), ("centroid", "tip"), (-1, 1))
)


class Geometry(NamedTuple):
    """What Table 1 leaves out, m."""

    pivot_x: float
    pivot_y: float
    guide: float


@dataclass(frozen=True)
class Motion:
    """One crank cycle; every array has shape (n,).

    Attributes
    ----------
    assembled
        The smallest margin (m) by which two links reach each other; negative where the linkage cannot be
        assembled at some crank angle.
    A, B, C, F
        Joints; F is the slider.
    velocity, acceleration
        Of the slider along the guide, positive upwards, at a crank speed of 1 rad/s: m/s and m/s^2.
    tangent
        Tangent of rod 4's angle to the guide.
    """

    assembled: float
    A: Points
    B: Points
    C: Points
    F: Points
    velocity: Array
    acceleration: Array
    tangent: Array


@np.errstate(divide="ignore", invalid="ignore", over="ignore")
def motion(geometry: Geometry, topology: Topology, lengths: Lengths, angle: Array) -> Motion:
    """Move the press.

    Parameters
    ----------
    geometry, topology, lengths
        The press.
    angle
        Of the crank, counter-clockwise from the x axis whichever way it rotates, rad, shape (n,).

    Notes
    -----
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
    return Motion(
        assembled=float(min(_margin(chord, lengths.rod2), _margin(fall, lengths.rod4))),
        A=A,
        B=B,
        C=C,
        F=geometry.guide + 1j * (C.imag + height),
        velocity=C1.imag + height1,
        acceleration=C2.imag + height2,
        tangent=np.abs(across / height),
    )


def _dot(a: Points, b: Points) -> Array:
    return np.asarray(a.real * b.real + a.imag * b.imag)


def _margin(square: Array, length: float) -> float:
    smallest = float(square.min()) / length
    return smallest if isfinite(smallest) else -inf
