"""The limits that the paper must have used for its reliabilities, from our errors and its figures."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pandas import Series
from scipy.optimize import minimize_scalar

from comparison.execution.run import MODELS
from comparison.reliability.assessment import Assessment
from comparison.reliability.errors import unit_of
from comparison.reliability.interference import cap, implied_limit, reliability
from comparison.scene.criteria import Limits
from comparison.studies.paper.measures import reliabilities, scene_of
from comparison.studies.paper.runs import Runs
from comparison.studies.shared.published import printed_rows, published


@dataclass(frozen=True)
class Implied:
    """What one printed reliability implies.

    Attributes
    ----------
    identifier, quantity, unit
        Of the row; displacement, velocity or acceleration, and its unit.
    printed
        The smallest reliability.
    angle
        Of the printed part of the turn, deg; nan if none is printed.
    limits
        Model -> the upper limit that gives the printed value in the printed part of the turn, and the least
        and largest one within the rounding of the print.
    worst
        Model -> the part of the turn in which the model's reliability is smallest, deg, and the upper limit
        that gives the printed value there.
    """

    identifier: str
    quantity: str
    unit: str
    printed: float
    angle: float
    limits: dict[str, tuple[float, float, float]]
    worst: dict[str, tuple[float, float]]


def missing(limit: float, assessed: Assessment) -> float:
    """Return what the smallest reliability would miss to the cap with another upper limit, the lower zero."""
    limits = Limits(upper=limit)
    return float(cap(limits) - reliability(limits, assessed.mean, assessed.deviation).min())


def one_limit(runs: Runs, quantity: str) -> float:
    """Return the upper limit that meets all printed reliabilities of a quantity best, in its unit.

    Least squares of the logarithms of what is missing to the cap; a reliability printed at the cap does not
    count. The errors are those of the first model: both have the same.
    """
    known = []
    for identifier, texts in printed_rows().iterrows():
        printed = published(str(identifier))
        assessed = reliabilities(runs, scene_of(str(identifier)), MODELS[0]) if _of(texts, quantity) else {}
        if assessed and cap(Limits(upper=1.0)) - printed.value > printed.rounding:
            known.append((cap(Limits(upper=1.0)) - printed.value, assessed[quantity]))

    def squares(log_limit: float) -> float:
        found = [max(missing(float(np.exp(log_limit)), assessed), 1e-300) for _, assessed in known]
        return float(np.sum(np.log(np.array(found) / [wanted for wanted, _ in known]) ** 2))

    # The sum has several minima where a limit is too narrow for any reliability; a scan finds the widest.
    scan = np.log(np.geomspace(1e-6, 1e6, 241))
    start = int(np.argmin([squares(value) for value in scan]))
    near = scan[max(start - 1, 0)], scan[min(start + 1, scan.size - 1)]
    return float(np.exp(minimize_scalar(squares, bounds=near, method="bounded").x))


def _of(texts: Series, quantity: str) -> bool:
    return str(texts["quantity"]) == f"min_{quantity}_reliability"


def implied(runs: Runs) -> list[Implied]:
    """Solve every printed reliability for its upper limit, the lower one being zero."""
    found = []
    for identifier, texts in printed_rows().iterrows():
        if not str(texts["quantity"]).startswith("min_"):
            continue
        quantity = str(texts["quantity"]).split("_")[1]
        printed = published(str(identifier))
        angle = printed.angle
        limits, worst = {}, {}
        for model in MODELS:
            assessed = reliabilities(runs, scene_of(str(identifier)), model)[quantity]
            part = int(np.argmin(np.abs(assessed.angle - angle)))
            moments, of_worst = (
                (float(assessed.mean[k]), float(assessed.deviation[k])) for k in (part, assessed.worst)
            )
            # A higher reliability needs a wider limit.
            at, low, high = (
                implied_limit(printed.value + by, *moments)
                for by in (0.0, -printed.rounding, printed.rounding)
            )
            limits[model] = (at, low, high)
            worst[model] = float(assessed.angle[assessed.worst]), implied_limit(printed.value, *of_worst)
        found.append(
            Implied(str(identifier), quantity, unit_of(quantity), printed.value, angle, limits, worst)
        )
    return found
