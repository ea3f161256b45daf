"""The ideal press in closed form, the printed facts about it, and the geometry that comes closest to them.

The closed form is for any arrangement of the parts, and of this study alone: the models have their own loop
closures, and a run of the scene ``ideal`` by each of them checks this one.
"""

from collections.abc import Sequence
from functools import cache, partial
from itertools import product
from math import inf, isfinite, pi, tau
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.optimize import least_squares

from comparison.scene import load_scene
from comparison.studies.shared.published import published
from comparison.tables.channels import Array

Points = NDArray[np.complex128]  # points of the plane as x + iy, m
BASE = "150rpm-0.2mm"

# ---- the closed form


class Lengths(NamedTuple):
    """Table 1, m."""

    crank: float
    rod2: float
    rocker: float
    rocker_centroid: float
    rod4: float


class Topology(NamedTuple):
    """The two-valued choices of an arrangement, 1 or -1, except the pin's."""

    crank: int  # 1: counter-clockwise, -1: clockwise
    rocker: int  # 1: joint B lies to the left of the line from A to H, -1: to its right
    slider: int  # -1: rod 4 points down from the rocker's tip, 1: up
    pin: str  # "centroid" or "tip": where rod 2 is attached to the rocker
    side: int  # -1: the guide is to the left of the crank pivot, 1: to its right

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
    """Lengths that Table 1 leaves out, m."""

    pivot_x: float
    pivot_y: float
    guide: float


class Motion(NamedTuple):
    """One crank cycle; every array has shape (n,)."""

    margin: float
    """The smallest length (m) by which two links reach each other; negative where the linkage cannot be
    assembled at some crank angle."""
    A: Points
    B: Points
    C: Points
    F: Points  # joints; F is the slider
    velocity: Array
    acceleration: Array  # of the slider, positive upwards, at a crank speed of 1 rad/s: m/s and m/s^2
    tangent: Array  # tangent of rod 4's angle to the guide


@np.errstate(divide="ignore", invalid="ignore", over="ignore")
def motion(geometry: Geometry, topology: Topology, lengths: Lengths, angle: Array) -> Motion:
    """Move the press to crank angles, counter-clockwise from the x axis either way, rad, shape (n,).

    Where links do not reach each other the half chord is set to zero, and `Motion.margin` is
    negative. Velocities follow from rigid rods: their ends have the same velocity along them.
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
    margins = [float(chord.min()) / lengths.rod2, float(fall.min()) / lengths.rod4]
    margin = min(margin if isfinite(margin) else -inf for margin in margins)
    return Motion(margin, A, B, C, F, C1.imag + height1, C2.imag + height2, np.abs(across / height))


def _dot(a: Points, b: Points) -> Array:
    return np.asarray(a.real * b.real + a.imag * b.imag)


# ---- the fit

ANGLES = 240
"""Crank angles of a cycle; parabolas through three of them give extrema to 1e-6 of their size."""
QUOTIENT_ALLOWANCE = 0.015
"""Of tan β: the largest errors of x and y need not belong to one instant. In 100 cycles of the model their
quotient falls 1.3 % short."""
DRAWS, STARTS = 1000, 5  # random geometries an arrangement, and the number of the best that start a fit
REACH, GUIDES = 0.9, (0.02, 1.5)
"""m; farther than rod 2, crank and rocker together reach; distances of the guide from the crank pivot."""
COARSE_ALLOWANCES = np.array([5.0, 0.02, 0.2, 0.2, 0.05])
"""Allowances of the first of two fits: with the printed ones alone the angle's steep valley holds it."""
ASSEMBLY_MISFIT = 1e3  # of a press that cannot be assembled, growing with the missing length


def printed_facts() -> pd.DataFrame:
    """Return the five facts that the geometry is fitted to, by name.

    ``value`` of the ideal motion, in ``unit``; ``allowance``: its standard deviation, from the rounding of
    the print and the share of the clearance in a number of a motion with clearance; ``rounding``: half a unit
    of the last printed digit alone.

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
        "largest tan β": ("", quotient, QUOTIENT_ALLOWANCE * quotient, of_quotient),
    }
    return pd.DataFrame.from_dict(rows, orient="index", columns=["unit", "value", "allowance", "rounding"])


def vibration() -> float:
    """Return the largest velocity error of Fig. 14e, m/s."""
    return max(abs(published(name).value) for name in ("F14e-vy", "F14e-vy2"))


def implied_positions() -> dict[str, float]:
    """Return places of the slider across its guide that printed errors of Fig. 14 imply, m from its centre.

    At constant crank angle the error of y is the distance from the ideal slider's line times tan β, which is
    largest, `printed_facts`, at the top dead centre, where the crank starts. ``line by x``: the middle of the
    range of x; ``line by y``: where the left wall gives the highest y error; ``start``: where the lowest y
    error is that of the start.
    """
    tangent = float(printed_facts()["value"]["largest tan β"])
    low, high, y, y2 = (published(name).value for name in ("F14a-x", "F14a-x2", "F14e-y", "F14e-y2"))
    clearance, line = float(load_scene(BASE).data["clearance"]["slider"]), -(low + high) / 2
    return {"line by x": line, "line by y": y2 / tangent - clearance, "start": line - y / tangent}


@cache
def table_1() -> tuple[Lengths, float]:
    """Return the lengths of Table 1, and the speed of the crank, rad/s."""
    data = load_scene(BASE).data
    rocker = data["mechanism"]["rocker"]
    crank, rod2, rod4 = (data["mechanism"][part]["length"] for part in ("crank", "rod2", "rod4"))
    lengths = Lengths(crank, rod2, rocker["length"], rocker["centroid"], rod4)
    return lengths, pi / 30 * abs(float(data["drive"]["speed_rpm"]))


def shipped_geometry() -> Geometry:
    """Return the geometry that the shipped scenes have; the guide is the ideal slider's line."""
    mechanism = load_scene("paper").data["mechanism"]
    x, y = mechanism["rocker_pivot"]
    return Geometry(x, y, mechanism["guide_x"] + mechanism["reference_offset"])


def facts_of(geometry: Geometry, topology: Topology, lengths: Lengths | None = None) -> tuple[float, Array]:
    """Return `Motion.margin` of a press, by default with the lengths of Table 1, and its facts.

    Shape (5,), in the order of `printed_facts`; nan where it cannot be assembled at every angle.
    """
    table, speed = table_1()
    lengths = lengths or table
    cycle = motion(geometry, topology, lengths, tau * np.arange(ANGLES) / ANGLES)
    if cycle.margin <= 0:
        return cycle.margin, np.full(5, np.nan)
    top, sample = _highest(cycle.F.imag)
    crank = sample * tau / ANGLES
    # Newton's method, since the print gives this angle to 4e-5 of a cycle; at most to the next sample.
    for _ in range(3):
        instant = motion(geometry, topology, lengths, np.array([crank]))
        velocity, acceleration = float(instant.velocity[0]), float(instant.acceleration[0])
        if acceleration < 0:
            step = topology.crank * velocity / acceleration
            crank -= min(max(step, -tau / ANGLES), tau / ANGLES)
    stroke = top + _highest(-cycle.F.imag)[0]
    low, high = -speed * _highest(-cycle.velocity)[0], speed * _highest(cycle.velocity)[0]
    facts = (np.degrees(crank) % 360.0, stroke, low, high, _highest(cycle.tangent)[0])
    return cycle.margin, np.array(facts)


def _highest(values: Array) -> tuple[float, float]:
    """Return the vertex of the parabola through the largest sample and its neighbours: height, and index."""
    k = int(values.argmax())
    before, middle, after = (float(values[(k + n) % values.size]) for n in (-1, 0, 1))
    curve = before - 2 * middle + after
    shift = 0.5 * (before - after) / curve if curve < 0 else 0.0
    return middle - 0.25 * (before - after) * shift, k + shift


class Fit(NamedTuple):
    """The best geometry of an arrangement."""

    topology: Topology
    geometry: Geometry
    facts: Array
    residuals: Array  # of these, over the allowances; both have shape (5,)
    covariance: Array  # of the geometry, m^2, shape (3, 3), from the Jacobian at the best fit

    @property
    def misfit(self) -> float:
        """Root of the sum of squared residuals over the degrees of freedom, 5 facts - 3 unknowns."""
        freedom = self.residuals.size - len(self.geometry)
        return float(np.sqrt(np.sum(self.residuals**2) / freedom))


def residuals(
    geometry: Sequence[float] | Array,
    topology: Topology,
    facts: pd.DataFrame,
    allowances: Array,
    lengths: Lengths | None = None,
) -> Array:
    """Return (ours - printed) / allowance, shape (5,); large where the press cannot be assembled."""
    margin, values = facts_of(Geometry(*map(float, geometry)), topology, lengths)
    if margin <= 0:
        return np.full(len(facts), ASSEMBLY_MISFIT * (1 - max(margin, -1.0)))
    errors = values - facts["value"].to_numpy()
    errors[0] = (errors[0] + 180.0) % 360.0 - 180.0
    return np.asarray(errors / allowances)


def fit(topology: Topology, facts: pd.DataFrame, draws: int = DRAWS) -> Fit | None:
    """Return the best geometry of an arrangement, or None where no draw can be assembled."""
    choices = (topology.crank, topology.rocker, topology.slider, topology.side, int(topology.pin == "tip"))
    rng = np.random.default_rng([0, *(digit + 1 for digit in choices)])
    near, far = sorted(topology.side * distance for distance in GUIDES)
    low, high = np.array([-REACH, -REACH, near]), np.array([REACH, REACH, far])
    starts = rng.uniform(low, high, (draws, 3))
    costs = np.array([np.sum(residuals(start, topology, facts, COARSE_ALLOWANCES) ** 2) for start in starts])
    search = partial(least_squares, residuals, bounds=(low, high), x_scale=0.1)
    fits = []
    for n in np.argsort(costs)[:STARTS]:
        if costs[n] < ASSEMBLY_MISFIT**2:
            coarse = search(starts[n], args=(topology, facts, COARSE_ALLOWANCES))
            fits.append(search(coarse.x, args=(topology, facts, facts["allowance"].to_numpy())))
    if not fits:
        return None
    best = min(fits, key=lambda each: each.cost)
    geometry = Geometry(*map(float, best.x))
    jacobian = np.asarray(best.jac, dtype=np.float64)
    covariance = np.asarray(np.linalg.pinv(jacobian.T @ jacobian))
    return Fit(topology, geometry, facts_of(geometry, topology)[1], np.asarray(best.fun), covariance)
