"""The main job: run scenes by two models at both tiers, with refined and perturbed runs, and compare them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

from comparison.accuracy.levels import TIERS, solver_values, thresholds, tight, with_declared
from comparison.accuracy.refine import families, sorted_runs, table_of_family
from comparison.accuracy.uncertainty import Runs
from comparison.execution.run import Job, Outcome, Progress, failure, run_all
from comparison.models import MODELS
from comparison.reliability.difference import (
    FailedRun,
    ReliabilityComparison,
    at_own_samples,
    compare_reliability,
    dense_scene,
    ideal_scenes,
)
from comparison.scene import Scene
from comparison.tables.table import Table, TableError
from comparison.verdict.compare import compare
from comparison.verdict.confirmation import Run
from comparison.verdict.refinement import RunFamilies, settle, without_violation
from comparison.verdict.results import SceneComparison, no_comparison

Outcomes = dict[tuple[str, str], Outcome]  # by model and name of the run in its family


@dataclass(frozen=True)
class Validation:
    """Results of a scene: the comparison, its runs if all succeeded, else what there is of one that did not.

    That is, by tier, model and run ("tight exudyn finer"), the table up to where the model stopped or, where
    it violated an invariant, complete.
    """

    comparison: SceneComparison  # at the standard tier; that at the tight one is in its ``tight``
    runs: dict[str, Runs] = field(default_factory=dict)  # by model, at the standard tier
    crashed: bool = False
    partial: dict[str, Table] = field(default_factory=dict)
    tracebacks: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class _Plan:
    """A comparison to be made at one tier."""

    scene: Scene
    tier: str
    models: tuple[str, str]
    command: str
    closer_command: str = ""

    @cached_property
    def jobs(self) -> list[dict[tuple[str, str], Job]]:
        """Runs with the samples of the reliability, those of the ideal mechanism, other models' own.

        Our models run once: the verdict takes its samples from the first. Another package's model may lack
        accelerations that the scene does not ask for, and chooses its times.
        """
        ideal = {
            (model, which): Job(scene, model)
            for model in self.models
            for which, scene in ideal_scenes(self.scene, model).items()
        }
        own = families(self.scene, self.models)
        others = {which: job for which, job in own.items() if which[0] not in MODELS}
        return [families(dense_scene(self.scene), self.models), ideal, others]


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
    models
        Built-in or installed models. A model with neither a tolerance nor a step in its settings cannot be
        refined: then the scene's ``[compare] tolerance`` decides.
    n_jobs
        Worker processes: a script that calls this needs ``if __name__ == "__main__":``.
    accuracy
        For both models at the standard tier, see `comparison.accuracy.levels.solver_values`; None: the
        scenes' settings.
    tiers
        "standard", or both; the tight tier is for the built-in models only.
    on_progress
        Called with the finished share, 0 to 1; again from 0 for each finer level and each ensemble.

    Raises
    ------
    AccuracyError
        If the accuracy is out of reach.
    EngineError
        If a model is not known.
    """

    def run(starts: Sequence[Scene], model: str) -> list[Table]:
        members = run_all([Job(start, model) for start in starts], n_jobs, on_progress)
        return [outcome.table for outcome in members if outcome.table is not None]

    def run_families(scene: Scene) -> tuple[Runs, Runs] | None:
        jobs = families(scene, models)
        outcomes = dict(zip(jobs, run_all(list(jobs.values()), n_jobs, on_progress), strict=True))
        return None if _failed(outcomes) else sorted_runs(scene, models, outcomes)

    plans = [plan for scene in scenes for plan in _plans(scene, models, accuracy, tiers)]
    jobs = [job for plan in plans for part in plan.jobs for job in part.values()]
    outcomes = iter(run_all(jobs, n_jobs, on_progress))
    results: list[Validation] = []
    for plan in plans:
        dense, ideal, others = ({which: next(outcomes) for which in part} for part in plan.jobs)
        own = _at_own_samples(plan, dense) | others
        result = _settled(plan, own, run, run_families)
        if result.runs:
            reliability = _reliability(plan, dense, ideal)
            result = replace(result, comparison=replace(result.comparison, reliability=reliability))
        if plan.tier == "tight":
            usual = results.pop()
            result = Validation(
                replace(usual.comparison, tight=result.comparison),
                usual.runs,
                usual.crashed or result.crashed,
                usual.partial | result.partial,
                usual.tracebacks | result.tracebacks,
            )
        results.append(result)
    return results


def options(models: Sequence[str], accuracy: str | float | None, tiers: Sequence[str]) -> list[str]:
    """Return the options by which ``sixbar validate`` does the same as `validate`."""
    return (
        ([] if "tight" in tiers else ["--quick"])
        + (["--models", ",".join(models)] if tuple(models) != MODELS else [])
        + (["--accuracy", str(accuracy)] if accuracy is not None else [])
    )


def _plans(
    scene: Scene, models: tuple[str, str], accuracy: str | float | None, tiers: Sequence[str]
) -> list[_Plan]:
    """Return the comparisons of a scene, one a tier."""
    usual = with_declared(scene, models)
    strict = tight(usual, models) if "tight" in tiers else None
    if accuracy is not None:
        values: dict[str, object] = {}
        for model in models:
            values |= solver_values(model, accuracy, usual)
        usual = usual.variant(values)
    command, closer = (
        scene.command("validate", *options(models, wanted, tiers)) for wanted in (accuracy, "strict")
    )
    refinable = set(models) <= set(MODELS) and accuracy in (None, "draft", "standard")
    plans = [_Plan(usual, "standard", models, command, closer if refinable else "")]
    return plans if strict is None else [*plans, _Plan(strict, "tight", models, command)]


def _at_own_samples(plan: _Plan, dense: Outcomes) -> Outcomes:
    """Return the runs of our models at the samples of the scene."""
    outcomes = {}
    for which, job in families(plan.scene, plan.models).items():
        if which[0] in MODELS:
            run = dense[which]
            table = run.table and at_own_samples(run.table, job.scene)
            partial = run.partial and at_own_samples(run.partial, job.scene)
            outcomes[which] = replace(run, table=table, partial=partial)
    return outcomes


def _failed(outcomes: Outcomes) -> Outcomes:
    """Return the outcomes without a table that a family can use."""
    return {
        which: outcome for which, outcome in outcomes.items() if table_of_family(which[1], outcome) is None
    }


def _settled(plan: _Plan, outcomes: Outcomes, run: Run, run_families: RunFamilies) -> Validation:
    """Compare the runs; confirm a difference, withdraw it, or refine the runs until the verdict stands."""
    scene, models = plan.scene, plan.models
    warnings: tuple[str, ...] = ()
    if failed := _failed(outcomes):
        of_models = [(model, outcome) for (model, _), outcome in failed.items()]
        finer = without_violation(scene, of_models, models, run_families)
        if finer is None:
            return _failure(plan, failed)
        scene, pair, warnings = finer
    else:
        pair = sorted_runs(scene, models, outcomes)
    try:
        comparison = compare(
            *pair,
            scene=scene,
            tolerance=scene.tolerance,
            time_tolerance=scene.time_tolerance,
            gate=scene.gate,
            labels=models,
            command=plan.command,
            warnings=warnings,
            tier=plan.tier,
        )
    except TableError as error:
        return Validation(_refused(plan, str(error)))
    settled = settle(
        comparison,
        pair,
        scene=scene,
        models=models,
        run=run,
        run_families=run_families,
        level=1 if failed else 0,
    )
    comparison = replace(settled.comparison, ran=settled.scene, closer_command=plan.closer_command)
    return Validation(comparison, dict(zip(models, settled.runs, strict=True)))


def _refused(plan: _Plan, error: str, failed: Job | None = None) -> SceneComparison:
    return no_comparison(
        plan.scene, error, labels=plan.models, command=plan.command, tier=plan.tier, failed=failed
    )


def _failure(plan: _Plan, failed: Outcomes) -> Validation:
    """Report a run that did not succeed: of several the first that crashed, if one did."""
    which = next((name for name in failed if failed[name].status == "crashed"), next(iter(failed)))
    name, outcome = " ".join((plan.tier, *which)), failed[which]
    job = families(plan.scene, plan.models)[which]
    refusal = _refused(plan, failure(job.model, outcome), None if outcome.status == "bad input" else job)
    return Validation(
        refusal,
        crashed=outcome.status == "crashed",
        partial={} if outcome.partial is None else {name: outcome.partial},
        tracebacks={name: outcome.traceback} if outcome.traceback else {},
    )


def _reliability(plan: _Plan, dense: Outcomes, ideal: Outcomes) -> ReliabilityComparison | None:
    """Compare the reliabilities of both models; a failed run for it is only reported."""
    scene = plan.scene
    unable = ("bad input", "unusable")
    if any(model not in MODELS and outcome.status in unable for (model, _), outcome in ideal.items()):
        return None
    for jobs, outcomes in zip(plan.jobs[:2], (dense, ideal), strict=True):
        for which, outcome in _failed(outcomes).items():
            return ReliabilityComparison(scene.reliability, missing=FailedRun(jobs[which], outcome))
    runs, ideals = (sorted_runs(scene, plan.models, outcomes) for outcomes in (dense, ideal))
    limits = thresholds(plan.tier)
    try:
        quantities = compare_reliability(runs, ideals, scene.period, scene.reliability, limits.k)
    except TableError as error:
        return ReliabilityComparison(scene.reliability, missing=error)
    return ReliabilityComparison(scene.reliability, quantities)
