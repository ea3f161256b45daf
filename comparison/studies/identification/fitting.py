"""The geometry of a topology that comes closest to the published facts, and how well they determine it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
import pandas as pd
from scipy.optimize import least_squares

from comparison.studies.identification.facts import shown
from comparison.studies.identification.kinematics import Geometry, Topology
from comparison.tables.arrays import Array

DRAWN = 1000
"""Random geometries a topology, of which the best are the starts of a fit."""
STARTS = 5
REACH = 0.9
"""m; pivots farther than rod 2, crank and rocker together would reach are not drawn."""
GUIDES = (0.02, 1.5)
"""m; distances of the guide from the crank pivot."""
COARSE = np.array([5.0, 0.02, 0.2, 0.2, 0.05])
"""Allowances of the first of two fits: with the printed ones alone the angle's steep valley holds it."""
MISSING = 1e3
"""Misfit of a press that cannot be assembled, growing with what it lacks."""


@dataclass(frozen=True)
class Fit:
    """The best geometry of a topology."""

    topology: Topology
    geometry: Geometry
    shown: Array
    residuals: Array
    """Of what the press shows, over the facts' allowances; both have shape (5,)."""
    covariance: Array
    """Of the geometry, m^2, shape (3, 3), from the Jacobian at the best fit."""

    @property
    def misfit(self) -> float:
        """Root of the sum of squared residuals over the degrees of freedom, 5 facts - 3 unknowns."""
        freedom = self.residuals.size - len(self.geometry)
        return float(np.sqrt(np.sum(self.residuals**2) / freedom))


@dataclass(frozen=True)
class Profile:
    """What it costs to hold one unknown."""

    best: float
    values: Array
    """What it is held at, shape (n,); like the best in m."""
    growth: Array
    """Of the sum of squared residuals over that of the best geometry, the others fitted, shape (n,)."""

    @property
    def two_sigma(self) -> tuple[float, float]:
        """Return where the growth passes 4, to either side, m."""
        low, high = np.flatnonzero(self.values < self.best)[::-1], self.values > self.best
        below, above = (float(np.interp(4.0, self.growth[at], self.values[at])) for at in (low, high))
        return below, above


def residuals(geometry: Sequence[float], topology: Topology, facts: pd.DataFrame, allowances: Array) -> Array:
    """Return (shown - printed) / allowance, shape (5,); large where the press cannot be assembled."""
    assembled, values = shown(Geometry(*map(float, geometry)), topology)
    if assembled <= 0:
        return np.full(len(facts), MISSING * (1 - max(assembled, -1.0)))
    off = values - facts["value"].to_numpy()
    off[0] = (off[0] + 180.0) % 360.0 - 180.0
    return np.asarray(off / allowances)


def fit(topology: Topology, facts: pd.DataFrame, drawn: int = DRAWN) -> Fit | None:
    """Return the best geometry of a topology, or None where none of the drawn ones can be assembled.

    The facts are as `comparison.studies.identification.facts.printed_facts` returns them.
    """
    digits = (topology.crank, topology.rocker, topology.slider, topology.side, int(topology.pin == "tip"))
    rng = np.random.default_rng([0, *(digit + 1 for digit in digits)])
    near, far = sorted(topology.side * distance for distance in GUIDES)
    low, high = np.array([-REACH, -REACH, near]), np.array([REACH, REACH, far])
    starts = rng.uniform(low, high, (drawn, 3))

    def of(geometry: Array, allowances: Array) -> Array:
        return residuals(geometry.tolist(), topology, facts, allowances)

    costs = np.array([np.sum(of(start, COARSE) ** 2) for start in starts])
    search = partial(least_squares, of, bounds=(low, high), x_scale=0.1)
    tried = []
    for n in np.argsort(costs)[:STARTS]:
        if costs[n] < MISSING**2:
            coarse = search(starts[n], args=(COARSE,))
            tried.append(search(coarse.x, args=(facts["allowance"].to_numpy(),)))
    if not tried:
        return None
    best = min(tried, key=lambda found: found.cost)
    fitted = Geometry(*map(float, best.x))
    jacobian = np.asarray(best.jac, dtype=np.float64)
    covariance = np.asarray(np.linalg.pinv(jacobian.T @ jacobian))
    return Fit(topology, fitted, shown(fitted, topology)[1], np.asarray(best.fun), covariance)


def profile(fitted: Fit, which: int, values: Array, facts: pd.DataFrame) -> Profile:
    """Return what it costs to hold one unknown at values, m, shape (n,), while the others are fitted.

    ``which``: its place in `Geometry`. The searches start along the covariance of the best fit.
    """
    free = [k for k in range(3) if k != which]
    slope = fitted.covariance[free, which] / fitted.covariance[which, which]
    best = np.array(fitted.geometry)
    allowances = facts["allowance"].to_numpy()

    def of(others: Array, value: float) -> Array:
        return residuals(np.insert(others, which, value).tolist(), fitted.topology, facts, allowances)

    sums = []
    for value in values:
        start = best[free] + slope * (value - best[which])
        sums.append(2 * least_squares(of, start, args=(value,), x_scale=0.1).cost)
    growth = np.array(sums) - np.sum(fitted.residuals**2)
    return Profile(fitted.geometry[which], values, growth)
