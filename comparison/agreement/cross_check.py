"""The main job: run scenes by two models at both tiers, with refined and perturbed runs, and compare them.

A verdict "differ" is confirmed by ensembles, and any but "agree" of five bodies by finer runs
(`comparison.agreement.refine`), once all scenes are judged; where the models agree no run is added.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from comparison.accuracy.levels import solver_values, with_declared
from comparison.accuracy.thresholds import thresholds
from comparison.accuracy.tiers import TIERS, tight
from comparison.agreement.compare import Runs, compare
from comparison.agreement.confirmation import Run
from comparison.agreement.planned_runs import families, ideal_runs, sorted_runs, table_of_family
from comparison.agreement.refine import RunFamilies, settle, without_violation
from comparison.agreement.results import SceneComparison, no_comparison
from comparison.execution.run import Job, Outcome, Progress, describe, run_all
from comparison.models import MODELS
from comparison.reliability.difference import ReliabilityComparison, compare_reliability
from comparison.reliability.ideal import dense_scene
from comparison.scene import Scene
from comparison.tables.table import Table, TableError


@dataclass(frozen=True)
class Validation:
    """Results of a scene.

    Attributes
    ----------
    comparison
        At the standard tier, and in its ``tight`` at the tight one. The verdict is "cannot compare", and
        there are no channels, where a run did not succeed.
    runs
        Model -> its runs at the standard tier, where all of them succeeded.
    crashed
        Whether a run crashed.
    tight_runs
        As ``runs``, at the tight tier; empty where it was not run.
    partial
        Table of the run that a verdict "cannot compare" names, by tier, model and run ("tight exudyn finer"):
        up to where the model stopped, or complete where the run violated an invariant.
    tracebacks
        Of the run that crashed with an exception, by the same names.
    """

    comparison: SceneComparison
    runs: dict[str, Runs]
    crashed: bool = False
    tight_runs: dict[str, Runs] = field(default_factory=dict)
    partial: dict[str, Table] = field(default_factory=dict)
    tracebacks: dict[str, str] = field(default_factory=dict)


def validate(
    scenes: Sequence[Scene],
    *,
    models: tuple[str, str] = MODELS,
    n_jobs: int = 1,
    accuracy: str | float | None = None,
    tiers: Sequence[str] = TIERS,
    on_progress: Progress | None = None,
) -> list[Validation]:
    """Run the scenes by two models and compare.

    Parameters
    ----------
    scenes
        Scenes to run.
    models
        Built-in or installed models. A model with neither a tolerance nor a step in its settings cannot be
        refined: then the scene's ``[compare] tolerance`` decides.
    n_jobs
        Worker processes.
    accuracy
        For both models at the standard tier, see `comparison.accuracy.levels.solver_values`; None: the
        scenes' settings.
    tiers
        "standard", or both; the tight tier is for the built-in models only, see `comparison.accuracy.tiers`.
    on_progress
        Called with the finished share, 0 to 1; again from 0 for each finer level and each ensemble.

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
    planned = []
    for scene in scenes:
        usual = with_declared(scene, models)
        strict = tight(usual, models) if "tight" in tiers else None
        if accuracy is not None:
            usual = _at(usual, models, accuracy)
        command, closer = (
            scene.command("validate", *options(models, of, tiers)) for of in (accuracy, "strict")
        )
        refinable = set(models) <= set(MODELS) and accuracy in (None, "draft", "standard")
        planned.append(_Plan(usual, "standard", models, command, closer if refinable else ""))
        if strict is not None:
            planned.append(_Plan(strict, "tight", models, command))
    jobs = [job for plan in planned for part in plan.parts for job in part.values()]
    outcomes = iter(run_all(jobs, n_jobs, on_progress))
    ran = [[{which: next(outcomes) for which in part} for part in plan.parts] for plan in planned]

    def run(starts: Sequence[Scene], model: str) -> list[Table]:
        members = run_all([Job(start, model) for start in starts], n_jobs, on_progress)
        return [outcome.table for outcome in members if outcome.table is not None]

    def run_families(scene: Scene) -> tuple[Runs, Runs] | None:
        jobs = families(scene, models)
        finer = dict(zip(jobs, run_all(list(jobs.values()), n_jobs, on_progress), strict=True))
        if _failed(finer):
            return None
        runs = sorted_runs(scene, models, finer)
        return runs[models[0]], runs[models[1]]

    results: list[Validation] = []
    for plan, (own, dense, ideal) in zip(planned, ran, strict=True):
        result = _settled(_judge(plan, own), own, plan, run, run_families)
        result = _with_reliability(result, plan, dense, ideal)
        if plan.tier == "standard":
            results.append(result)
        else:
            results[-1] = _with_tight(results[-1], result)
    return results


def _with_tight(usual: Validation, closer: Validation) -> Validation:
    return Validation(
        replace(usual.comparison, tight=closer.comparison),
        usual.runs,
        usual.crashed or closer.crashed,
        closer.runs,
        usual.partial | closer.partial,
        usual.tracebacks | closer.tracebacks,
    )


def _settled(
    result: Validation,
    outcomes: dict[tuple[str, str], Outcome],
    plan: _Plan,
    run: Run,
    run_families: RunFamilies,
) -> Validation:
    """Confirm a difference, withdraw it, or refine the runs until the verdict stands."""
    comparison, scene, level = result.comparison, plan.scene, 0
    if result.runs:
        pair = result.runs[plan.models[0]], result.runs[plan.models[1]]
    else:
        failed = [(model, outcome) for (model, _), outcome in _failed(outcomes).items()]
        again = without_violation(scene, failed, plan.models, run_families) if failed else None
        if again is None:
            return replace(result, comparison=replace(comparison, ran=scene))
        scene, pair, warning = again
        comparison, level = _compare(plan, scene, pair, (warning,)), 1
    settled = settle(
        comparison,
        pair,
        scene=scene,
        models=plan.models,
        run=run,
        run_families=run_families,
        level=level,
    )
    comparison = replace(settled.comparison, ran=settled.scene, closer_command=plan.closer)
    return Validation(comparison, dict(zip(plan.models, settled.runs, strict=True)))


def _compare(
    plan: _Plan, scene: Scene, pair: tuple[Runs, Runs], warnings: tuple[str, ...] = ()
) -> SceneComparison:
    return compare(
        *pair,
        scene=scene,
        tolerance=scene.tolerance,
        labels=plan.models,
        command=plan.command,
        warnings=warnings,
        tier=plan.tier,
    )


class _Plan:
    """A comparison to be made, with its runs."""

    def __init__(
        self, scene: Scene, tier: str, models: tuple[str, str], command: str, closer: str = ""
    ) -> None:
        self.scene, self.tier, self.models, self.command, self.closer = scene, tier, models, command, closer
        self.jobs = families(scene, models)
        self.dense, self.ideals = families(dense_scene(scene), models), ideal_runs(scene, models)
        self.parts = self.jobs, self.dense, self.ideals


def _at(scene: Scene, models: tuple[str, str], accuracy: str | float) -> Scene:
    values: dict[str, object] = {}
    for model in models:
        values |= solver_values(model, accuracy, scene)
    return scene.variant(values)


def options(models: Sequence[str], accuracy: str | float | None, tiers: Sequence[str]) -> list[str]:
    """Return the options by which ``sixbar validate`` does the same as `validate`."""
    return (
        ([] if "tight" in tiers else ["--quick"])
        + (["--models", ",".join(models)] if tuple(models) != MODELS else [])
        + (["--accuracy", str(accuracy)] if accuracy is not None else [])
    )


def _failed(outcomes: dict[tuple[str, str], Outcome]) -> dict[tuple[str, str], Outcome]:
    """Return the outcomes without a table that a family can use."""
    return {which: one for which, one in outcomes.items() if table_of_family(which[1], one) is None}


def _judge(plan: _Plan, outcomes: dict[tuple[str, str], Outcome]) -> Validation:
    scene, models = plan.scene, plan.models

    def refused(reason: str, failed: Job | None = None, **more: Any) -> Validation:
        refusal = no_comparison(scene, reason, labels=models, command=plan.command, tier=plan.tier)
        return Validation(replace(refusal, failed=failed), {}, **more)

    failed = _failed(outcomes)
    if failed:
        crashed = any(outcome.status == "crashed" for outcome in failed.values())
        which = next((w for w in failed if failed[w].status == "crashed"), next(iter(failed)))
        name, outcome, job = " ".join((plan.tier, *which)), failed[which], plan.jobs[which]
        return refused(
            describe(job, outcome),
            failed=None if outcome.status == "bad input" else job,
            crashed=crashed,
            partial={} if outcome.partial is None else {name: outcome.partial},
            tracebacks={name: outcome.traceback} if outcome.traceback else {},
        )
    runs = sorted_runs(scene, models, outcomes)
    try:
        comparison = _compare(plan, scene, (runs[models[0]], runs[models[1]]))
    except TableError as error:
        return refused(f"scene {scene.name!r}: {error}")
    return Validation(comparison, runs)


def _with_reliability(
    result: Validation,
    plan: _Plan,
    dense: dict[tuple[str, str], Outcome],
    ideal: dict[tuple[str, str], Outcome],
) -> Validation:
    """Add the reliability where both models ran; a failed run for it is only reported.

    Not where an installed model does not run the ideal mechanism at all: it refuses it, or lacks channels.
    """
    unable = ("bad input", "unusable")
    if not result.runs or any(
        model not in MODELS and outcome.status in unable for (model, _), outcome in ideal.items()
    ):
        return result
    scene, (a, b) = plan.scene, plan.models
    failed = [
        f"{what}: {describe(jobs[which], outcome)}"
        for what, jobs, outcomes in (
            ("with more samples", plan.dense, dense),
            ("the ideal mechanism", plan.ideals, ideal),
        )
        for which, outcome in _failed(outcomes).items()
    ]
    if failed:
        found = ReliabilityComparison(scene.reliability, missing=failed[0])
    else:
        runs, ideals = (sorted_runs(scene, plan.models, of) for of in (dense, ideal))
        try:
            quantities = compare_reliability(
                (runs[a], runs[b]),
                (ideals[a], ideals[b]),
                scene.period,
                scene.reliability,
                thresholds(plan.tier).k,
            )
            found = ReliabilityComparison(scene.reliability, quantities)
        except TableError as error:
            found = ReliabilityComparison(scene.reliability, missing=str(error))
    return replace(result, comparison=replace(result.comparison, reliability=found))
