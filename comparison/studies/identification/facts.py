"""What the paper prints about the ideal motion, and how far each figure can be trusted."""

from __future__ import annotations

from functools import cache
from math import pi, tau

import numpy as np
import pandas as pd

from comparison.scene import load_scene
from comparison.studies.identification.kinematics import Geometry, Lengths, Topology, lengths_of, motion
from comparison.studies.shared.published import published
from comparison.tables.arrays import Array

BASE = "150rpm-0.2mm"
ANGLES = 240
"""Crank angles of a cycle; parabolas through three of them give extrema to 1e-6 of their size."""
UNKNOWNS = ("H_x", "H_y", "guide")
OF_THE_QUOTIENT = 0.015
"""Of tan β: the largest errors of x and y need not belong to one instant. In 100 cycles of the model their
quotient falls 1.3 % short, as the page reports."""


def printed_facts() -> pd.DataFrame:
    """Return the five facts that the geometry is fitted to, by what they are.

    ``value``: what the ideal motion should show, in ``unit``; ``allowance``: by how much it may miss (one
    standard deviation): the rounding of the print, and what the clearance adds to a figure of a motion with
    clearance; ``rounding``: half a unit of the last printed digit alone.

    The range of the velocity (Fig. 14c) is one with clearance. The clearance widens it by something between
    nothing and the largest error of the velocity (Fig. 14e): half of that, give or take half, is taken off.
    The tangent of rod 4's angle is the quotient of the largest errors of y and x in Fig. 14: at constant x
    the slider's y error is its x error times this tangent.
    """
    angle, stroke = published("S2.2-tdc"), published("S4.2-stroke")
    lowest, highest = published("F14c-vy"), published("F14c-vy2")
    y, x = published("F14e-y2"), published("F14a-x")
    quotient, half = abs(y.value / x.value), 0.5 * vibration()
    of_quotient = quotient * (y.rounding / abs(y.value) + x.rounding / abs(x.value))
    rows = {
        "top dead centre": ("deg", angle.value, angle.rounding, angle.rounding),
        "stroke": ("m", abs(stroke.value), stroke.rounding, stroke.rounding),
        "lowest velocity": ("m/s", lowest.value + half, half + lowest.rounding, lowest.rounding),
        "highest velocity": ("m/s", highest.value - half, half + highest.rounding, highest.rounding),
        "largest tan β": ("", quotient, OF_THE_QUOTIENT * quotient, of_quotient),
    }
    return pd.DataFrame.from_dict(rows, orient="index", columns=["unit", "value", "allowance", "rounding"])


def vibration() -> float:
    """Return the largest velocity error of Fig. 14e, m/s."""
    return max(abs(published(name).value) for name in ("F14e-vy", "F14e-vy2"))


@cache
def table_1() -> tuple[Lengths, float]:
    """Return the lengths of Table 1, and the speed of the crank, rad/s."""
    data = load_scene(BASE).data
    return lengths_of(data["mechanism"]), pi / 30 * abs(float(data["drive"]["speed_rpm"]))


def shipped_geometry() -> Geometry:
    """Return the geometry that the shipped scenes have; the guide is the ideal slider's line."""
    mechanism = load_scene("paper").data["mechanism"]
    x, y = mechanism["rocker_pivot"]
    return Geometry(x, y, mechanism["guide_x"] + mechanism["reference_offset"])


def shown(geometry: Geometry, topology: Topology) -> tuple[float, Array]:
    """Return `Motion.assembled` of a press with the lengths of Table 1, and what it shows.

    Shape (5,), in the order of `printed_facts`; nan where it cannot be assembled at every angle.
    """
    lengths, speed = table_1()
    cycle = motion(geometry, topology, lengths, tau * np.arange(ANGLES) / ANGLES)
    if cycle.assembled <= 0:
        return cycle.assembled, np.full(5, np.nan)
    top, at = _highest(cycle.F.imag)
    crank = at * tau / ANGLES
    # Newton's method, since the print gives this angle to 4e-5 of a cycle; at most to the next sample.
    for _ in range(3):
        here = motion(geometry, topology, lengths, np.array([crank]))
        velocity, acceleration = float(here.velocity[0]), float(here.acceleration[0])
        if acceleration < 0:
            step = topology.crank * velocity / acceleration
            crank -= min(max(step, -tau / ANGLES), tau / ANGLES)
    stroke = top + _highest(-cycle.F.imag)[0]
    low, high = -speed * _highest(-cycle.velocity)[0], speed * _highest(cycle.velocity)[0]
    values = (np.degrees(crank) % 360.0, stroke, low, high, _highest(cycle.tangent)[0])
    return cycle.assembled, np.array(values)


def _highest(values: Array) -> tuple[float, float]:
    """Return the vertex of the parabola through the largest sample and its neighbours: height, and index."""
    k = int(values.argmax())
    before, here, after = (float(values[(k + n) % values.size]) for n in (-1, 0, 1))
    curve = before - 2 * here + after
    shift = 0.5 * (before - after) / curve if curve < 0 else 0.0
    return here - 0.25 * (before - after) * shift, k + shift
