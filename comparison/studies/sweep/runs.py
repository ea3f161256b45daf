"""One run of a sweep as a task and as a row."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache

import pandas as pd

from comparison.ledger import Row
from comparison.machine import platform_name
from comparison.run import RunError, runner
from comparison.scene import Scene, SceneError, digest
from comparison.sources import sources
from comparison.studies.sweep.outputs import measure, needs_ideal
from comparison.studies.sweep.points import Point

IDEAL: Point = {"joints.slider": "ideal", "joints.crank_pin": "ideal", "output.groups": ["accelerations"]}
_SOURCES = (
    "check.py",
    "run.py",
    "table.py",
    "studies/errors.py",
    "studies/sweep/outputs.py",
    "studies/sweep/runs.py",
)
_runner = cache(runner)


@dataclass(frozen=True)
class Task:
    """A run: the base scene with a point's values, by a model; what it is asked for."""

    base: Scene
    point: Point
    model: str
    asked: tuple[str, ...]

    def key(self, fingerprints: Mapping[str, str]) -> str:
        """Hash of all that can change the row; the fingerprints are the models', the ideal's among them."""
        return digest(
            {
                "base": self.base.hash,
                "point": self.point,
                "model": [self.model, fingerprints[self.model], fingerprints["reference"]],
                "asked": self.asked,
                "sources": sources(*_SOURCES),
                "machine": platform_name(),
            }
        )


def attempt(task: Task, progress: Callable[[float], None]) -> Row:
    """Run and measure; whatever goes wrong becomes the row's status and message."""
    del progress
    try:
        scene = task.base.with_values(task.point)
        run = _runner(task.model)(scene)
        # Its closed form is the reference model's, whoever runs the scene: all motion is the drive's.
        ideal = _runner("reference")(scene.with_values(IDEAL)) if needs_ideal(task.asked) else None
        values = measure(run, ideal, scene.period, task.asked)
    except RunError as error:
        return {"status": error.outcome.status, "message": error.outcome.message}
    except SceneError as error:
        return {"status": "bad input", "message": str(error)}
    except Exception as error:
        return {"status": "crashed", "message": " ".join(f"{type(error).__name__}: {error}".split())}
    return {"status": "success", "message": "", "values": values}


def result_table(tasks: Sequence[Task], rows: Sequence[Row]) -> pd.DataFrame:
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
