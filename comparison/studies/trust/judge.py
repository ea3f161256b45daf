"""The judge: both models on a scene, as in ``sixbar validate``, one of them with a fault or neither.

And the search for the least change of a number that it detects.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from comparison.accuracy.refine import levels, runs_by_model, usable_table
from comparison.accuracy.uncertainty import Runs
from comparison.execution.run import VIOLATED, Job, Outcome, Progress, failure
from comparison.execution.store import Row
from comparison.execution.tasks import SUCCESS, Task, measure_all, on_processes
from comparison.models import MODELS
from comparison.scene import Scene
from comparison.studies.trust.adjudication import adjudicate, breach_words, breaches, run_here
from comparison.studies.trust.faults import Fault, load_copy, scenes, spoiled
from comparison.tables.table import Table, TableError
from comparison.verdict.compare import compare
from comparison.verdict.refinement import settle, without_violation
from comparison.verdict.results import SceneComparison
from comparison.words.differences import confirmation
from comparison.words.verdicts import scene_reason

DETECTED = ("differ", "cannot compare")  # where tables cannot be compared something is wrong with them
LIMIT = 3600.0  # s after which a scene that hangs is stopped
LEAST, MOST = 1e-9, 0.1  # relative changes between which the least is sought
HALVINGS = 6  # of the decades between them: 8 / 2^6, so that two changes remain which are 33 % apart
_KEPT = 8  # families that a process keeps, as many are compared with the same one
_families: dict[tuple[str, str], dict[str, Outcome]] = {}
_Outcomes = dict[tuple[str, str], Outcome]  # by model and name of the run in its family


class Measured(Task):
    """A task whose row is that of a method."""

    def row(self) -> Row:
        """Run and measure in this process."""
        raise NotImplementedError


def measure_task(task: Measured, progress: Progress) -> Row:
    """Measure a task."""
    progress(0.0)
    return task.row()


def measure_tasks(tasks: Sequence[Measured], n_jobs: int, on_progress: Progress | None = None) -> list[Row]:
    """Return a row for each task: also for what went wrong, since a copy with a fault may raise anything."""
    rows = measure_all(measure_task, tasks, on_processes(n_jobs, LIMIT), on_progress)
    return [row if row["status"] == SUCCESS else refusal(row["message"], row["status"]) for row in rows]


def refusal(reason: str, failed: str = "", errs: str = "") -> Row:
    """Return the row of what cannot be compared; ``failed`` is the status of the run, if it is one."""
    row: Row = {"verdict": "cannot compare", "confirmation": "", "channels": {}, "predictable": None}
    return row | {"failed": failed, "errs": errs, "reason": reason}


@dataclass(frozen=True)
class Comparison(Measured):
    """Both models on a scene at a tier, where one may have a fault.

    Its row has ``verdict``, ``confirmation`` (the outcome of the ensembles or ""), ``channels`` with a
    verdict each, ``predictable`` (the mean share of the excited channels' samples), ``failed``
    (status of a run without success), ``errs`` (the model that errs, "open", or "" where nothing was to be
    adjudicated) and ``reason``.
    """

    scene: Scene
    tier: str
    fault: Fault | None = None
    faulty: str = ""  # the model with the fault

    @property
    def models(self) -> tuple[str, ...]:
        """The engines of both sides."""
        return tuple(map(self.engine, MODELS))

    @property
    def cost(self) -> float:
        """Expected time of the families, s."""
        return 5.0 * sum(Job(self.scene, model).cost for model in MODELS) * (1.0 + self.scene.period)

    def engine(self, model: str) -> str:
        """Return what runs as a model: a copy of it with the fault, where that is one in its code."""
        return self.fault.engine if self.fault and self.fault.engine and model == self.faulty else model

    def run(self, scene: Scene, model: str) -> Outcome:
        """Run a scene as one of the models, with its fault."""
        engine = self.engine(model)
        if engine != model:
            load_copy(engine)
        return run_here(scene, engine)

    def given(self, scene: Scene, model: str) -> Scene:
        """Return the scene that a model is given for this one."""
        return self.fault.given(scene) if self.fault and model == self.faulty else scene

    def family(self, scene: Scene, model: str) -> dict[str, Outcome]:
        """Run a scene at all levels of a model, up to one that fails; the last few families are kept."""
        given = self.given(scene, model)
        key = given.hash, self.engine(model)
        if (outcomes := _families.pop(key, None)) is None:
            outcomes = {}
            for kind, level in levels(given, model).items():
                outcomes[kind] = self.run(level, model)
                if usable_table(kind, outcomes[kind]) is None:
                    break
        _families[key] = outcomes
        if len(_families) > _KEPT:
            del _families[next(iter(_families))]
        return outcomes

    def outcomes(self, scene: Scene) -> _Outcomes:
        """Run a scene at all levels of both models."""
        return {
            (model, kind): outcome for model in MODELS for kind, outcome in self.family(scene, model).items()
        }

    def spoiled(self, a: Runs, b: Runs) -> tuple[Runs, Runs]:
        """Return the runs with the fault that is one in their tables."""
        return spoiled(self.fault.spoil if self.fault else "", a, b)

    def families(self, scene: Scene) -> tuple[Runs, Runs] | None:
        """Run both families at the settings of a scene; None if a run does not succeed."""
        outcomes = self.outcomes(scene)
        return None if _failed(outcomes) else self.spoiled(*runs_by_model(scene, MODELS, outcomes))

    def ensemble(self, starts: Sequence[Scene], model: str) -> list[Table]:
        """Run scenes by one of the models; the tables of those that succeed."""
        ran = (self.run(self.given(scene, model), model).table for scene in starts)
        both = (self.spoiled(Runs(table), Runs(table)) for table in ran if table is not None)
        return [runs[MODELS.index(model)].base for runs in both]

    def row(self) -> Row:
        """Run the families and judge them; where no fault was seeded, say which model errs."""
        scene, level = self.scene, 0
        outcomes = self.outcomes(scene)
        if failed := _failed(outcomes):
            named = [(model, outcome) for (model, _), outcome in failed.items()]
            finer = without_violation(scene, named, MODELS, self.families)
            if finer is None:
                model, first = named[0]
                errs = model if first.status == VIOLATED else ""
                return refusal(failure(model, first), first.status, errs)
            (scene, runs, _), level = finer, 1
        else:
            runs = self.spoiled(*runs_by_model(scene, MODELS, outcomes))
        try:
            result = compare(*runs, scene=scene, labels=MODELS, tier=self.tier)
        except TableError as error:
            return refusal(str(error))
        settled = settle(
            result,
            runs,
            scene=scene,
            models=MODELS,
            run=self.ensemble,
            run_families=self.families,
            level=level,
        )
        row = summary(settled.comparison)
        if self.fault is not None:
            return row
        if row["verdict"] == "differ":
            errs, why = adjudicate(settled.comparison, settled.runs, settled.scene)
            return row | {"errs": errs, "reason": f"{row['reason']}; {why}"}
        # Both models locate touches at the tight tier; five bodies do to a step of time only.
        own = zip(MODELS, settled.runs if self.tier == "tight" else (), strict=False)
        broken = {model: shown for model, side in own if (shown := breaches(side.base))}
        if broken:
            said = (f"{model}: {'; '.join(map(breach_words, shown))}" for model, shown in broken.items())
            row |= {"errs": " and ".join(broken), "reason": "; ".join(said)}
        return row

    def shows(self) -> bool:
        """Return whether the families alone differ, or cannot be compared."""
        runs = self.families(self.scene)
        try:
            return runs is None or compare(*runs, scene=self.scene, tier=self.tier).verdict == "differ"
        except TableError:
            return True


def _failed(outcomes: _Outcomes) -> _Outcomes:
    return {which: outcome for which, outcome in outcomes.items() if usable_table(which[1], outcome) is None}


def summary(result: SceneComparison) -> Row:
    """Return what the study needs of a comparison, as JSON holds it."""
    made = result.confirmation
    excited = [channel.coverage for channel in result.channels.values() if channel.verdict != "unexcited"]
    return {
        "verdict": result.verdict,
        "confirmation": "" if made is None else made.outcome,
        "channels": {name: channel.verdict for name, channel in result.channels.items()},
        "predictable": sum(excited) / len(excited) if excited else None,
        "failed": "",
        "errs": "",
        "reason": confirmation(result) or ("" if result.verdict == "agree" else scene_reason(result)),
    }


def detected(fault: Fault, row: Row) -> bool:
    """Return whether the row of a comparison with a fault shows it."""
    if fault.unexcited:
        return bool(row["channels"].get(fault.unexcited) == "unexcited")
    return row["verdict"] in DETECTED


@dataclass(frozen=True)
class LeastChange(Measured):
    """The least relative change of one number in one model that the judge detects: by halving the decades.

    Families are compared; the change that they end with is confirmed by ensembles, or else the next larger
    one. Its row has ``change``, None if there is none up to `MOST`.
    """

    scene: Scene
    tier: str
    key: str
    model: str
    halvings: int = HALVINGS
    models = MODELS

    @property
    def cost(self) -> float:
        """Expected time, s."""
        return self.halvings * self.comparison(0.0).cost

    def comparison(self, change: float) -> Comparison:
        """Return the comparison with this relative change."""
        fault = Fault(kind="number", name=self.key, key=self.key, factor=1.0 + change)
        return Comparison(self.scene, self.tier, fault, self.model)

    def row(self) -> Row:
        """Search."""
        low, high = LEAST, MOST
        if not self.comparison(high).shows():
            return {"change": None}
        for _ in range(self.halvings):
            middle = (low * high) ** 0.5
            low, high = (low, middle) if self.comparison(middle).shows() else (middle, high)
        step = float((MOST / LEAST) ** 0.5**self.halvings)
        while self.comparison(high).row()["verdict"] not in DETECTED:
            high *= step
            if high > MOST * step**0.5:
                return {"change": None}
        return {"change": high}


def trials(faults: Sequence[Fault]) -> list[tuple[Comparison, Fault]]:
    """Return the comparisons with each fault, at the tiers and in the models where it is looked for."""
    return [
        (Comparison(scenes(tier)[fault.scene], tier, fault, model), fault)
        for fault in faults
        for model, tier in fault.places
    ]
