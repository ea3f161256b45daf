"""The scenes of the campaign as tasks of worker processes; each row is kept as soon as it is found."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from comparison.execution.job import MODELS, Job, Outcome, Progress, RunError, kernels
from comparison.execution.ledger import Row
from comparison.execution.run import run_one
from comparison.execution.task_order import Kernels
from comparison.execution.task_store import SUCCESS, Task, measure_all, on_processes
from comparison.scene import Scene, SceneError
from comparison.studies.campaign.adjudication import Run
from comparison.studies.campaign.population import Case
from comparison.studies.campaign.stages import examine, nothing_found
from comparison.tables.table import Table
from comparison.verdict.compare import Runs
from comparison.verdict.confirmation import confirm as confirm_by_ensembles
from comparison.verdict.results import SceneComparison

LIMIT = 3600.0
"""s after which a scene is broken off. A model ends each of its runs at a limit of work of its own; this is
for what hangs: ten times what the dearest scene took that came to the last stage."""


@dataclass(frozen=True)
class CaseTask(Task):
    """A case of the population."""

    case: Case
    models = MODELS

    @property
    def cost(self) -> float:
        """Expected time of its runs, s, roughly: of the tree, five where the family is asked for."""
        scene, family = self.case.scene, self.case.family
        # Time grows with the duration of a cycle, which `Job.cost` leaves out.
        return Job(scene, "exudyn").cost * (5.0 if family else 1.0) * (1.0 + scene.period)

    @property
    def kernels(self) -> frozenset[Kernels]:
        """Which code is compiled for it."""
        return frozenset(kernels(self.case.scene, model) for model in MODELS)


def run_cases(cases: Sequence[Case], n_jobs: int, on_progress: Progress | None) -> list[Row]:
    """Examine all cases, but for those that were before; return their rows, as `examine` gives them."""
    tasks = [CaseTask(case) for case in cases]
    rows = measure_all(examine_case, tasks, on_processes(n_jobs, LIMIT), on_progress)
    return [row if row["status"] == SUCCESS else nothing_found(row["message"]) for row in rows]


def examine_case(task: CaseTask, progress: Progress) -> Row:
    """Examine a case in this process."""
    progress(0.0)
    return examine(task.case, run_here, confirmed)


def run_here(scene: Scene, model: str) -> Outcome:
    """Run a scene in this process."""
    try:
        return Outcome("success", table=run_one(scene, model))
    except RunError as error:
        return error.outcome
    except SceneError as error:
        return Outcome("bad input", str(error))


def confirmed(result: SceneComparison, runs: tuple[Runs, Runs], scene: Scene, run: Run) -> SceneComparison:
    """Confirm a verdict "differ" by ensembles that run in this process, one after the other."""

    def tables(scenes: Sequence[Scene], model: str) -> list[Table]:
        outcomes = (run(each, model) for each in scenes)
        return [outcome.table for outcome in outcomes if outcome.table is not None]

    return confirm_by_ensembles(result, runs, scene=scene, models=MODELS, run=tables)
