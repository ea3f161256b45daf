"""The main job: run scenes by two models at both tiers, with refined and perturbed runs, and compare them.

For three or more models the verdicts of all pairs show the outlier.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import combinations
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field

from comparison.accuracy.levels import TIERS, thresholds, tight, with_declared
from comparison.accuracy.refine import chosen_settings, families, runs_by_model, usable_table
from comparison.accuracy.uncertainty import Runs
from comparison.execution.run import Job, Outcome, Progress, RunError, dense_scene, failure, run_all
from comparison.execution.store import fetch, hash_of, keep
from comparison.models import (
    MODELS,
    EngineError,
    distinct_models,
    fingerprint,
    package_hash,
    platform_name,
    raw_hash,
)
from comparison.reliability.assessment import ReliabilityComparison, compare_reliability, ideal_scenes
from comparison.scene import Scene, SceneError, as_scene
from comparison.tables.arguments import Options
from comparison.tables.table import Table, TableError
from comparison.verdict.channel import Criteria
from comparison.verdict.compare import compare
from comparison.verdict.linkage import ModelError, linkage_pair
from comparison.verdict.refinement import settle, without_violation
from comparison.verdict.results import SceneComparison, no_comparison

Pair = tuple[str, str]
Outcomes = dict[tuple[str, str], Outcome]  # by model and name of the run in its family
Jobs = dict[tuple[str, str], Job]


@dataclass(frozen=True)
class Validation:
    """Results of a scene: the comparison and its runs if all succeeded, else the data of one that did not.

    These are, by tier, model and run ("tight exudyn finer"), the table up to the end of the run, or the
    complete one of a run that violated an invariant.
    """

    comparison: SceneComparison  # at the standard tier; that at the tight one is in its ``tight``
    runs: dict[str, Runs] = field(default_factory=dict)  # by model, at the standard tier
    crashed: bool = False
    partial: dict[str, Table] = field(default_factory=dict)
    tracebacks: dict[str, str] = field(default_factory=dict)


class _Work(Options):
    """Options of `validate` that no other part checks."""

    n_jobs: Annotated[int, Field(ge=0)]
    tiers: Annotated[list[Literal["standard", "tight"]], Field(min_length=1)]


def validate(
    scenes: Scene | str | Path | Iterable[Scene | str | Path],
    *,
    models: str | Sequence[str] = MODELS,
    n_jobs: int = 1,
    accuracy: str | float | None = None,
    tiers: Sequence[str] = TIERS,
    on_progress: Progress | None = None,
) -> list[Validation]:
    """Run the scenes by two models and compare.

    Parameters
    ----------
    scenes
        One or several: shipped names, paths, or what `sixbar.load_scene` returns.
    models
        Two, built-in or installed. A model with neither a tolerance nor a step in its settings cannot be
        refined: then the scene's ``[compare] tolerance`` decides.
    n_jobs
        Worker processes: a script that calls this needs ``if __name__ == "__main__":``. With 0 all runs
        are in this process.
    accuracy
        For both models at the standard tier, as in `comparison.accuracy.refine.accurate_run`; None: the
        scenes' settings.
    tiers
        "standard", or both; the tight tier is for the built-in models only.
    on_progress
        Called with the finished share, 0 to 1; again from 0 for each finer level and each ensemble.

    Returns
    -------
    list of Validation
        One a scene: ``comparison.verdict``, ``comparison.channels``, ``comparison.reliability``; that of the
        tight tier is ``comparison.tight``.

    Raises
    ------
    AccuracyError
        If the accuracy is not valid, or a model is not built in.
    EngineError
        If a model is not known, or there are not two.
    SceneError
        If a scene cannot be read, or there is none.
    TableError
        If the number of processes or the tiers are wrong.

    Examples
    --------
    >>> import sixbar
    >>> (result,) = sixbar.validate("ideal", n_jobs=0, tiers=["standard"])
    >>> result.comparison.verdict, result.comparison.reliability.verdict
    ('agree', 'agree')
    """
    failed = False

    def start(jobs: Sequence[Job]) -> list[Outcome]:
        nonlocal failed
        outcomes = run_all(jobs, n_jobs, on_progress)
        failed |= any(outcome.table is None and outcome.partial is None for outcome in outcomes)
        return outcomes

    sources: Iterable[Any] = [scenes]
    if isinstance(scenes, Iterable) and not isinstance(scenes, str | Mapping):
        sources = scenes
    scene_list = [as_scene(scene) for scene in sources]
    if not scene_list:
        raise SceneError("scenes names none")
    first, second, *others = distinct_models(models)
    if others:
        raise EngineError(f"models {models!r} must be two; sixbar validate takes more, in pairs")
    work: dict[str, Any] = {"n_jobs": n_jobs, "tiers": [tiers] if isinstance(tiers, str) else list(tiers)}
    _Work(**work)
    cases = [case for scene in scene_list for case in _cases(scene, (first, second), accuracy, tiers, start)]
    # All that can change a result
    code = [fingerprint(first, raw_hash), fingerprint(second, raw_hash), package_hash(), platform_name()]
    keys = [
        hash_of([case.scene, case.tier, case.models, case.command, case.closer_command, code])
        for case in cases
    ]
    hits = [fetch(key) for key in keys]
    misses = [case for case, result in zip(cases, hits, strict=True) if result is None]
    outcomes = iter(start([job for case in misses for jobs in case.jobs for job in jobs.values()]))
    results: list[Validation] = []
    for case, key, result in zip(cases, keys, hits, strict=True):
        if result is None:
            result = case.validate(*({name: next(outcomes) for name in jobs} for jobs in case.jobs))
            reliability = result.comparison.reliability
            # A run that left no table may succeed the next time.
            if not (result.comparison.error or failed or (reliability and reliability.missing)):
                keep(key, result)
        if case.tier == "tight":
            standard = results.pop()
            result = Validation(
                replace(standard.comparison, tight=result.comparison),
                standard.runs,
                standard.crashed or result.crashed,
                standard.partial | result.partial,
                standard.tracebacks | result.tracebacks,
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


@dataclass(frozen=True)
class Case:
    """A scene to be compared at one tier."""

    scene: Scene
    tier: str
    models: tuple[str, str]
    start: Callable[[Sequence[Job]], list[Outcome]]
    command: str = ""
    closer_command: str = ""

    @cached_property
    def jobs(self) -> tuple[Jobs, Jobs, Jobs]:
        """Runs of the scene, of other packages' models with the samples of the reliability, and ideal ones.

        Our models run once, for both. Another package's model may lack accelerations that the scene does not
        need, and chooses its times.
        """
        scene_jobs = {key: replace(job, dense=job.model in MODELS) for key, job in self.scene_jobs.items()}
        other_models = [model for model in self.models if model not in MODELS]
        return scene_jobs, families(dense_scene(self.scene), other_models), self.ideal_jobs

    @cached_property
    def ideal_jobs(self) -> Jobs:
        """Runs of the ideal mechanism."""
        return {
            (model, name): Job(scene, model)
            for model in self.models
            for name, scene in ideal_scenes(self.scene, model).items()
        }

    @cached_property
    def scene_jobs(self) -> Jobs:
        """Runs with the samples of the scene."""
        return families(self.scene, self.models)

    def validate(self, outcomes: Outcomes, dense: Outcomes, ideal: Outcomes) -> Validation:
        """Compare the runs of the scene and, from these and the ideal ones, the reliabilities.

        The result has the runs of the standard tier, at the samples of the scene.
        """
        result = self.judge(outcomes)
        if not result.runs:
            return result
        reliability, runs = self.reliability(outcomes | dense, ideal, result.runs), {}
        for model, run in result.runs.items() if self.tier != "tight" else ():
            tables = {kind: replace(table, dense=None) for kind, table in run.tables.items()}
            runs[model] = Runs(**tables, refinement=run.refinement)
        return Validation(replace(result.comparison, reliability=reliability), runs)

    def judge(self, outcomes: Outcomes) -> Validation:
        """Compare the runs of the scene, and settle an open verdict by further runs."""
        scene, models = self.scene, self.models
        warnings: tuple[str, ...] = ()
        if failures := unusable(outcomes):
            items = [(model, outcome) for (model, _), outcome in failures.items()]
            finer = without_violation(scene, items, models, self.run_families)
            if finer is None:
                return self.failure(failures)
            scene, pair, warnings = finer
        else:
            pair = runs_by_model(scene, models, outcomes)
        try:
            comparison = compare(
                *pair,
                scene=scene,
                criteria=Criteria(**scene.compare.model_dump()),
                labels=models,
                warnings=warnings,
                tier=self.tier,
            )
        except TableError as error:
            return Validation(self.refusal(str(error)))
        last = settle(
            replace(comparison, command=self.command, refined=1 if failures else 0, halved=bool(failures)),
            pair,
            scene=scene,
            models=models,
            run=self.run,
            run_families=self.run_families,
        )
        comparison = replace(last.comparison, run_scene=last.scene, closer_command=self.closer_command)
        return Validation(comparison, dict(zip(models, last.runs, strict=True)))

    def run(self, starts: Sequence[Scene], model: str) -> list[Table]:
        """Run an ensemble; return the tables of the runs that succeeded."""
        members = self.start([Job(scene, model) for scene in starts])
        return [outcome.table for outcome in members if outcome.table is not None]

    def run_families(self, scene: Scene) -> tuple[Runs, Runs] | None:
        """Run the families of both models at other settings; None if a run did not succeed."""
        jobs = families(scene, self.models)
        outcomes = dict(zip(jobs, self.start(list(jobs.values())), strict=True))
        return None if unusable(outcomes) else runs_by_model(scene, self.models, outcomes)

    def failure(self, failures: Outcomes, jobs: Jobs | None = None) -> Validation:
        """Report a failed run: of several the first that crashed, if one did."""
        key = next((name for name in failures if failures[name].status == "crashed"), next(iter(failures)))
        name, outcome, job = " ".join((self.tier, *key)), failures[key], (jobs or self.scene_jobs)[key]
        return Validation(
            self.refusal(failure(job.model, outcome), None if outcome.status == "bad input" else job),
            crashed=outcome.status == "crashed",
            partial={} if outcome.partial is None else {name: outcome.partial},
            tracebacks={name: outcome.traceback} if outcome.traceback else {},
        )

    def refusal(self, error: str, job: Job | None = None) -> SceneComparison:
        """Return a comparison with the reason, without channels."""
        return no_comparison(
            self.scene, error, labels=self.models, command=self.command, tier=self.tier, job=job
        )

    def reliability(
        self, dense: Outcomes, ideal: Outcomes, fallback: Mapping[str, Runs]
    ) -> ReliabilityComparison | None:
        """Compare the reliabilities of both models, by the dense runs or else by ``fallback``.

        A failed run is only reported. A linkage without clearance has no reliability.
        """
        settings, statuses = self.scene.reliability, ("bad input", "unusable")
        if not ideal:  # of a linkage
            return ReliabilityComparison(settings) if self.scene.loose else None
        if any(model not in MODELS and outcome.status in statuses for (model, _), outcome in ideal.items()):
            return None
        scene_jobs, other_jobs, ideal_jobs = self.jobs
        for jobs, outcomes in ((scene_jobs | other_jobs, dense), (ideal_jobs, ideal)):
            for key, outcome in unusable(outcomes).items():
                return ReliabilityComparison(settings, missing=RunError(outcome, jobs[key]))
        base = ideal_scenes(self.scene, self.models[0])["base"]  # refined by other settings than the scene
        first, second = self.models
        runs = runs_by_model(self.scene, self.models, dense) if dense else (fallback[first], fallback[second])
        ideals = runs_by_model(base, self.models, ideal)
        try:
            quantities = compare_reliability(
                runs, ideals, self.scene.period, settings, thresholds(self.tier).k
            )
        except TableError as error:
            return ReliabilityComparison(settings, missing=error)
        return ReliabilityComparison(settings, quantities)


class LinkageCase(Case):
    """A linkage to be compared as any two solvers; further runs follow from the first."""

    @cached_property
    def jobs(self) -> tuple[Jobs, Jobs, Jobs]:
        """The ideal runs, if any: the others start when the first runs are read."""
        return {}, {}, self.ideal_jobs

    def judge(self, outcomes: Outcomes) -> Validation:
        """Run both models, and compare them."""
        del outcomes
        try:
            comparison, programs = linkage_pair(self.scene, self.models, self.start).judge()
        except ModelError as error:
            return self.failure({error.key: error.outcome}, {error.key: error.job})
        except TableError as error:
            return Validation(self.refusal(str(error)))
        runs = {model: program.runs for model, program in zip(self.models, programs, strict=True)}
        return Validation(replace(comparison, command=self.command), runs)


def _cases(
    scene: Scene,
    models: tuple[str, str],
    accuracy: str | float | None,
    tiers: Sequence[str],
    start: Callable[[Sequence[Job]], list[Outcome]],
) -> list[Case]:
    """Return the cases of a scene to compare, by tier."""
    standard = with_declared(scene, models)
    if scene.is_linkage:
        if accuracy is not None:
            scene.require_press("an accuracy")
        command = scene.command("validate", *options(models, accuracy, tiers))
        return [LinkageCase(standard, "standard", models, start, command)]
    strict = tight(standard, models) if "tight" in tiers else None
    if accuracy is not None:
        values: dict[str, object] = {}
        for model in models:
            values |= chosen_settings(model, accuracy, standard, start)
        standard = standard.variant(values)
    command, closer = (
        scene.command("validate", *options(models, level, tiers)) for level in (accuracy, "strict")
    )
    refinable = set(models) <= set(MODELS) and accuracy in (None, "draft", "standard")
    cases = [Case(standard, "standard", models, start, command, closer if refinable else "")]
    return cases if strict is None else [*cases, Case(strict, "tight", models, start, command)]


def unusable(outcomes: Outcomes) -> Outcomes:
    """Return the outcomes without a table that a family can use."""
    return {key: outcome for key, outcome in outcomes.items() if usable_table(key[1], outcome) is None}


# ---- all pairs of several models


@dataclass(frozen=True)
class Standing:
    """Position of the models of a scene to each other.

    ``outcome``: "agree", all pairs agree; "outlier", one model differs from all others, which agree; "differ"
    without an outlier; "undecided", a pair is indeterminate; "cannot compare", fewer than two models can be
    compared.
    """

    outcome: str
    outlier: str
    compared: tuple[str, ...]
    left_out: tuple[str, ...]  # those without a comparable other model
    verdicts: Mapping[Pair, str]  # of the pairs of those compared


def pairs(models: Sequence[str]) -> list[Pair]:
    """Return all pairs of the models, in their order."""
    return list(combinations(models, 2))


def standing(models: Sequence[str], verdicts: Mapping[Pair, str]) -> Standing:
    """Judge the verdicts of all `pairs` of three or more models."""
    comparable = {
        model for pair, verdict in verdicts.items() if verdict != "cannot compare" for model in pair
    }
    members = tuple(model for model in models if model in comparable)
    left_out = tuple(model for model in models if model not in comparable)
    by_pair = {pair: verdicts[pair] for pair in pairs(members)}
    outlier, values = "", set(by_pair.values())
    for model in members if len(members) > 2 else ():  # two have no outlier
        if all(verdict == ("differ" if model in pair else "agree") for pair, verdict in by_pair.items()):
            outlier = model
    if not members:
        outcome = "cannot compare"
    elif values == {"agree"}:
        outcome = "agree"
    elif outlier:
        outcome = "outlier"
    else:
        outcome = "differ" if values <= {"agree", "differ"} else "undecided"
    return Standing(outcome, outlier, members, left_out, by_pair)
