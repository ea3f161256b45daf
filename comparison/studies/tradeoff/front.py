"""What follows from measured settings: observed orders, the Pareto front, costs at equal error.

A curve is a data frame with a row a setting, coarsest first, and the columns ``setting``, ``error`` and
``cost``; an error of 0 or nan is no point of it.
"""

from __future__ import annotations

from math import log10, nan

import numpy as np
import pandas as pd

from comparison.accuracy.work_precision import pareto
from comparison.execution.tasks import SUCCESS
from comparison.studies.shared.rates import rate
from comparison.studies.tradeoff.methods import Sweep
from comparison.tables.arrays import BoolArray

LARGEST = {"slider_x": 2e-6, "crank_torque": 1e-2}
"""Above such an error (a hundredth of the clearance, of the range) nothing is asymptotic."""


def curve_of(rows: pd.DataFrame, sweep: Sweep, quantity: str, cost: str = "seconds") -> pd.DataFrame:
    """Return the settings of a method with a result, from rows of one scene."""
    good = rows[(rows["method"] == sweep.method.name) & (rows["status"] == SUCCESS)].dropna(subset=[cost])
    columns = {"setting": good["setting"], "error": good[f"errors.{quantity}"], "cost": good[cost]}
    return pd.DataFrame(columns, dtype=np.float64).reset_index(drop=True)


def asymptotic(curve: pd.DataFrame, order: float, quantity: str) -> BoolArray:
    """Return which points lie where the error falls with the setting at the order of the method.

    A point does if its error is not above `LARGEST` and the next finer one gains at least half of the order
    from it; the finest if the one before it does.
    """
    if len(curve) < 2:
        return np.zeros(len(curve), dtype=bool)
    error, setting = (curve[name].to_numpy(np.float64) for name in ("error", "setting"))
    with np.errstate(divide="ignore", invalid="ignore"):
        gain, refined = (np.log10(of[:-1] / of[1:]) for of in (error, setting))
    falls = (error[:-1] <= LARGEST[quantity]) & (error[1:] > 0) & (gain >= 0.5 * order * refined)
    return np.append(falls, falls[-1])


def observed_order(curve: pd.DataFrame) -> float:
    """Return the slope of the logarithms, by least squares; nan of fewer than three points."""
    good = curve[curve["error"] > 0]
    return rate(good["setting"].tolist(), good["error"].tolist()) if len(good) >= 3 else nan


def front(curve: pd.DataFrame) -> pd.DataFrame:
    """Return the points that no other one beats in error and in cost, the cheapest first."""
    points = curve[curve["error"] > 0].sort_values(["cost", "error"])
    return points[pareto(points["error"].to_numpy(np.float64), points["cost"].to_numpy(np.float64))]


def cost_at(curve: pd.DataFrame, error: float) -> float:
    """Return what a method costs whose error is to be at most a given one.

    Interpolated between its settings in logarithms; of settings that are as accurate the cheapest. If all are
    more accurate the cheapest of them; nan if none is accurate enough: nothing is extrapolated.
    """
    best = front(curve)[::-1]
    if best.empty or error < best["error"].iloc[0]:
        return nan
    return float(10 ** np.interp(log10(error), np.log10(best["error"]), np.log10(best["cost"])))
