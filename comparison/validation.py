"""The main job: scenes by two models, each with its finer run and its twin, compared."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from comparison.accuracy import coarser, finer, refinement, solver_values
from comparison.compare import Runs, compare
from comparison.run import MODELS, Job, Outcome, Progress, describe, run_all
from comparison.scene import Scene
from comparison.table import TableError
from comparison.uncertainty import twin
from comparison.verdict import SceneComparison


@dataclass(frozen=True)
class Validation:
    """What came of a scene.

    Attributes
    ----------
    comparison
        Its verdict is "cannot compare", and it holds no channels, where a run did not succeed.
    runs
        Model -> its runs, where all of them succeeded.
    crashed
        Whether a run ended in a way that no input should cause.
    """

    comparison: SceneComparison
    runs: dict[str, Runs]
    crashed: bool = False


def validate(
    scenes: Sequence[Scene],
    *,
    models: tuple[str, str] = MODELS,
    n_jobs: int = 1,
    accuracy: str | float | None = None,
    on_progress: Progress | None = None,
) -> list[Validation]:
    """Run the scenes by two models and compare.

    Parameters
    ----------
    scenes
        What to run.
    models
        Ours, or the names of installed ones. One whose settings hold neither a tolerance nor a step cannot be
        refined: then the scene's ``[compare] tolerance`` decides.
    n_jobs
        Worker processes.
    accuracy
        For both models, see `comparison.accuracy.solver_values`; None: what the scenes say.
    on_progress
        Called with the finished share, 0 to 1.

    Raises
    ------
    AccuracyError
        If the accuracy is out of reach.
    EngineError
        If a model is not known.

    Notes
    -----
    Uses worker processes: a script that calls this needs ``if __name__ == "__main__":``.
    """
    if accuracy is not None:
        scenes = [_at(scene, models, accuracy) for scene in scenes]
    planned = [
        {(model, kind): job for model in models for kind, job in _jobs(scene, model)} for scene in scenes
    ]
    outcomes = iter(run_all([job for jobs in planned for job in jobs.values()], n_jobs, on_progress))
    return [
        _judge(
            scene, jobs, {which: next(outcomes) for which in jobs}, models, _command(scene, models, accuracy)
        )
        for scene, jobs in zip(scenes, planned, strict=True)
    ]


def _at(scene: Scene, models: tuple[str, str], accuracy: str | float) -> Scene:
    values: dict[str, object] = {}
    for model in models:
        formulation = scene.data["solver"].get(model, {}).get("formulation", "auto")
        values |= solver_values(model, accuracy, formulation)
    return scene.with_values(values)


def _command(scene: Scene, models: tuple[str, str], accuracy: str | float | None) -> str:
    return shlex.join(
        ["sixbar", "validate", scene.source]
        + (["--models", ",".join(models)] if models != MODELS else [])
        + (["--accuracy", str(accuracy)] if accuracy is not None else [])
    )


def _jobs(scene: Scene, model: str) -> list[tuple[str, Job]]:
    coarse = coarser(model, scene)
    variants = {
        "base": scene,
        "finer": finer(model, scene),
        "coarser": coarse,
        "twin": None if coarse is None else twin(coarse),
    }
    return [(kind, Job(variant, model)) for kind, variant in variants.items() if variant is not None]


def _judge(
    scene: Scene,
    jobs: dict[tuple[str, str], Job],
    outcomes: dict[tuple[str, str], Outcome],
    models: tuple[str, str],
    command: str,
) -> Validation:
    def refused(reason: str, *, crashed: bool = False) -> Validation:
        return Validation(_no_comparison(scene, reason, models, command), {}, crashed)

    failed = {which: outcome for which, outcome in outcomes.items() if outcome.table is None}
    if failed:
        crashed = any(outcome.status == "crashed" for outcome in failed.values())
        which = next((w for w in failed if failed[w].status == "crashed"), next(iter(failed)))
        return refused(describe(jobs[which], failed[which]), crashed=crashed)
    runs = {
        model: Runs(
            refinement=refinement(model, scene),
            **{
                kind: outcome.table
                for (of, kind), outcome in outcomes.items()
                if of == model and outcome.table
            },
        )
        for model in models
    }
    try:
        comparison = compare(
            runs[models[0]],
            runs[models[1]],
            scene=scene,
            tolerance=scene.tolerance,
            labels=models,
            command=command,
        )
    except TableError as error:
        return refused(f"scene {scene.name!r}: {error}")
    return Validation(comparison, runs)


def _no_comparison(scene: Scene, reason: str, models: tuple[str, str], command: str) -> SceneComparison:
    return SceneComparison(
        name=scene.name,
        title=scene.title,
        description=scene.description,
        labels=models,
        verdict="cannot compare",
        reason=reason,
        warnings=scene.warnings,
        time=np.empty(0),
        period=scene.period,
        channels={},
        events=(None, None),
        scene=scene.data,
        command=command,
    )
