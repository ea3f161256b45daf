"""What follows from measured settings: observed orders, the Pareto front, costs at equal error."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import inf, log10, nan

import numpy as np

from comparison.studies.shared.rates import rate
from comparison.tables.arrays import Array


@dataclass(frozen=True)
class Point:
    """One setting: its error and its cost; an error of 0 or nan is no point of a curve."""

    setting: float
    error: float
    cost: float


def asymptotic(points: Sequence[Point], order: float, largest: float) -> list[bool]:
    """Return which points lie where the error falls with the setting as the method promises.

    A point does if its error is at most ``largest`` and the next finer one gains at least half of the order
    from it; the finest if it is on that side of one that does.

    Parameters
    ----------
    points
        Coarsest setting first.
    order
        Of the error in the setting.
    largest
        In the unit of the errors.
    """
    falls = [
        one.error <= largest
        and finer.error > 0
        and log10(one.error / finer.error) >= 0.5 * order * log10(one.setting / finer.setting)
        for one, finer in pairwise(points)
    ]
    return [*falls, bool(falls) and falls[-1]] if points else []


def observed_order(points: Sequence[Point]) -> float:
    """Return the slope of the logarithms, by least squares; nan of fewer than three points."""
    good = [point for point in points if point.error > 0]
    if len(good) < 3:
        return nan
    return rate([point.setting for point in good], [point.error for point in good])


def front(points: Sequence[Point]) -> list[Point]:
    """Return the points that no other one beats in error and in cost, the cheapest first."""
    kept: list[Point] = []
    for point in sorted(points, key=lambda p: (p.cost, p.error)):
        if point.error < (kept[-1].error if kept else inf):
            kept.append(point)
    return kept


def cost_at(points: Sequence[Point], error: float) -> float:
    """Return what a method costs that is to be wrong by no more than a given error.

    Between its settings by the logarithms; of settings that are as accurate the cheapest. If all are more
    accurate the cheapest of them; nan if none is accurate enough: nothing is extrapolated.
    """
    best = front([point for point in points if point.error > 0])
    if not best or error < best[-1].error:
        return nan
    if error >= best[0].error:
        return best[0].cost
    errors: Array = np.log10([point.error for point in best])
    costs: Array = np.log10([point.cost for point in best])
    return float(10 ** np.interp(log10(error), errors[::-1], costs[::-1]))
