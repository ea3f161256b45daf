"""Observed order of convergence of each model from the three levels of its runs."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite, log, nan, sqrt
from typing import NamedTuple

import numpy as np

from comparison.accuracy.uncertainty import Runs
from comparison.agreement.cross_check import Validation
from comparison.agreement.results import SceneComparison


class Order(NamedTuple):
    """Observed order of a model, nan if unknown, and the one that its method has."""

    observed: float
    expected: float


def observed_orders(results: Sequence[Validation]) -> dict[tuple[str, str], tuple[Order, Order]]:
    """Return the orders at which the errors of both models follow their settings, by scene and tier.

    With d_c and d_f the root mean squares of coarser minus base and of base minus finer, over the channel's
    scale, of the judged samples of all excited channels, it is log(d_c / d_f) / log(r) for levels that differ
    by the factor r. It means something where the runs are in their asymptotic range: with located events and
    a tolerance, errors need not follow any power.

    Parameters
    ----------
    results
        Of the scenes; those whose runs failed are left out.

    Returns
    -------
    dict
        By scene and tier, of either model. Unknown where a model has no three levels, or two are equal.
    """
    found = {}
    for result in results:
        for tier in result.comparison.tiers:
            runs = result.runs if tier.tier == "standard" else result.tight_runs
            if tier.channels and runs:
                a, b = tier.labels
                first, second = (Order(order(runs[of], tier), runs[of].refinement[1]) for of in (a, b))
                found[tier.name, tier.tier] = (first, second)
    return found


def order(runs: Runs, result: SceneComparison) -> float:
    """Return the observed order of one model's runs; nan if unknown."""
    if runs.coarser is None or runs.finer is None:
        return nan
    coarse = fine = 0.0
    for name, channel in result.channels.items():
        if channel.verdict == "unexcited":
            continue
        base = runs.base.values(name)
        if base.shape != channel.predictable.shape:
            return nan  # a table that was interpolated
        kept = channel.predictable
        coarse += float(np.sum(((runs.coarser.values(name) - base)[kept] / channel.scale) ** 2))
        fine += float(np.sum(((base - runs.finer.values(name))[kept] / channel.scale) ** 2))
    if not (coarse > 0.0 and fine > 0.0):
        return nan
    found = log(sqrt(coarse / fine)) / log(runs.refinement[0])
    return found if isfinite(found) else nan
