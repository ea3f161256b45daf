"""Runs of scenes by models in worker processes; the only module that starts a model."""

from __future__ import annotations

import traceback
from collections.abc import Generator, Sequence
from contextlib import closing
from copy import deepcopy
from dataclasses import replace
from typing import Any

from comparison.engines.registry import fingerprint, load
from comparison.execution.cache import fetch, keep, run_key
from comparison.execution.job import Job, Outcome, Progress, successful
from comparison.execution.task_order import execution_order
from comparison.execution.worker_process import Share
from comparison.execution.workers import Died, work
from comparison.scene import Scene
from comparison.tables.channels import expected
from comparison.tables.result import Result
from comparison.tables.table import Table, TableError, check


def run_one(scene: Scene, model: str, progress: Progress | None = None) -> Table:
    """Run one scene by one model in this process, without the cache.

    Parameters
    ----------
    scene
        What to run.
    model
        ``"reference"``, ``"exudyn"`` or the name of an installed one.
    progress
        Called with the finished share, 0 to 1.

    Raises
    ------
    SceneError
        If the model refuses the scene, or cannot be imported.
    RunError
        If the run does not succeed.
    """
    job = Job(scene, model)
    return successful(_outcome_of_scene(_attempt(job, progress), scene), job)


def run_uncached(job: Job, on_progress: Progress | None = None) -> Outcome:
    """Run one job without the cache: the reference in this process, any other model in a worker.

    The reference has no code of its own that could end its process, and a second interpreter takes longer to
    start than most of its runs. A model that is unknown or cannot be imported is "bad input".
    """
    if job.model == "reference":
        return _outcome_of_scene(_attempt(job, on_progress), job.scene)
    with closing(work(_attempt, [("", job)], 1)) as events:
        for _, event in events:
            if isinstance(event, Outcome):
                return _outcome_of_scene(event, job.scene)
            if isinstance(event, Died):
                return Outcome("crashed", event.words)
            if on_progress:
                on_progress(event.value)
    raise AssertionError("a worker's last event is an outcome or its death")


def run_all(
    jobs: Sequence[Job],
    n_jobs: int,
    on_progress: Progress | None = None,
) -> list[Outcome]:
    """Run many scenes, equal ones once; cached runs are used, and each successful one is cached as it ends.

    Parameters
    ----------
    jobs
        What to run.
    n_jobs
        Number of parallel worker processes; 0: all in this process, for the reference, see `run_uncached`.
    on_progress
        Called with the finished share of the expected work, 0 to 1.

    Returns
    -------
    list of Outcome
        In the order of ``jobs``.

    Raises
    ------
    EngineError
        If a model is unknown. One that cannot be imported is "bad input".

    Notes
    -----
    Workers are spawned: a script that calls this needs the usual ``if __name__ == "__main__":``.
    """
    prints = {model: fingerprint(model) for model in {job.model for job in jobs}}
    keys = [run_key(job.scene, job.model, prints[job.model]) for job in jobs]
    todo = dict(zip(keys, jobs, strict=True))
    outcomes: dict[str, Outcome] = {}
    for key, job in todo.items():
        kept = fetch(key, *_demands(job))
        if kept is not None:
            outcomes[key] = Outcome("success", table=kept)
    shares = {key: float(key in outcomes) for key in todo}
    total = sum(job.cost for job in todo.values())

    def report(key: str, share: float) -> None:
        shares[key] = share
        if on_progress:
            on_progress(sum(todo[key].cost * share for key, share in shares.items()) / total)

    waiting = execution_order({key: job for key, job in todo.items() if key not in outcomes})
    tasks = [(key, todo[key]) for key in waiting]
    kinds = {key: job.kernels for key, job in tasks}
    with closing(work(_attempt, tasks, n_jobs, kernels=kinds) if n_jobs else _in_turn(tasks)) as events:
        for key, event in events:
            if isinstance(event, Share):
                report(key, event.value)
                continue
            if isinstance(event, Died):
                outcomes[key] = Outcome("crashed", event.words)
            else:
                outcomes[key] = event
                if event.table is not None:
                    keep(key, event.table)
            report(key, 1.0)
    return [_outcome_of_scene(outcomes[key], job.scene) for key, job in zip(keys, jobs, strict=True)]


def _in_turn(tasks: Sequence[tuple[str, Job]]) -> Generator[tuple[str, Outcome]]:
    """Run jobs one after the other in this process."""
    for key, job in tasks:
        yield key, _attempt(job, None)


def _attempt(job: Job, progress: Progress | None) -> Outcome:
    """Run and check; any exception of a model becomes an outcome."""
    try:
        result = _simulate(job.model, job.scene.data, progress)
        table = Table.from_result(result)
        if result.status != "success":
            return Outcome(result.status, result.remedy, partial=table)
        check(table, *_demands(job), name=f"the {job.model} run")
    except TableError as error:
        return Outcome("unusable", str(error))
    except ValueError as error:
        return Outcome("bad input", " ".join(str(error).split()))
    except Exception as error:
        message = " ".join(f"{type(error).__name__}: {error}".split())
        return Outcome("crashed", message, traceback=traceback.format_exc())
    return Outcome("success", table=table)


def _simulate(model: str, scene: dict[str, Any], progress: Progress | None) -> Result:
    """Start a model; imported here, so that reading tables and scenes requires none."""
    # A copy: modifications of the scene by a model must not enter the table's record.
    result: Result = load(model)(deepcopy(scene), progress=progress)
    return result


def _demands(job: Job) -> tuple[list[str], tuple[float, float]]:
    return expected(job.scene.data), (0.0, job.scene.duration)


def _outcome_of_scene(outcome: Outcome, scene: Scene) -> Outcome:
    table, partial = (part and _of_scene(part, scene) for part in (outcome.table, outcome.partial))
    return replace(outcome, table=table, partial=partial)


def _of_scene(table: Table, scene: Scene) -> Table:
    """Record the complete scene, so that `sixbar compare` finds it beside the table."""
    provenance = {**table.provenance, "scene_hash": scene.hash, "scene": scene.data}
    return replace(table, provenance=provenance)
