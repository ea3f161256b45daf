"""The verdict on a run at an extreme: one of a few classes, never something between them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from math import inf, nan

import numpy as np

from comparison.execution.ledger import Row
from comparison.execution.quality_checks import MUCH_DRIFT, MUCH_ENERGY
from comparison.tables.arrays import Array


class Class(StrEnum):
    """The classes, best first, as the template of the page explains them; the last two must not occur."""

    CONVERGED = "converged"
    DEGRADED = "degraded"
    UNCONFIRMED = "unconfirmed"
    STOPPED = "stopped"
    REFUSED = "refused"
    CRASHED = "crashed"
    NONSENSE = "nonsense"


_BY_STATUS = {"bad input": Class.REFUSED, "crashed": Class.CRASHED, "unusable": Class.NONSENSE}


@dataclass(frozen=True)
class Verdict:
    """What became of one run.

    Attributes
    ----------
    kind
        Its class.
    error
        Largest distance of slider_x from the exact runs over the first cycle, m; nan without any.
    bound
        On the error at its setting, m; nan where none is on record.
    lasted
        Share of the first cycle over which the distance stays within the bound.
    """

    kind: Class
    error: float = nan
    bound: float = nan
    lasted: float = nan


@dataclass(frozen=True)
class Refined:
    """What the refined reruns of one run found.

    Attributes
    ----------
    apart
        Largest distance of slider_x in the first cycle, of two starts `refinement.HAIR` apart, m; nan if
        unknown.
    finer
        The same run at a finer setting; None where there is none.
    status
        How that one ended.
    """

    apart: float
    finer: Verdict | None
    status: str = ""


def judge(row: Row, exact: Mapping[str, Row], bound: float) -> Verdict:
    """Judge a run by those that count as exact.

    Parameters
    ----------
    row
        Of the run (`comparison.studies.extremes.runs.measure`).
    exact
        The most accurate runs of each model. Those that finished the first cycle are used: with two of them
        the run must be close to both, as either may be the one that is wrong.
    bound
        Error bound of slider_x at the run's setting over the first cycle, m.
    """
    if row["status"] != "success":
        return Verdict(_BY_STATUS.get(row["status"], Class.STOPPED), bound=bound)
    x = np.asarray(row["x"], dtype=np.float64)
    finished = [of["x"] for of in exact.values() if of["status"] == "success"]
    if not finished:
        return Verdict(Class.UNCONFIRMED, bound=bound)
    distance = np.max([np.abs(x - np.asarray(of)) for of in finished], axis=0)
    outside = np.flatnonzero(~(distance <= bound))  # all, where there is no bound
    lasted = float(outside[0]) / (x.size - 1) if outside.size else 1.0
    sound = (row.get("energy_share") or 0.0) <= MUCH_ENERGY and (row.get("constraint_m") or 0.0) <= MUCH_DRIFT
    kind = Class.CONVERGED if sound and not outside.size else Class.DEGRADED
    return Verdict(kind, float(distance.max()), bound, lasted)


def magnification(exact: Row, perturbed: Row, distance: float) -> float:
    """Return by how much two starts so far apart (m) move apart in the first cycle; nan if unknown."""
    if exact["status"] != "success" or perturbed["status"] != "success":
        return nan
    apart: Array = np.abs(np.asarray(exact["x"]) - np.asarray(perturbed["x"]))
    return float(apart.max()) / distance if distance > 0.0 else inf
