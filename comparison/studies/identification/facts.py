"""What the paper prints about the ideal motion, and how far each figure can be trusted."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi, tau

import numpy as np

from comparison.scene import load_scene
from comparison.studies.identification.kinematics import (
    Geometry,
    Lengths,
    Topology,
    motion,
)
from comparison.studies.shared.published import published
from comparison.tables.arrays import Array

ANGLES = 240
"""Crank angles of a turn; parabolas through three of them give extrema to 1e-6 of their size."""
WORDS = ("top dead centre", "stroke", "lowest velocity", "highest velocity", "largest tan β")
UNKNOWNS = ("H_x", "H_y", "guide")
UNITS = ("deg", "m", "m/s", "m/s", "1")
OF_THE_QUOTIENT = 0.015
"""Of tan β: the largest errors of x and y need not belong to one instant. In 100 turns of the model their
quotient falls 1.3 % short, as the page tells."""


@dataclass(frozen=True)
class Facts:
    """Five figures about the ideal motion, in the order of `WORDS`, each of shape (5,).

    Attributes
    ----------
    values
        What the ideal motion should show: deg, m, m/s, m/s, 1.
    allowances
        By how much it may miss (taken as standard deviations): the rounding of the print, and what the
        clearance adds to a figure that was taken from a motion with clearance.
    roundings
        Half a unit of the last printed digit alone.
    """

    values: Array
    allowances: Array
    roundings: Array


def printed_facts() -> Facts:
    """Return the facts that the geometry is fitted to.

    Notes
    -----
    The range of the velocity (Fig. 14c) is one with clearance. The clearance widens it by something between
    nothing and the largest error of the velocity (Fig. 14e): half of that, give or take half, is taken off.
    The tangent of rod 4's angle is the quotient of the largest errors of y and x in Fig. 14: at constant x
    the slider's y error is its x error times this tangent.
    """
    angle, stroke = published("S2.2-tdc"), published("S4.2-stroke")
    lowest, highest = published("F14c-vy"), published("F14c-vy2")
    y, x = published("F14e-y2"), published("F14a-x")
    quotient = abs(y.value / x.value)
    of_quotient = quotient * (y.rounding / abs(y.value) + x.rounding / abs(x.value))
    half = 0.5 * vibration()
    return Facts(
        np.array([angle.value, abs(stroke.value), lowest.value + half, highest.value - half, quotient]),
        np.array(
            [
                angle.rounding,
                stroke.rounding,
                half + lowest.rounding,
                half + highest.rounding,
                OF_THE_QUOTIENT * quotient,
            ]
        ),
        np.array([angle.rounding, stroke.rounding, lowest.rounding, highest.rounding, of_quotient]),
    )


def vibration() -> float:
    """Return the largest velocity error of Fig. 14e, m/s."""
    return max(abs(published(name).value) for name in ("F14e-vy", "F14e-vy2"))


def table_1(scene: str) -> tuple[Lengths, float]:
    """Return the lengths, and the crank's speed, rad/s, of a shipped scene."""
    data = load_scene(scene).data
    rods = data["mechanism"]
    lengths = Lengths(
        rods["crank"]["length"],
        rods["rod2"]["length"],
        rods["rocker"]["length"],
        rods["rocker"]["centroid"],
        rods["rod4"]["length"],
    )
    return lengths, pi / 30 * abs(float(data["drive"]["speed_rpm"]))


def shipped_geometry() -> Geometry:
    """Return the geometry that the shipped scenes have; the guide is the ideal slider's line."""
    mechanism = load_scene("paper").data["mechanism"]
    x, y = mechanism["rocker_pivot"]
    return Geometry(x, y, mechanism["guide_x"] + mechanism["reference_offset"])


def shown(geometry: Geometry, topology: Topology, lengths: Lengths, speed: float) -> tuple[float, Array]:
    """Return what a press shows.

    Parameters
    ----------
    geometry, topology, lengths
        The press.
    speed
        Of the crank, rad/s, positive.

    Returns
    -------
    assembled
        As in `Motion.assembled`.
    values
        Shape (5,), in the order of `WORDS`; nan where the press cannot be assembled at every angle.
    """
    angle = tau * np.arange(ANGLES) / ANGLES
    turn = motion(geometry, topology, lengths, angle)
    if turn.assembled <= 0:
        return turn.assembled, np.full(len(WORDS), np.nan)
    top, at = _highest(turn.F.imag)
    crank = at * tau / ANGLES
    # Newton's method, since the print gives this angle to 4e-5 of a turn; at most to the next sample.
    for _ in range(3):
        here = motion(geometry, topology, lengths, np.array([crank]))
        velocity, acceleration = float(here.velocity[0]), float(here.acceleration[0])
        if acceleration < 0:
            step = topology.crank * velocity / acceleration
            crank -= min(max(step, -tau / ANGLES), tau / ANGLES)
    low, high = -_highest(-turn.velocity)[0], _highest(turn.velocity)[0]
    return turn.assembled, np.array(
        [
            180.0 / pi * crank % 360.0,
            top + _highest(-turn.F.imag)[0],
            speed * low,
            speed * high,
            _highest(turn.tangent)[0],
        ]
    )


def _highest(values: Array) -> tuple[float, float]:
    """Return the vertex of the parabola through the largest sample and its neighbours: height, and index."""
    k = int(values.argmax())
    before, here, after = (float(values[(k + n) % values.size]) for n in (-1, 0, 1))
    curve = before - 2 * here + after
    shift = 0.5 * (before - after) / curve if curve < 0 else 0.0
    return here - 0.25 * (before - after) * shift, k + shift
