"""The verdict on a run at an extreme: one of a few classes, never something between them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from math import nan

import numpy as np

from comparison.execution.quality import MUCH_DRIFT, MUCH_ENERGY
from comparison.execution.store import Row


class Class(StrEnum):
    """The classes, best first, as the template of the page explains them; the last two must not occur."""

    CONVERGED = "converged"
    ANNOUNCED = "announced"
    DEGRADED = "degraded"
    UNCONFIRMED = "unconfirmed"
    STOPPED = "stopped"
    REFUSED = "refused"
    CRASHED = "crashed"
    NONSENSE = "nonsense"


LARGER = (Class.ANNOUNCED, Class.DEGRADED)
"""Of runs that err more than their bound; which of the two, `checks` finds out."""
_BY_STATUS = {"bad input": Class.REFUSED, "crashed": Class.CRASHED, "unusable": Class.NONSENSE}


@dataclass(frozen=True)
class Verdict:
    """What became of one run."""

    kind: Class
    error: float = nan
    """Largest distance of slider_x from the exact runs over the first cycle, m; nan without any."""
    bound: float = nan
    """On the error at its setting, m; nan where none is on record."""
    lasted: float = nan
    """Share of the first cycle over which the distance stays within the bound."""


@dataclass(frozen=True)
class Refined:
    """What the refined reruns of one run found."""

    apart: float
    """Largest distance of slider_x in the first cycle, of starts a hair apart, m; nan if unknown."""
    finer: Verdict | None
    """The same run at a finer setting; None where there is none."""
    status: str = ""
    """How that one ended."""


def judge(row: Row, exact: Mapping[str, Row], bound: float) -> Verdict:
    """Judge a run (`runs.measure`) by those that count as exact, the most accurate runs of each model.

    Those that finished the first cycle are used: with two of them the run must be close to both, as either
    may be the one that is wrong. ``bound``: on the error of slider_x at its setting over the cycle, m.
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


def apart(*rows: Row) -> float:
    """Return how far the finished ones of runs are from one another at most, m; nan with less than two."""
    runs = [np.asarray(row["x"], dtype=np.float64) for row in rows if row["status"] == "success"]
    return float(np.ptp(runs, axis=0).max()) if len(runs) > 1 else nan
