"""A run whose error of slider_x is estimated on its own scene, refined until that is as small as wanted.

The estimate is the numerical uncertainty u(t) of `comparison.accuracy.uncertainty`, and the samples at which
it is at most the wanted error are the predictable part. A setting serves if this is nearly all of the run;
else the next finer one is tried, or ``strict`` at once where that was of little use: the coarse runs may be
what parts. Of those tried the one with the largest predictable part is taken.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from math import inf, nan

import numpy as np

from comparison.accuracy.levels import (
    NAMES,
    coarser,
    metres,
    with_declared,
)
from comparison.agreement.refinement.estimate import CHANNEL, FLOOR, Estimate
from comparison.agreement.refinement.families import Families, Level, Run
from comparison.agreement.refinement.steps import MOST_LEVELS, settings
from comparison.execution.run import Job, Outcome, Progress, run_all, successful
from comparison.scene import Scene
from comparison.tables.channels import UNCERTAINTY
from comparison.tables.table import Table

ENOUGH = 0.9
"""Share of the samples that is enough; a smaller predictable part has grown if less of it was there."""


class Limit(StrEnum):
    """What keeps a wanted error from being reached."""

    STARTS = "neighbouring starts part"
    STOPPED = "finer settings have no result"
    FINEST = "the finest setting errs more"
    UNKNOWN = "no estimate"


@dataclass(frozen=True)
class AccurateRun:
    """A run with an estimate of its error.

    Attributes
    ----------
    model
        Which ran.
    wanted
        Error of slider_x, m; None for a named setting, or the scene's own.
    level
        The setting that was taken, with its runs.
    table
        Result, with the outcome in its provenance under ``"accuracy"``.
    tried
        All settings in the order in which they were tried.
    stopped
        Of a run at the finest setting that was tried, if it did not succeed.
    runs, seconds
        Number of runs, cached ones among them, and the wall time that they took, s.
    """

    model: str
    wanted: float | None
    level: Level
    table: Table
    tried: tuple[Level, ...]
    stopped: Outcome | None
    runs: int
    seconds: float

    @property
    def estimate(self) -> Estimate | None:
        """Estimated error; None where runs that it needs did not succeed."""
        return self.level.estimate

    @property
    def coverage(self) -> float:
        """Predictable part: the share of the samples on which the wanted error holds; nan without one."""
        if self.wanted is None:
            return nan
        return 0.0 if self.estimate is None else self.estimate.coverage(self.wanted)

    @property
    def kept(self) -> bool:
        """Whether the wanted error holds on enough samples; without one, whether the error is known."""
        return self.estimate is not None if self.wanted is None else self.coverage >= FLOOR

    @property
    def limit(self) -> Limit | None:
        """What keeps the wanted error from being reached; None if it is kept."""
        if self.kept:
            return None
        if self.estimate is None:
            return Limit.UNKNOWN
        if self.wanted is not None and self.estimate.attainable(self.wanted) < FLOOR:
            return Limit.STARTS
        return Limit.FINEST if self.stopped is None else Limit.STOPPED

    def with_uncertainty(self) -> Table:
        """Return the table with the estimated error, m, as ``slider_x_u`` beside slider_x; nan if unknown."""
        u = np.full(len(self.table.frame), nan) if self.estimate is None else self.estimate.u
        frame = self.table.frame.copy()
        frame.insert(list(frame.columns).index(CHANNEL) + 1, CHANNEL + UNCERTAINTY, u)
        return replace(self.table, frame=frame)


def accurate_run(
    scene: Scene,
    model: str,
    accuracy: str | float | None = None,
    *,
    run: Run | None = None,
    n_jobs: int = 1,
    on_progress: Progress | None = None,
) -> AccurateRun:
    """Run a scene, estimate the error of slider_x, and refine the setting until it is as small as wanted.

    Parameters
    ----------
    scene, model
        What to run. The formulation is the scene's.
    accuracy
        Wanted error of slider_x on the predictable part, m, also as text; or ``"draft"``, ``"standard"``,
        ``"strict"``: that setting with its estimate, without refinement; None: the scene's own.
    run
        Runs scenes by the model; default: `comparison.execution.run.run_all`, which caches them.
    n_jobs
        Worker processes of that; the reference runs in this process.
    on_progress
        Called with the finished share of each family of runs, 0 to 1.

    Raises
    ------
    AccuracyError
        If the accuracy is neither a name nor a positive number, or a name for a model that has none.
    SceneError
        If the model refuses the scene.
    RunError
        If no setting has a result.

    Notes
    -----
    Exudyn and installed models run in worker processes: a script that calls this needs the usual
    ``if __name__ == "__main__":``.
    """
    begun = time.perf_counter()
    scene = with_declared(scene, [model])
    wanted = None if accuracy is None or accuracy in NAMES else metres(accuracy)

    def by_default(scenes: Sequence[Scene]) -> list[Outcome]:
        jobs = [Job(each, model) for each in scenes]
        return run_all(jobs, 0 if model == "reference" else n_jobs, on_progress)

    families = Families(model, run or by_default)
    tried: list[Level] = []
    steps = list(settings(scene, model, accuracy))
    while steps:
        tried.append(families.level(steps.pop(0)))
        if _ends(tried[-1], wanted):
            break
        if len(tried) > 1 and not _gains(tried[-2], tried[-1], wanted):
            steps = steps[-1:]
    stopped = tried[-1].failed
    rough = coarser(model, tried[0].scene)
    while rough and len(tried) < MOST_LEVELS and all(level.estimate is None for level in tried):
        tried.append(families.level(rough))
        rough = coarser(model, rough)
    best = max(tried, key=lambda level: _merit(level, wanted))
    table = successful(best.outcomes["base"], Job(best.scene, model))
    seconds = time.perf_counter() - begun
    found = AccurateRun(model, wanted, best, table, tuple(tried), stopped, families.count, seconds)
    record = {**table.provenance, "accuracy": _record(found)}
    return replace(found, table=replace(table, provenance=record))


def _ends(level: Level, wanted: float | None) -> bool:
    """Return whether no finer setting is needed, or none can be estimated."""
    if level.estimate is None:
        return level.table() is not None  # then the finer run did not succeed
    return wanted is None or level.estimate.coverage(wanted) >= ENOUGH


def _gains(coarse: Level, fine: Level, wanted: float | None) -> bool:
    """Return whether a finer setting predicts clearly more; also where nothing was predicted before."""
    if coarse.estimate is None or fine.estimate is None or wanted is None:
        return True
    before, after = (level.estimate.coverage(wanted) for level in (coarse, fine) if level.estimate)
    return before < FLOOR or ENOUGH * after > before


def _merit(level: Level, wanted: float | None) -> tuple[float, float]:
    """Return what a level is chosen by: the largest predictable part, then the least error."""
    if level.estimate is None:
        return -1.0, float(level.table() is not None)
    coverage = 1.0 if wanted is None else level.estimate.coverage(wanted)
    return coverage, -level.estimate.held(FLOOR)


def _record(found: AccurateRun) -> dict[str, object]:
    """Return what is recorded of an accuracy beside the table; lengths in m, times in s."""
    record: dict[str, object] = {
        "wanted_m": found.wanted,
        "kept": found.kept,
        "limit": found.limit,
        "from": "runs on this scene",
        "runs": found.runs,
    }
    if (of := found.estimate) is not None:
        record |= {"estimated_m": {f"{share:g}": of.held(share) for share in (FLOOR, 0.5, 0.9, 1.0)}}
        if found.wanted is not None:
            until = of.until(found.wanted)
            record |= {"coverage": found.coverage, "until_s": None if until == inf else until}
    return record
