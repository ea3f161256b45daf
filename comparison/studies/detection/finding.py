"""Comparisons worked off in worker processes; what was found is kept, not the runs: they are thousands."""

from __future__ import annotations

from collections.abc import Sequence

from comparison.execution.run import Progress
from comparison.execution.task_store import SUCCESS, measure_all, on_processes
from comparison.studies.detection.tasks import Comparison, Found, refusal


def find_all(tasks: Sequence[Comparison], n_jobs: int, on_progress: Progress | None) -> list[Found]:
    """Return what the tasks find, in their order; what was found before is not sought again.

    Whatever goes wrong is found as well, since a copy with a fault may raise anything.
    """
    rows = measure_all(find, tasks, on_processes(n_jobs), on_progress)
    return [row if row["status"] == SUCCESS else row | refusal(row["message"]) for row in rows]


def find(task: Comparison, progress: Progress) -> Found:
    """Find, in this process."""
    del progress
    return task.find()
