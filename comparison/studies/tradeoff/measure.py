"""One setting measured: processor time, work, and the errors of what users read.

One run at a time: timings of runs side by side would be those of a busy machine.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from comparison.execution.ledger import Row
from comparison.execution.run import Progress, RunError, run_one, runner
from comparison.execution.task_store import Task, measure_all, on_processes
from comparison.scene import Scene, SceneError, load_scene
from comparison.studies.tradeoff.methods import LOOSE, METHODS, SCENES, TURNS, Method
from comparison.tables.table import Table, TableError

TRUTH = 1e-14
"""Tolerance of the run that counts as exact: a hundredth of the smallest that is measured."""
ROUNDS, BUSY, LONG = 3, 0.5, 3.0
"""The least time of at least so many runs counts, of more while they take less than so many seconds together;
a run of more than the last is measured once."""
WARM = 0.02
"""Turns of the run before, in which kernels are compiled."""
QUANTITIES = {
    "slider_x": ("largest error of x", "m"),
    "slider_y_error": ("error of the largest deviation of y from the ideal mechanism", ""),
    "impulse": ("error of the sum of all contacts' impulses", ""),
    "peak_force": ("error of the largest contact force", ""),
    "crank_torque": ("largest error of the crank's torque, over its range", ""),
}
"""What errors are measured of, and the unit; without one: relative."""


@dataclass(frozen=True)
class Setting(Task):
    """A method at one of its settings on one of its scenes."""

    method: Method
    name: str
    setting: float

    @property
    def scene(self) -> Scene:
        """What is run."""
        return self.method.scene(self.name, self.setting)

    @property
    def identity(self) -> dict[str, Any]:
        """Scene and model."""
        return {"scene": self.scene.hash, "model": self.method.model, "name": self.name}

    @property
    def models(self) -> tuple[str, ...]:
        """Its model, and the reference, whose run counts as exact."""
        return self.method.model, "reference"


def measured(on_progress: Progress | None, methods: tuple[Method, ...] = METHODS) -> list[Row]:
    """Measure every method at every setting on its scenes."""
    asked = [
        Setting(method, name, setting)
        for method in methods
        for name in method.scenes
        for setting in method.settings
    ]
    rows = measure_all(measure, asked, on_processes(1), on_progress)
    return [
        row | {"method": of.method.name, "model": of.method.model, "scene": of.name, "setting": of.setting}
        for of, row in zip(asked, rows, strict=True)
    ]


def measure(task: Setting, progress: Progress) -> Row:
    """Run a scene some times and return status, the least time, the work and the errors."""
    del progress
    try:
        seconds, table = timed(task.scene, task.method.model)
    except (RunError, SceneError, TableError) as error:
        return {"status": str(error), "seconds": None, "evaluations": None, "errors": {}}
    counters = table.provenance["counters"]
    return {
        "seconds": seconds,
        "evaluations": counters.get("rhs", counters.get("newton_iterations")),
        "errors": errors(table, task.name),
    }


def timed(scene: Scene, model: str) -> tuple[float, Table]:
    """Return the least processor time of some runs (`ROUNDS`), s, and a result; errors as of `run_one`."""
    run = runner(model)
    run(scene.with_values({"drive.cycles": WARM}))
    times: list[float] = []
    while len(times) < ROUNDS or sum(times) < BUSY:
        before = time.process_time()
        table = run(scene)
        times.append(time.process_time() - before)
        if times[0] > LONG:
            break
    return min(times), table


def errors(table: Table, name: str) -> dict[str, float]:
    """Return the errors of a run of one of the scenes, by the names of `QUANTITIES`."""
    exact = truth(name)
    if name not in LOOSE:
        torque = exact.values("crank_torque")
        error = np.abs(table.values("crank_torque") - torque).max() / np.ptp(torque)
        return {"crank_torque": float(error)}
    assert table.events is not None
    assert exact.events is not None
    ideal = _ideal(name).values("slider_y")
    deviation, right = (np.abs(of.values("slider_y") - ideal).max() for of in (table, exact))
    found = {
        "slider_x": float(np.abs(table.values("slider_x") - exact.values("slider_x")).max()),
        "slider_y_error": float(abs(deviation / right - 1.0)),
    }
    for quantity, column, of in (("impulse", "impulse", np.sum), ("peak_force", "peak_force", np.max)):
        value, wanted = (float(of(events[column].to_numpy(float))) for events in (table.events, exact.events))
        found[quantity] = abs(value / wanted - 1.0)
    return found


@cache
def truth(name: str) -> Table:
    """Return the run of a scene that counts as exact; of the ideal mechanism the closed form."""
    return run_one(Method("", "reference", ()).scene(name, TRUTH), "reference")


@cache
def confirmation(name: str) -> float:
    """Return how far the other model's most accurate run is from `truth`, m of x."""
    other = Method("", "exudyn", (), {"solver.exudyn.formulation": "tree"}).scene(name, 1e-12)
    return float(np.abs(run_one(other, "exudyn").values("slider_x") - truth(name).values("slider_x")).max())


@cache
def _ideal(name: str) -> Table:
    values = SCENES[name] | {"drive.cycles": TURNS, "joints.slider": "ideal", "output.groups": []}
    return run_one(load_scene(name, values), "reference")
