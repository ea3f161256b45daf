"""One run of a cell within a limit of processor time, as a task and as the row that its verdict needs.

The key of a row hashes this module and what it imports: neither cells nor verdicts are here, so that a change
of theirs runs nothing again.
"""

import time
from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass
from functools import cache
from math import cos, isnan, sin, sqrt
from typing import TypeVar

from comparison.execution.run import Progress, RunError, energy_share, run_one, steps_per_contact
from comparison.execution.store import Row
from comparison.execution.tasks import LATE, Task, measure_all, on_processes
from comparison.scene import Scene, load_scene
from comparison.tables.table import Table

BASE = "150rpm-0.2mm"
"""The scene that all cells change, and an ordinary one to compile kernels with."""
LIMIT = 1000.0
"""Processor time of a run, in units of `unit_seconds`: 20 s on the machine of reports/extremes."""
GRACE = 4.0
"""Times its limit, in wall time, after which its process is ended, should it not look at the time."""
WARM = 0.02
"""Cycles of the run before, in which kernels are compiled: not counted."""
Name = TypeVar("Name", bound=Hashable)


class _OutOfTimeError(BaseException):
    """Ends a run at its limit: no exception of the model's, which it might take for one of its own."""


@dataclass(frozen=True)
class CellRun(Task):
    """A scene to be run by a model within so much processor time, in units of `unit_seconds`."""

    scene: Scene
    model: str
    limit: float = LIMIT

    @property
    def models(self) -> tuple[str, ...]:
        """Its model."""
        return (self.model,)


def run_tasks(tasks: Mapping[Name, CellRun], n_jobs: int, on_progress: Progress | None) -> dict[Name, Row]:
    """Run tasks by their names, equal ones once; what ran before is not run again."""
    wall = GRACE * unit_seconds() * max((task.limit for task in tasks.values()), default=LIMIT)
    rows = measure_all(run_cell, list(tasks.values()), on_processes(n_jobs, wall), on_progress)
    return dict(zip(tasks, rows, strict=True))


def run_cell(task: CellRun, progress: Progress) -> Row:
    """Run and measure, also what had been recorded of a run that ended early."""
    solver = task.scene.data["solver"][task.model]
    _compile(task.model, solver["formulation"], solver["method"])
    allowed = task.limit * unit_seconds()
    progress(0.0)
    start = time.process_time()

    def in_time(share: float) -> None:
        if share < 1.0 and time.process_time() > start + allowed:
            raise _OutOfTimeError(share)
        progress(share)

    try:
        row = measure(run_one(task.scene, task.model, in_time), task.scene)
    except RunError as error:
        ended = error.outcome
        row = {"status": ended.status, "message": ended.message}
        if ended.partial is not None:
            row |= measure(ended.partial, task.scene)
    except _OutOfTimeError as end:
        row = {"status": LATE, "message": f"stopped after {task.limit:g} units", "share": end.args[0]}
    return row | {"seconds": time.process_time() - start}


@cache
def _compile(model: str, formulation: str, method: str) -> None:
    """Run a little of an ordinary scene, once a process for each formulation and integrator."""
    solver = {f"solver.{model}.formulation": formulation, f"solver.{model}.method": method}
    run_one(load_scene(BASE, solver | {"drive.cycles": WARM}), model)


def measure(table: Table, scene: Scene) -> Row:
    """Return what is kept of a run, also of one that ended early.

    ``x``: slider_x from the guide's centre line at the samples of the first cycle, m; ``share``: of the time
    that was run; ``energy_share``, ``steps_per_contact``: see `comparison.execution.run`;
    ``constraint_m``: largest violation of a constraint, m; ``contacts``: their number, and
    ``largest_force_N``; ``steps``; ``work``: right-hand sides, or Newton iterations. None for what was not
    asked for or does not apply.
    """
    cycle = scene.data["output"]["samples_per_cycle"] + 1
    counters, events = table.provenance.get("counters", {}), table.events
    count = 0 if events is None else len(events)
    energy, steps = (
        None if isnan(value) else value for value in (energy_share(table), steps_per_contact(table))
    )
    return {
        "x": (table.values("slider_x")[:cycle] - scene.data["mechanism"]["guide_x"]).tolist(),
        "share": float(table.time[-1] / scene.duration) if len(table.time) else 0.0,
        "energy_share": energy,
        "constraint_m": table.provenance.get("constraints", {}).get("position"),
        "contacts": count,
        "largest_force_N": float(events["peak_force"].max()) if events is not None and count else None,
        "steps_per_contact": steps,
        "steps": counters.get("steps"),
        "work": counters.get("rhs", counters.get("newton_iterations")),
    }


# ---- the unit of processor time, for limits that do not depend on the machine

BENCHMARK = "bouncing-mass"
STEPS = 330_000
"""Of four right-hand sides each: 20 ms on the machine of reports/extremes (AMD EPYC 26/2)."""
REPEATS = 7  # the least counts: others are disturbed


@cache
def unit_seconds() -> float:
    """Return the processor time of one unit in this process, s; measured at the first call.

    The benchmark ``bouncing-mass``: a mass between two walls of Hertz's law, by the classical Runge-Kutta
    method. Its arithmetic is like that of the models, and no change of theirs changes it.
    """
    from numba import njit  # imported where it is first needed

    def acceleration(x: float, v: float, t: float) -> float:
        depth, push = abs(x) - 1e-4, 20.0 * cos(15.0 * t) * sin(x + 0.3)
        if depth <= 0.0:
            return push
        side = 1.0 if x > 0.0 else -1.0
        return push - side * 2e10 * depth * sqrt(depth) * (1.0 + 0.1 * side * v)

    pushed = njit(acceleration)

    def motion(steps: int) -> float:
        x, v, t, h = 0.0, 0.1, 0.0, 1e-6
        for _ in range(steps):
            a1 = pushed(x, v, t)
            a2 = pushed(x + 0.5 * h * v, v + 0.5 * h * a1, t + 0.5 * h)
            a3 = pushed(x + 0.5 * h * (v + 0.5 * h * a1), v + 0.5 * h * a2, t + 0.5 * h)
            a4 = pushed(x + h * (v + 0.5 * h * a2), v + h * a3, t + h)
            x += h * (v + h * (a1 + a2 + a3) / 6.0)
            v += h * (a1 + 2.0 * (a2 + a3) + a4) / 6.0
            t += h
        return x

    bounces: Callable[[int], float] = njit(motion)
    bounces(1)
    times = []
    for _ in range(REPEATS):
        start = time.process_time()
        bounces(STEPS)
        times.append(time.process_time() - start)
    return min(times)
