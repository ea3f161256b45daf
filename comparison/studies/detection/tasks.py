"""What is found by running models: one side of a comparison, its runs, and what a task is."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from comparison.accuracy.levels import refinement
from comparison.agreement.planned_runs import levels, table_of_family
from comparison.execution.job import Progress, RunError, kernels
from comparison.execution.run import run_one
from comparison.execution.task_order import Kernels
from comparison.execution.task_store import SUCCESS, Task, measure_all, on_processes
from comparison.scene import Scene
from comparison.studies.detection.copies import load_copy
from comparison.verdict.compare import Runs

Found = dict[str, Any]


@dataclass(frozen=True)
class Side:
    """One of the two that are compared: a scene as this model is given it."""

    scene: Scene
    model: str
    engine: str = ""
    """Who runs it, where that is not the model itself but a copy of it with a fault."""

    @property
    def runs_by(self) -> str:
        """Name of the engine."""
        return self.engine or self.model

    @property
    def kernels(self) -> Kernels:
        """Which code is compiled for it."""
        return kernels(self.scene, self.model, self.engine)

    @property
    def cost(self) -> float:
        """Expected time of its five runs, s, roughly."""
        solver = self.scene.data["solver"]["exudyn"]
        if self.model == "reference":
            return 0.2
        if solver["formulation"] == "tree":
            return float(3.0 * self.scene.data["drive"]["cycles"])
        return float(6e-5 * self.scene.duration / solver["step"])


class Comparison(Task):
    """Something that is found by comparing runs of two sides."""

    @property
    @abstractmethod
    def sides(self) -> tuple[Side, ...]:
        """The sides that it runs."""

    @property
    def models(self) -> tuple[str, ...]:
        """The engines of its sides."""
        return tuple(side.runs_by for side in self.sides)

    @property
    def kernels(self) -> frozenset[Kernels]:
        """Which code is compiled for its sides."""
        return frozenset(side.kernels for side in self.sides)

    @abstractmethod
    def find(self) -> Found:
        """Run and judge."""


def find_all(tasks: Sequence[Comparison], n_jobs: int, on_progress: Progress | None) -> list[Found]:
    """Return what the tasks find, in their order; what was found before is not sought again.

    What was found is kept, not the runs: they are thousands. Whatever goes wrong is found as well, since a
    copy with a fault may raise anything.
    """
    rows = measure_all(find, tasks, on_processes(n_jobs), on_progress)
    return [row if row["status"] == SUCCESS else row | refusal(row["message"]) for row in rows]


def find(task: Comparison, progress: Progress) -> Found:
    """Find, in this process."""
    del progress
    return task.find()


def refusal(reason: str) -> Found:
    """Return what is found where there is nothing to compare."""
    return {"verdict": "cannot compare", "reason": reason, "channels": {}, "first": None}


def runs(side: Side) -> Runs:
    """Run one side at all its levels, in this process."""
    if side.engine:
        load_copy(side.engine)
    tables = {}
    for kind, scene in levels(side.scene, side.model).items():
        try:
            tables[kind] = run_one(scene, side.runs_by)
        except RunError as error:
            table = table_of_family(kind, error.outcome)
            if table is None:
                raise
            tables[kind] = table
    return Runs(refinement=refinement(side.model, side.scene), **tables)


def cached_runs(side: Side) -> Runs:
    """Return the runs of a side that many are compared with: this process keeps the last few."""
    key = (side.scene.hash, side.runs_by)
    if key not in _RUNS:
        while len(_RUNS) >= _MOST_RUNS:
            del _RUNS[next(iter(_RUNS))]
        _RUNS[key] = runs(side)
    return _RUNS[key]


_RUNS: dict[tuple[str, str], Runs] = {}
_MOST_RUNS = 8
