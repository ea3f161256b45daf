"""The judge: both models on a scene, as in ``sixbar validate``, one of them with a fault or neither."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from comparison.accuracy.uncertainty import Runs
from comparison.execution.run import VIOLATED, Job, Outcome, Progress, run_here
from comparison.execution.store import Row
from comparison.execution.tasks import SUCCESS, Task, measure_all, on_processes
from comparison.models import MODELS
from comparison.scene import Scene
from comparison.studies.trust.adjudication import adjudicate, breach_words, breaches
from comparison.studies.trust.faults import Fault, load_copy, scenes, spoil_runs
from comparison.tables.table import TableError
from comparison.verdict.linkage import ModelError, linkage_pair
from comparison.verdict.results import SceneComparison, decisive
from comparison.verdict.validate import Case, unusable
from comparison.words.differences import confirmation
from comparison.words.verdicts import scene_reason

DETECTIONS = ("differ", "cannot compare")  # tables that cannot be compared are wrong
LIMIT = 3600.0  # s after which a scene that hangs is stopped
_CAPACITY = 200  # runs that a process keeps: those of a model without a fault are compared with many
_runs: dict[tuple[str, str], Outcome] = {}


def measure_task(task: "Comparison", progress: Progress) -> Row:
    """Run and judge both models in this process."""
    progress(0.0)
    return task.row()


def measure_tasks(
    tasks: Sequence["Comparison"], n_jobs: int, on_progress: Progress | None = None
) -> list[Row]:
    """Return a row for each task: also for one that failed, since a copy with a fault may raise anything."""
    rows = measure_all(measure_task, tasks, on_processes(n_jobs, LIMIT), on_progress)
    return [row if row["status"] == SUCCESS else refusal(row["message"], row["status"]) for row in rows]


def refusal(reason: str, status: str = "", errs: str = "") -> Row:
    """Return the row of tables that cannot be compared, with the status of a run that failed."""
    row: Row = {"verdict": "cannot compare", "confirmation": "", "channels": {}, "predictable": None}
    return row | {"failed": status, "errs": errs, "reason": reason}


@dataclass(frozen=True)
class Comparison(Task):
    """Both models on a scene at a tier, where one may have a fault.

    Its row has ``verdict``, ``confirmation`` (the outcome of the ensembles or ""), ``channels`` with a
    verdict each, ``predictable`` (the mean share of the excited channels' samples), ``failed``
    (status of a run without success), ``errs`` (the model that errs, "open", or "" where nothing was to be
    adjudicated) and ``reason``; of a fault in a linkage also ``worth``, |E|/2u (99%) of its effect.
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
        """Return the engine that runs as a model: a copy with the fault, where that is one in its code."""
        return self.fault.engine if self.fault and self.fault.engine and model == self.faulty else model

    def model_scene(self, scene: Scene, model: str) -> Scene:
        """Return the scene that a model runs for this one."""
        return self.fault.faulty_scene(scene) if self.fault and model == self.faulty else scene

    @property
    def case(self) -> Case:
        """The scene as `comparison.verdict.validate` judges it, by runs with the fault."""
        return Case(self.scene, self.tier, MODELS, lambda jobs: [self.outcome(job) for job in jobs])

    def outcome(self, job: Job) -> Outcome:
        """Run a job with the fault of its model; the last runs are kept."""
        scene, engine = self.model_scene(job.scene, job.model), self.engine(job.model)
        key = scene.hash, engine
        if (outcome := _runs.pop(key, None)) is None:
            if engine != job.model:
                load_copy(engine)
            outcome = run_here(scene, engine)
        _runs[key] = outcome
        if len(_runs) > _CAPACITY:
            del _runs[next(iter(_runs))]
        if self.fault is None or outcome.table is None:
            return outcome
        sides = spoil_runs(self.fault.spoil, Runs(outcome.table), Runs(outcome.table))
        return replace(outcome, table=sides[MODELS.index(job.model)].base)

    def judge_linkage(self) -> SceneComparison:
        """Judge a linkage as `comparison.verdict.validate` does, by runs with the fault."""
        return linkage_pair(self.scene, MODELS, lambda jobs: [self.outcome(job) for job in jobs]).judge()[0]

    def linkage_row(self) -> Row:
        """Judge a linkage; no model is called wrong, since all further opinions are of the press."""
        try:
            row = summary(self.judge_linkage())
            base = replace(self, fault=None).judge_linkage().channels if self.fault else {}
        except (ModelError, TableError) as error:
            return refusal(str(error), error.outcome.status if isinstance(error, ModelError) else "")
        table = self.outcome(Job(self.scene, self.faulty or MODELS[0])).table
        assert table is not None
        changes = [
            replace(channel, a=table.values(name), b=channel.a if self.faulty == MODELS[0] else channel.b)
            for name, channel in base.items()
        ]
        largest = decisive(changes)
        return row | {"worth": 0.0 if largest is None else largest.ratio}

    def row(self) -> Row:
        """Run the families and judge them; where no fault was seeded, name the model that errs."""
        if self.scene.is_linkage:
            return self.linkage_row()
        case = self.case
        outcomes = dict(zip(case.scene_jobs, case.start(list(case.scene_jobs.values())), strict=True))
        judgement = case.judge(outcomes)
        result = judgement.comparison
        if not judgement.runs:
            key, first = next(iter(unusable(outcomes).items()), (("", ""), Outcome("")))
            return refusal(result.error, first.status, key[0] if first.status == VIOLATED else "")
        row = summary(result)
        if self.fault is not None:
            return row
        if row["verdict"] == "differ":
            assert result.run_scene is not None
            errs, reason = adjudicate(result, tuple(judgement.runs.values()), result.run_scene)
            return row | {"errs": errs, "reason": f"{row['reason']}; {reason}"}
        # Both models locate touches at the tight tier; five bodies do to a step of time only.
        sides = judgement.runs if self.tier == "tight" else {}
        breaches_of = {model: rows for model, side in sides.items() if (rows := breaches(side.base))}
        if breaches_of:
            texts = (f"{model}: {'; '.join(map(breach_words, rows))}" for model, rows in breaches_of.items())
            row |= {"errs": " and ".join(breaches_of), "reason": "; ".join(texts)}
        return row


def summary(result: SceneComparison) -> Row:
    """Return the part of a comparison that the study needs, as JSON holds it."""
    ensembles = result.confirmation
    coverages = [channel.coverage for channel in result.channels.values() if channel.verdict != "unexcited"]
    return {
        "verdict": result.verdict,
        "confirmation": "" if ensembles is None else ensembles.outcome,
        "channels": {name: channel.verdict for name, channel in result.channels.items()},
        "predictable": sum(coverages) / len(coverages) if coverages else None,
        "failed": "",
        "errs": "",
        "reason": confirmation(result) or ("" if result.verdict == "agree" else scene_reason(result)),
    }


def shows_fault(fault: Fault, row: Row) -> bool:
    """Return True if the row of a comparison with a fault shows it."""
    if fault.unexcited:
        return bool(row["channels"].get(fault.unexcited) == "unexcited")
    return row["verdict"] in DETECTIONS


def trials(faults: Sequence[Fault]) -> list[tuple[Comparison, Fault]]:
    """Return the comparisons with each fault, at the tiers and in the models where it is looked for."""
    return [
        (Comparison(scenes(tier)[fault.scene], tier, fault, model), fault)
        for fault in faults
        for model, tier in fault.places
    ]
