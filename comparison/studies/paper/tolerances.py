"""The limits that the paper must have used for its reliabilities, from our errors and its figures."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.optimize import minimize_scalar

from comparison.models import MODELS
from comparison.reliability.assessment import Assessment, cap, implied_limit, reliability
from comparison.reliability.errors import unit_of
from comparison.scene.schema import Limits
from comparison.studies.paper.measures import reliabilities, scene_of
from comparison.studies.paper.runs import Runs
from comparison.studies.shared.published import Published, printed_rows, published


def missing(limit: float, assessed: Assessment) -> float:
    """Return what the smallest reliability would miss to the cap with another upper limit, the lower zero."""
    limits = Limits(upper=limit)
    return float(cap(limits) - reliability(limits, assessed.mean, assessed.deviation).min())


def one_limit(runs: Runs, quantity: str) -> float:
    """Return the upper limit that meets all printed reliabilities of a quantity best, in its unit.

    Least squares of the logarithms of what is missing to the cap; a reliability printed at the cap does not
    count. The errors are those of the first model: both have the same.
    """
    top = cap(Limits(upper=1.0))
    known = [
        (top - printed.value, reliabilities(runs, scene_of(identifier), MODELS[0])[quantity])
        for identifier, of, printed in printed_reliabilities()
        if of == quantity and top - printed.value > printed.rounding
    ]

    def squares(log_limit: float) -> float:
        found = [max(missing(float(np.exp(log_limit)), assessed), 1e-300) for _, assessed in known]
        return float(np.sum(np.log(np.array(found) / [wanted for wanted, _ in known]) ** 2))

    # The sum has several minima where a limit is too narrow for any reliability; a scan finds the widest.
    scan = np.log(np.geomspace(1e-6, 1e6, 241))
    start = int(np.argmin([squares(value) for value in scan]))
    around = scan[max(start - 1, 0)], scan[min(start + 1, scan.size - 1)]
    return float(np.exp(minimize_scalar(squares, bounds=around, method="bounded").x))


def printed_reliabilities() -> list[tuple[str, str, Published]]:
    """Return id, quantity and figure of each smallest reliability that the paper prints."""
    quantities = printed_rows()["quantity"].str.extract(r"^min_(\w+)_reliability$", expand=False).dropna()
    return [(str(identifier), of, published(str(identifier))) for identifier, of in quantities.items()]


def implied(runs: Runs) -> list[dict[str, Any]]:
    """Solve every printed reliability for its upper limit, the lower one being zero.

    Returns
    -------
    rows
        ``id``, ``quantity``, ``unit`` and ``printed``; ``limits``: model -> the upper limit that gives the
        printed value in the printed part of the cycle, and the least and largest one within the rounding of
        the print; ``worst``: model -> the part of the cycle in which the model's reliability is smallest,
        deg, and the upper limit that gives the printed value there.
    """
    rows = []
    for identifier, quantity, printed in printed_reliabilities():
        limits, worst = {}, {}
        for model in MODELS:
            assessed = reliabilities(runs, scene_of(identifier), model)[quantity]
            part = int(np.argmin(np.abs(assessed.angle - printed.angle)))
            moments, of_worst = (
                (float(assessed.mean[k]), float(assessed.deviation[k])) for k in (part, assessed.worst)
            )
            # A higher reliability needs a wider limit.
            limits[model] = [
                implied_limit(printed.value + by, *moments)
                for by in (0.0, -printed.rounding, printed.rounding)
            ]
            worst[model] = float(assessed.angle[assessed.worst]), implied_limit(printed.value, *of_worst)
        row = {"id": identifier, "quantity": quantity, "unit": unit_of(quantity), "printed": printed}
        rows.append(row | {"limits": limits, "worst": worst})
    return rows
