"""One run of a sweep as a task and as a row."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import pandas as pd

from comparison.execution.run import Progress, run_one
from comparison.execution.store import Row
from comparison.execution.tasks import Task
from comparison.scene import Scene, digest
from comparison.studies.sweep.outputs import measure, needs_ideal
from comparison.studies.sweep.points import Point

IDEAL: Point = {"joints.slider": "ideal", "joints.crank_pin": "ideal", "output.groups": ["accelerations"]}


@dataclass(frozen=True)
class SweepRun(Task):
    """A run: the base scene with a point's values, by a model; what it is asked for."""

    base: Scene
    point: Point
    model: str
    asked: tuple[str, ...]

    @property
    def models(self) -> tuple[str, ...]:
        """Its model, and the reference, which has the ideal mechanism in closed form."""
        return self.model, "reference"


def run_point(task: SweepRun, progress: Progress) -> Row:
    """Run and measure."""
    del progress
    scene = task.base.with_values(task.point)
    run = run_one(scene, task.model)
    # Its closed form is the reference model's, whoever runs the scene: all motion is the drive's.
    ideal = run_one(scene.with_values(IDEAL), "reference") if needs_ideal(task.asked) else None
    return {"values": measure(run, ideal, scene.period, task.asked)}


def result_table(tasks: Sequence[SweepRun], rows: Sequence[Row]) -> pd.DataFrame:
    """Return the sweep's table: number of the point, its values, model, status, message, quantities."""
    points: dict[str, int] = {}
    lines = []
    for task, row in zip(tasks, rows, strict=True):
        number = points.setdefault(digest(task.point), len(points) + 1)
        values = row.get("values", {})
        lines.append(
            {
                "point": number,
                **task.point,
                "model": task.model,
                "status": row["status"],
                "message": row["message"],
            }
            | {name: values.get(name) for name in task.asked}
        )
    return pd.DataFrame(lines)
