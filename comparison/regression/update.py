"""Creation of a baseline: every gated run with its family, which determines the thresholds."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError

from comparison.accuracy.levels import refinement
from comparison.accuracy.thresholds import thresholds_record
from comparison.agreement.planned_runs import family
from comparison.engines.platform import platform_name, versions
from comparison.execution.job import Job, Outcome, Progress, RunError
from comparison.execution.run import run_all
from comparison.regression.baseline import (
    Baseline,
    BaselineError,
    Detection,
    Rates,
    RunRecord,
    SceneRecord,
    explain,
)
from comparison.regression.check import gated_runs, physics_hash, source
from comparison.regression.checkpoints import record
from comparison.regression.neighbours import RECORDED, neighbours
from comparison.scene import Scene, SceneError
from comparison.tables.table import Table
from comparison.verdict.compare import Runs

RATES = Path("reports/detection/detection.json")
"""The measured rates of the verdicts' errors, as seen from the baseline's folder."""


class _Measured(BaseModel):
    """What of the rates' file is read; it may hold more."""

    thresholds: dict[str, Any]
    false_alarms: Rates
    detected: Rates


def renewed(
    scenes: Sequence[Scene],
    folder: Path,
    old: Baseline | None = None,
    *,
    n_jobs: int = 1,
    on_progress: Progress | None = None,
) -> Baseline:
    """Create the baseline of scenes.

    Parameters
    ----------
    scenes
        All that it is to hold.
    folder
        Where it will be; paths of scenes are relative to it.
    old
        The baseline that it replaces; its rates are kept if there are no newer ones and the thresholds are
        the same.
    n_jobs, on_progress
        As in `comparison.regression.check.gate`.

    Raises
    ------
    BaselineError
        If the thresholds changed without newly measured rates, or the file of the rates cannot be read.
    RunError, SceneError
        If a run does not succeed.
    """
    rates = _rates(folder / RATES, old)
    planned = [
        (
            scene,
            which,
            gated,
            dict([*family(gated.scene, gated.model), *neighbours(gated, which[1], RECORDED).items()]),
        )
        for scene in scenes
        for which, gated in gated_runs(scene).items()
    ]
    outcomes = iter(run_all([job for *_, jobs in planned for job in jobs.values()], n_jobs, on_progress))
    records: dict[str, dict[str, dict[str, RunRecord]]] = {}
    for scene, (model, tier), gated, jobs in planned:
        tables = {kind: _table(job, next(outcomes)) for kind, job in jobs.items()}
        others = [tables.pop(kind) for kind in neighbours(gated, tier, RECORDED)]
        runs = Runs(refinement=refinement(model, gated.scene), **tables)
        by_model = records.setdefault(scene.name, {})
        by_model.setdefault(model, {})[tier] = record(runs, gated, tier, others)
    return Baseline(
        platform=platform_name(),
        versions=versions(),
        thresholds=thresholds_record(),
        detection=rates,
        scenes={
            scene.name: SceneRecord.model_validate(
                {"source": source(scene, folder), "hash": physics_hash(scene), **records[scene.name]}
            )
            for scene in scenes
        },
    )


def _table(job: Job, outcome: Outcome) -> Table:
    """Return the run's table.

    Raises
    ------
    SceneError
        If the model refuses the scene.
    RunError
        If the run did not succeed.
    """
    error = RunError(outcome, job)
    if outcome.status == "bad input":
        raise SceneError(str(error))
    if outcome.table is None:
        raise error
    return outcome.table


def _rates(path: Path, old: Baseline | None) -> Detection | None:
    """Find the rates that belong to the present thresholds."""
    if path.is_file():
        try:
            measured = _Measured.model_validate(json.loads(path.read_text("utf-8")))
        except ValidationError as error:
            raise BaselineError(f"{path}: {explain(error)}") from error
        except ValueError as error:
            raise BaselineError(f"{path}: is not JSON text: {error}") from error
        if measured.thresholds != thresholds_record():
            raise BaselineError(f"{path}: was measured with other thresholds than those of thresholds.toml")
        return Detection(false_alarms=measured.false_alarms, detected=measured.detected)
    if old is None or old.detection is None:
        return None
    if old.thresholds != thresholds_record():
        raise BaselineError(f"{path}: is required, with newly measured rates, since thresholds.toml changed")
    return old.detection
