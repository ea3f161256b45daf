"""What became of a run at an extreme: one of five classes, never something between them."""

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
    """The classes, best first; the last two must not occur."""

    CONVERGED = "converged"
    DEGRADED = "degraded"
    UNCONFIRMED = "unconfirmed"
    STOPPED = "stopped"
    REFUSED = "refused"
    CRASHED = "crashed"
    NONSENSE = "nonsense"


WORDS = {
    Class.CONVERGED: "finished, its error of x over the first turn is within what its setting promises, and "
    "neither energy from nowhere nor violated constraints are a reason to doubt it",
    Class.DEGRADED: "finished with more than that, which is told",
    Class.UNCONFIRMED: "finished, but no more accurate run came far enough to hold it against",
    Class.STOPPED: "given up by itself or at the limit of time, with a status that says what to try",
    Class.REFUSED: "not begun: the scene cannot be, and the message says why",
    Class.CRASHED: "the process died or the model raised what it should not: never",
    Class.NONSENSE: "a table with what is no number, or that is too short: never",
}
_REFUSED, _CRASHED, _NONSENSE = "bad input", "crashed", "unusable"


@dataclass(frozen=True)
class Verdict:
    """What became of one run.

    Attributes
    ----------
    kind
        Its class.
    error
        Largest distance of slider_x from the more accurate runs over the first turn, m; nan without any.
    promise
        What its setting promises, m.
    lasted
        Share of the first turn over which the distance stays within the promise.
    """

    kind: Class
    error: float = nan
    promise: float = nan
    lasted: float = nan


@dataclass(frozen=True)
class Closer:
    """What a closer look at one run found.

    Attributes
    ----------
    apart
        Largest distance of slider_x in the first turn, of two starts `closer.HAIR` apart, m; nan if unknown.
    finer
        The same run at a finer setting; None where there is none.
    status
        How that one ended.
    """

    apart: float
    finer: Verdict | None
    status: str = ""


def judge(row: Row, tight: Mapping[str, Row], promise: float) -> Verdict:
    """Judge a run by those that count as exact.

    Parameters
    ----------
    row
        Of the run (`comparison.studies.extremes.runs.measure`).
    tight
        The most accurate run of each model. Those that finished the first turn are used: with two of them
        the run must be close to both, as either may be the one that is wrong.
    promise
        Error of slider_x that the run's setting promises over the first turn, m.
    """
    status = row["status"]
    if status in (_REFUSED, _CRASHED, _NONSENSE):
        kind = {_REFUSED: Class.REFUSED, _CRASHED: Class.CRASHED, _NONSENSE: Class.NONSENSE}[status]
        return Verdict(kind, promise=promise)
    if status != "success":
        return Verdict(Class.STOPPED, promise=promise)
    x = np.asarray(row["x"], dtype=np.float64)
    exact = [of["x"] for of in tight.values() if of["status"] == "success"]
    if not exact:
        return Verdict(Class.UNCONFIRMED, promise=promise)
    distance = np.max([np.abs(x - np.asarray(of)) for of in exact], axis=0)
    error = float(distance.max())
    beyond = np.flatnonzero(~(distance <= promise))  # all, where nothing is promised
    lasted = float(beyond[0]) / (x.size - 1) if beyond.size else 1.0
    sound = (row.get("energy") or 0.0) <= MUCH_ENERGY and (row.get("drift") or 0.0) <= MUCH_DRIFT
    return Verdict(Class.CONVERGED if sound and not beyond.size else Class.DEGRADED, error, promise, lasted)


def magnification(exact: Row, twin: Row, distance: float) -> float:
    """Return by how much two starts so far apart (m) move apart at most in the first turn; nan if unknown."""
    if exact["status"] != "success" or twin["status"] != "success":
        return nan
    apart: Array = np.abs(np.asarray(exact["x"]) - np.asarray(twin["x"]))
    return float(apart.max()) / distance if distance > 0.0 else inf
