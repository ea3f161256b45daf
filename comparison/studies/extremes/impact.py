"""The one impact whose answer is known: what mass a corner meets, and what the contact law returns."""

from __future__ import annotations

from math import cos, log, log1p, radians, sin, tau
from typing import Any

import numpy as np
from scipy.optimize import brentq

from comparison.studies.identification.kinematics import Geometry, Topology, lengths_of, motion
from comparison.tables.arrays import Array


def restitution(c_e: float) -> float:
    """Return what F = K d^n (1 + C d'/v) with C = 3 (1 - c_e^2) / 4 returns of the speed v of an impact.

    Energy and momentum balance of a point mass: ln[(1 + C)/(1 - C e)] = C (1 + e), whatever m, K and n.
    """
    if c_e == 1.0:
        return 1.0
    C = 0.75 * (1.0 - c_e**2)
    return float(brentq(lambda e: log((1.0 + C) / (1.0 - C * e)) - C * (1.0 + e), 0.01, 1.0, xtol=1e-15))


def depth(m: float, K: float, v: float, c_e: float, n: float = 1.5) -> float:
    """Return how deep (m) a mass m (kg) of speed v (m/s) dips into the wall, friction and weight left out."""
    C = 0.75 * (1.0 - c_e**2)
    share = 0.5 if C == 0.0 else (C - log1p(C)) / C**2
    return float(((n + 1.0) * m * v**2 / K * share) ** (1.0 / (n + 1.0)))


def duration(m: float, K: float, v: float) -> float:
    """Return how long (s) an elastic contact of Hertz' law lasts."""
    return float(3.2181 * (m**2 / (K**2 * v)) ** 0.2)


def rod4_inclination(data: dict[str, Any], offset: float, angle: Array) -> Array:
    """Return the tangent of rod 4's angle to the guide at crank angles, rad, shape (n,).

    ``data``: of a scene; the slider is off the guide's centre line, m, to the right.
    """
    mechanism = data["mechanism"]
    pivot_x, pivot_y = mechanism["rocker_pivot"]
    geometry = Geometry(pivot_x, pivot_y, mechanism["guide_x"] + offset)
    topology = Topology(1, mechanism["rocker_branch"], mechanism["slider_branch"], "centroid", -1)
    return motion(geometry, topology, lengths_of(mechanism), angle).tangent


def effective_mass(data: dict[str, Any], corners: int, time: float = 0.0) -> float:
    """Return the mass (kg) that a corner feels in a frictionless impact on the left wall.

    Of a scene's data with the slider all but upright; the time of the touch, s, decides the inclination of
    rod 4. Two corners at once do not rotate the slider and share what rod 4 and slider put against the wall;
    one alone rotates the slider as well: 1/m = sin^2(theta4) L4^2/I4 + r_y^2/J5.
    """
    mechanism, drive = data["mechanism"], data["drive"]
    rod, slider = mechanism["rod4"], mechanism["slider"]
    angle = radians(mechanism["crank_angle_deg"]) + tau * drive["speed_rpm"] / 60 * time
    tangent = float(rod4_inclination(data, -data["clearance"]["slider"], np.array([angle]))[0])
    inertia = rod["inertia"] + rod["mass"] * rod["centroid"] ** 2 + slider["mass"] * rod["length"] ** 2
    across = rod["length"] ** 2 / inertia / (1.0 + tangent**2)
    if corners == 2:
        return float(0.5 / across)
    tilt = abs(data["initial"]["slider_angle"])
    arm = 0.5 * (slider["length"] * cos(tilt) - slider["width"] * sin(tilt))
    return float(1.0 / (across + arm**2 / slider["inertia"]))
