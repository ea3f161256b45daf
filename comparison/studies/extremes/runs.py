"""Runs of a scene by both models within a limit of processor time, and the verdict on them, as a task.

The key of a row hashes this module and what it imports: cells and classes are elsewhere, so that a change
of theirs runs nothing again.
"""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from math import isnan
from typing import Any

from comparison.accuracy.refine import levels, runs_by_model, usable_table
from comparison.execution.run import (
    Outcome,
    Progress,
    quality_warnings,
    run_here,
    run_one,
    steps_per_contact,
)
from comparison.execution.store import Row
from comparison.execution.tasks import LATE, SUCCESS, Task, measure_all, on_processes
from comparison.models import MODELS
from comparison.scene import Scene, load_scene
from comparison.tables.table import Table
from comparison.verdict.compare import compare
from comparison.verdict.confirmation import confirm
from comparison.verdict.results import SceneComparison

BASE = "150rpm-0.2mm"
"""The scene that all cells change, and an ordinary one to compile kernels with."""
LIMIT = 20.0
"""Processor time of a run, s."""
FURTHER = 5.0
"""Times the limit of a run, for all further runs that a verdict takes."""
GRACE = 10.0
"""Times all limits of a pair: wall time after which a process that does not look at the time is ended."""
CUT_OFF = "cut off"
"""Status of a run that this study ended at its limit."""
WARM_UP = 0.02
"""Cycles of the run before, in which kernels are compiled: not counted."""


class _OutOfTimeError(BaseException):
    """Ends a run at its limit: a model cannot take it for an exception of its own."""


@dataclass(frozen=True)
class PairRun(Task):
    """A scene to be run by both models; a run has ``limit`` seconds of processor time."""

    scene: Scene
    limit: float = LIMIT
    models = MODELS


def run_pairs(tasks: Sequence[PairRun], n_jobs: int, on_progress: Progress | None) -> list[Row]:
    """Return the rows of `run_pair`, equal tasks run once; stored rows are not run again.

    Where a process died (`CRASHED`) or was ended (`LATE`) that is the status of both models.
    """
    limit = max((task.limit for task in tasks), default=LIMIT)
    wall = GRACE * (len(MODELS) + FURTHER) * limit
    rows = measure_all(run_pair, tasks, on_processes(n_jobs, wall), on_progress)
    return [row if row["status"] == SUCCESS else row | no_run(row["status"], row["message"]) for row in rows]


def no_run(status: str, message: str) -> Row:
    """Return the row of a scene that neither model ran."""
    side = {"status": CUT_OFF if status == LATE else status, "message": message}
    return {**dict.fromkeys(MODELS, side), "verdict": "", "reason": "", "coverage": None, "apart_m": None}


def run_pair(task: PairRun, progress: Progress) -> Row:
    """Run a scene by both models and compare, as ``sixbar validate --quick`` does without refinement.

    The row has, by model, ``status``; ``message``: advice, or the warnings of a run that succeeded;
    ``steps``; ``contacts``; ``steps_per_contact`` and ``constraint_m``, the largest violation of a
    constraint, None where there are none. Where both succeeded: ``verdict``, its ``reason``: the channels
    that have it, or the run without a result; its ``coverage``, and ``apart_m``, the largest distance in
    slider_x while predictable, m.
    """
    solver = task.scene.data["solver"]
    for model in MODELS:
        _compile(model, solver[model]["formulation"], solver[model]["method"])
    progress(0.0)
    bases = {model: _run(task.scene, model, time.process_time() + task.limit) for model in MODELS}
    row = no_run("", "") | {model: _record(outcome) for model, outcome in bases.items()}
    if all(outcome.table is not None for outcome in bases.values()):
        row |= _verdict(task.scene, bases, time.process_time() + FURTHER * task.limit)
    return row


@cache
def _compile(model: str, formulation: str, method: str) -> None:
    """Run a little of an ordinary scene, once a process for each formulation and integrator."""
    solver = {f"solver.{model}.formulation": formulation, f"solver.{model}.method": method}
    run_one(load_scene(BASE, solver | {"drive.cycles": WARM_UP}), model)


def _run(scene: Scene, model: str, end: float) -> Outcome:
    """Run a scene in this process until it has used so much processor time, s."""

    def in_time(share: float) -> None:
        if share < 1.0 and time.process_time() > end:
            raise _OutOfTimeError(share)

    try:
        return run_here(scene, model, in_time)
    except _OutOfTimeError as error:
        return Outcome(CUT_OFF, f"{100 * error.args[0]:.3g} % of its time was run")


def _record(outcome: Outcome) -> dict[str, Any]:
    """Return the record of a run, also of one that ended early."""
    table, message = outcome.table, outcome.message
    if table is not None:
        message = "; ".join(quality_warnings(table))
    numbers = {} if (part := table or outcome.partial) is None else _numbers(part)
    return {"status": outcome.status, "message": message, **numbers}


def _numbers(table: Table) -> dict[str, Any]:
    return {
        "steps": table.provenance.get("counters", {}).get("steps"),
        "contacts": 0 if table.events is None else len(table.events),
        "steps_per_contact": _number(steps_per_contact(table)),
        "constraint_m": table.provenance.get("constraints", {}).get("position"),
    }


def _number(value: float) -> float | None:
    return None if isnan(value) else value


def _verdict(scene: Scene, bases: dict[str, Outcome], end: float) -> Row:
    """Return the verdict on two runs, with the further ones of either model until a processor time, s."""
    outcomes = {
        (model, kind): bases[model] if kind == "base" else _run(level, model, end)
        for model in MODELS
        for kind, level in levels(scene, model).items()
    }
    for (model, kind), outcome in outcomes.items():
        if usable_table(kind, outcome) is None:
            reason = f"no estimate of the error: {model}, {kind} run: {outcome.status}"
            return {"verdict": "indeterminate", "reason": reason}

    def ensemble(starts: Sequence[Scene], model: str) -> list[Table]:
        tables = (_run(start, model, end).table for start in starts if time.process_time() < end)
        return [table for table in tables if table is not None]

    first, second = MODELS
    runs = runs_by_model(scene, (first, second), outcomes)
    result = compare(*runs, scene=scene, labels=(first, second))
    result = confirm(result, runs, scene=scene, models=(first, second), run=ensemble)
    return verdict_of(result)


def verdict_of(result: SceneComparison) -> Row:
    """Return the part of a row that a comparison gives."""
    return {
        "verdict": result.verdict,
        "reason": ", ".join(channel.channel for channel in result.with_verdict(result.verdict)),
        "coverage": result.coverage,
        "apart_m": _number(result.channels["slider_x"].largest_predictable),
    }
