"""The runs that give a model's uncertainty, and the refinement of a run until its error is small enough."""

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from enum import StrEnum
from math import inf, log, nan
from typing import Any, NamedTuple

import numpy as np

from comparison.accuracy.levels import (
    NAMES,
    check_accuracy,
    coarser,
    finer,
    forecast,
    metres,
    refinement,
    solver_values,
    thresholds,
    with_declared,
)
from comparison.accuracy.uncertainty import (
    Runs,
    error_on,
    model_uncertainty,
    perturbed_scenes,
    share_within,
    spread,
    window_samples,
)
from comparison.execution.run import VIOLATED, Job, Outcome, Progress, RunError, run_all, table_of
from comparison.models import OURS
from comparison.scene import Scene, SceneError
from comparison.tables.channels import UNCERTAINTY, Array
from comparison.tables.table import Table

CHANNEL = "slider_x"  # whose error an accuracy means
FLOOR = thresholds("tight").coverage  # share of the samples on which an error must be known to count
ENOUGH_COVERAGE = 0.9  # share of the samples that suffices; also the ratio of shares that hardly differ
MOST_LEVELS = 4  # at most: levels of another package's model, and levels coarser than the first

Run = Callable[[Sequence[Scene]], list[Outcome]]


def levels(scene: Scene, model: str) -> dict[str, Scene]:
    """Return the scenes of the runs that give a model's uncertainty, by their names in `Runs`."""
    fine, coarse = finer(model, scene), coarser(model, scene)
    scenes = {"base": scene} | ({} if fine is None else {"finer": fine})
    return scenes if coarse is None else scenes | {"coarser": coarse} | perturbed_scenes(coarse)


def family(scene: Scene, model: str) -> list[tuple[str, Job]]:
    """Return the jobs of a model's family, the runs of `levels`, by their names in `Runs`."""
    return [(kind, Job(level, model)) for kind, level in levels(scene, model).items()]


def families(scene: Scene, models: Sequence[str]) -> dict[tuple[str, str], Job]:
    """Return the jobs of the models' families by model and name."""
    return {(model, kind): job for model in models for kind, job in family(scene, model)}


def usable_table(kind: str, outcome: Outcome) -> Table | None:
    """Return the table of a run by its name in a family; None if there is none to use.

    A coarser run may violate an invariant of its model (measured: the rate of a constraint in one impact at
    4e-6 s, not at the scene's own 2e-6 s): its error widens the uncertainty of the base run.
    """
    coarse = kind not in ("base", "finer")
    return outcome.partial if coarse and outcome.status == VIOLATED else outcome.table


def runs_by_model(
    scene: Scene, models: tuple[str, str], outcomes: dict[tuple[str, str], Outcome]
) -> tuple[Runs, Runs]:
    """Return the runs of both models from the outcomes of their families."""
    tables = {which: usable_table(which[1], outcome) for which, outcome in outcomes.items()}

    def runs(model: str) -> Runs:
        members = {kind: run for (name, kind), run in tables.items() if name == model and run is not None}
        return Runs(refinement=refinement(model, scene), **members)

    return runs(models[0]), runs(models[1])


@dataclass(frozen=True)
class Estimate:
    """Estimated error of slider_x over the time of a run; arrays of shape (n,)."""

    time: Array  # s
    u: Array  # numerical uncertainty, m
    spread: Array  # distance of neighbouring starts, 3 d_t, which no setting reduces, m

    def coverage(self, error: float) -> float:
        """Return the share of samples whose u is at most an error, m: the predictable part."""
        return share_within(self.u, error)

    def until(self, error: float) -> float:
        """Return the time at which u first exceeds an error, m, in s; inf if it never does."""
        return float(self.time[self.u > error].min(initial=inf))

    def error_on(self, share: float) -> float:
        """Return the smallest error that holds on a share of the samples, m."""
        return error_on(self.u, share)


@dataclass(frozen=True)
class Level:
    """A setting that was tried; no estimate where too many of its runs did not succeed."""

    scene: Scene
    outcomes: dict[str, Outcome]  # of its family, by the names in `Runs`
    estimate: Estimate | None

    @property
    def table(self) -> Table | None:
        """Table of the run at this setting; None where that did not succeed."""
        return self.outcomes["base"].table


def try_level(scene: Scene, model: str, run: Run, outcomes_by_hash: dict[str, Outcome]) -> Level:
    """Run the scenes of a setting's family without an outcome by their hash, and estimate the error."""

    def run_scenes(scenes: dict[str, Scene]) -> dict[str, Outcome]:
        new_scenes = {level.hash: level for level in scenes.values() if level.hash not in outcomes_by_hash}
        outcomes_by_hash.update(zip(new_scenes, run(list(new_scenes.values())), strict=True))
        return {kind: outcomes_by_hash[level.hash] for kind, level in scenes.items()}

    outcomes = run_scenes(levels(scene, model))
    if "coarser" in outcomes and outcomes["coarser"].table is None and outcomes["base"].table is not None:
        outcomes = {kind: outcomes[kind] for kind in ("base", "finer") if kind in outcomes}
        outcomes |= run_scenes(perturbed_scenes(scene))
    tables = {kind: outcome.table for kind, outcome in outcomes.items() if outcome.table is not None}
    perturbations = {kind for kind in outcomes if kind.endswith("perturbed")}
    if not {"base", "finer"} <= tables.keys() or (perturbations and not perturbations & tables.keys()):
        return Level(scene, outcomes, None)
    runs = Runs(refinement=refinement(model, scene), **tables)
    time = runs.base.time
    u = model_uncertainty(runs, CHANNEL, scene.period)
    assert u is not None
    half_width = window_samples(scene.period, float(time[-1] - time[0]) / (time.size - 1))
    perturbed = [run.values(CHANNEL) for run in runs.perturbed_runs]
    parting = spread(runs.original.values(CHANNEL), perturbed, half_width)
    return Level(scene, outcomes, Estimate(time, u, parting))


def settings(scene: Scene, model: str, accuracy: str | float | None) -> Iterator[Scene]:
    """Yield the scene at the settings to try, from the coarsest that is expected to suffice to ``strict``.

    Another package's model begins with the scene's own. Raises `AccuracyError` for an unknown accuracy.
    """
    if accuracy is None:
        yield scene
    elif accuracy in NAMES:
        yield scene.variant(solver_values(model, str(accuracy), scene))
    elif model in OURS:
        error = metres(accuracy)
        (key,) = solver_values(model, "strict", scene)
        named_settings: list[Any] = [solver_values(model, name, scene)[key] for name in NAMES]
        bounds = [forecast(scene.variant({key: each}), model).error for each in named_settings]
        setting, (factor, _) = named_settings[0], refinement(model, scene)
        while setting > named_settings[-1] * (1 + 1e-9):
            # Between the names the error goes with a power of the setting.
            if np.interp(log(setting), np.log(named_settings[::-1]), np.log(bounds[::-1])) <= log(error):
                error = inf  # all finer ones follow
                yield scene.variant({key: setting})
            setting = float(f"{setting / factor:.12g}")
        yield scene.variant({key: named_settings[-1]})
    else:
        metres(accuracy)
        level: Scene | None = scene
        for _ in range(MOST_LEVELS):
            if level is not None:
                yield level
                level = finer(model, level)


class Cost(NamedTuple):
    """Expected cost of the first setting with the runs that estimate its error."""

    scene: Scene
    model: str
    further: int  # runs besides the one at this setting
    seconds: float  # processor time of all; nan where not recorded
    refines: bool  # finer settings are tried where this one does not suffice


def expected_cost(scene: Scene, model: str, accuracy: str | float | None) -> Cost:
    """Return the expected cost of the first setting of `accurate_run`; raises as `settings`."""
    first = next(settings(scene, model, accuracy))
    scenes = levels(first, model).values()
    seconds = sum(forecast(level, model).seconds for level in scenes)
    return Cost(first, model, len(scenes) - 1, seconds, accuracy is not None and accuracy not in NAMES)


class Limit(StrEnum):
    """Reason why a wanted error is not reached."""

    DIVERGENCE = "neighbouring trajectories diverge"
    FAILURE = "finer settings have no result"
    FINEST = "the finest setting errs more"
    UNKNOWN = "no estimate"


@dataclass(frozen=True)
class AccurateRun:
    """A run with an estimate of its error."""

    model: str
    wanted: float | None  # error of slider_x, m; None for a named setting, or the scene's own
    level: Level  # the setting that was taken
    table: Table  # with the outcome in its provenance under "accuracy"
    tried: tuple[Level, ...]  # in the order of the attempts
    failure: Outcome | None  # of a run at the finest setting tried, if it did not succeed
    runs: int  # number of them, with cached ones
    seconds: float  # wall time

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
        """True if the wanted error holds on enough samples; without one, if the error is known."""
        return self.estimate is not None if self.wanted is None else self.coverage >= FLOOR

    @property
    def limit(self) -> Limit | None:
        """Reason why the wanted error is not reached; None if it is kept."""
        if self.kept:
            return None
        if self.estimate is None or self.wanted is None:
            return Limit.UNKNOWN
        if share_within(self.estimate.spread, self.wanted) < FLOOR:
            return Limit.DIVERGENCE
        return Limit.FINEST if self.failure is None else Limit.FAILURE

    def with_uncertainty(self) -> Table:
        """Return the table with the estimated error, m, as ``slider_x_u`` beside slider_x; nan if unknown."""
        frame = self.table.frame.copy()
        u = nan if self.estimate is None else self.estimate.u
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
    accuracy
        Wanted error of slider_x on the predictable part, m, also as text; or ``"draft"``, ``"standard"``,
        ``"strict"``: that setting with its estimate, without refinement; None: the scene's own setting.
    run
        Runs scenes by the model; default: `comparison.execution.run.run_all`, which caches them.
    n_jobs
        Worker processes of that, for other models than the reference: a script that calls this needs the
        usual ``if __name__ == "__main__":``.
    on_progress
        Called with the finished share of each family of runs, 0 to 1.

    Raises
    ------
    AccuracyError
        If the accuracy is neither a name nor a positive number, or a name for a model without names.
    SceneError
        If the model refuses the scene.
    RunError
        If no setting has a result.
    """
    start_time = time.perf_counter()
    scene = with_declared(scene, [model])
    error = None if accuracy is None or accuracy in NAMES else metres(accuracy)
    outcomes: dict[str, Outcome] = {}
    trials: list[Level] = []

    def run_by_default(scenes: Sequence[Scene]) -> list[Outcome]:
        jobs = [Job(level, model) for level in scenes]
        return run_all(jobs, 0 if model == "reference" else n_jobs, on_progress)

    def coverage(level: Level) -> float:
        if level.estimate is None:
            return -1.0
        return 1.0 if error is None else level.estimate.coverage(error)

    def attempt(level: Scene) -> float:
        trials.append(try_level(level, model, run or run_by_default, outcomes))
        return coverage(trials[-1])

    steps, before = list(settings(scene, model, accuracy)), -1.0
    while steps:
        now = attempt(steps.pop(0))
        # Without an estimate though the run has a result, it is the finer one that has none.
        if now >= ENOUGH_COVERAGE or (now < 0.0 and trials[-1].table is not None):
            break
        if before >= FLOOR and 0.0 <= ENOUGH_COVERAGE * now <= before:  # hardly more than before
            steps = steps[-1:]
        before = now
    results = [trials[-1].outcomes[kind] for kind in ("base", "finer") if kind in trials[-1].outcomes]
    failure = next((outcome for outcome in results if outcome.table is None), None)
    coarser_scene = coarser(model, trials[0].scene)
    for _ in range(MOST_LEVELS):
        if coarser_scene and all(level.estimate is None for level in trials):
            attempt(coarser_scene)
            coarser_scene = coarser(model, coarser_scene)

    def merit(level: Level) -> tuple[float, float]:
        """Return the predictable part, then the negative error, or 1 for a result without one."""
        rank = float(level.table is not None) if level.estimate is None else -level.estimate.error_on(FLOOR)
        return coverage(level), rank

    best = max(trials, key=merit)
    table = table_of(best.outcomes["base"], Job(best.scene, model))
    seconds = time.perf_counter() - start_time
    result = AccurateRun(model, error, best, table, tuple(trials), failure, len(outcomes), seconds)
    # Lengths in m, times in s
    record: dict[str, object] = {
        "wanted_m": error,
        "kept": result.kept,
        "limit": result.limit,
        "from": "runs on this scene",
        "runs": result.runs,
    }
    if (estimate := best.estimate) is not None:
        record["estimated_m"] = {f"{share:g}": estimate.error_on(share) for share in (FLOOR, 0.5, 0.9, 1.0)}
        if error is not None:
            until = estimate.until(error)
            record |= {"coverage": result.coverage, "until_s": None if until == inf else until}
    return replace(result, table=replace(table, provenance={**table.provenance, "accuracy": record}))


def chosen_settings(
    model: str, accuracy: str | float, scene: Scene, start: Callable[[Sequence[Job]], list[Outcome]]
) -> dict[str, object]:
    """Return a built-in model's solver settings for an accuracy, by dotted keys; metres are refined to.

    Where no setting has a result it is ``strict``, whose run reports why. Raises as `check_accuracy`.
    """
    check_accuracy(model, accuracy)
    if accuracy in NAMES:
        return solver_values(model, str(accuracy), scene)

    def run(scenes: Sequence[Scene]) -> list[Outcome]:
        return start([Job(level, model) for level in scenes])

    values = solver_values(model, "strict", scene)
    with suppress(RunError, SceneError):
        solver = accurate_run(scene, model, accuracy, run=run).level.scene.data["solver"][model]
        values = {key: solver[key.rpartition(".")[2]] for key in values}
    return values
