"""A scene timed, and the errors of what users read.

One run at a time: timings of runs side by side would be those of a busy machine.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, partial

import numpy as np

from comparison.execution.run import Job, Progress, RunError, run_all, run_one, successful
from comparison.execution.store import Row
from comparison.execution.tasks import Task
from comparison.reliability.errors import slider_errors
from comparison.scene import Scene, SceneError
from comparison.studies.shared.formulations import MINIMAL, TREE
from comparison.studies.tradeoff.methods import WITH_CLEARANCE, cycle
from comparison.tables.table import Table, TableError

TRUTH = 1e-14
"""Tolerance of the run that counts as exact: a hundredth of the smallest that is measured."""
CONFIRMING = 1e-12
"""Tolerance of the other model's most accurate run."""
LONG = 3.0
"""s; a longer run is measured once."""
WARM = 0.02
"""Cycles of the run before, in which kernels are compiled."""
QUANTITIES = {
    "slider_x": ("maximum error of x", "m"),
    "slider_y_error": ("error of the largest deviation of y from the ideal mechanism", ""),
    "impulse": ("error of the sum of all contacts' impulses", ""),
    "peak_force": ("error of the largest contact force", ""),
    "crank_torque": ("maximum error of the crank torque relative to its range", ""),
}
"""What errors are measured of, and the unit; without one: relative."""


@dataclass(frozen=True)
class Timed(Task):
    """A scene to be timed."""

    model: str
    scene: Scene
    rounds: int
    busy: float
    """The least time counts, of ``rounds`` runs or of as many more as take ``busy`` seconds together."""
    exact: str = ""
    """Name of the scene whose accurate run gives the errors; "": none are measured."""

    @property
    def models(self) -> tuple[str, ...]:
        """Its model, and the reference, whose run counts as exact."""
        return self.model, "reference"


def measure(task: Timed, progress: Progress) -> Row:
    """Run a scene some times and return status, the least time, the work, contacts and the errors."""
    del progress
    try:
        seconds, table = timed(task)
        found = errors(table, task.exact) if task.exact else {}
    except (RunError, SceneError, TableError) as error:
        return {"status": str(error), "seconds": None, "evaluations": None, "errors": {}}
    counters = table.provenance["counters"]
    return {
        "seconds": seconds,
        "evaluations": counters.get("rhs", counters.get("newton_iterations")),
        "contacts": 0 if table.events is None else len(table.events),
        "errors": found,
    }


def timed(task: Timed) -> tuple[float, Table]:
    """Return the least processor time of some runs, s, and a result; raises as `run_one`."""
    run = partial(run_one, model=task.model)
    run(task.scene.with_values({"drive.cycles": WARM}))
    times: list[float] = []
    while len(times) < task.rounds or sum(times) < task.busy:
        before = time.process_time()
        table = run(task.scene)
        times.append(time.process_time() - before)
        if times[0] > LONG:
            break
    return min(times), table


def errors(table: Table, name: str) -> dict[str, float]:
    """Return the errors of a run of one of the scenes, by the names of `QUANTITIES`."""
    exact = truth(name)
    if name not in WITH_CLEARANCE:
        torque = exact.values("crank_torque")
        error = np.abs(table.values("crank_torque") - torque).max() / np.ptp(torque)
        return {"crank_torque": float(error)}
    assert table.events is not None
    assert exact.events is not None
    period = cycle(name, {}).period
    deviation, right = (
        abs(slider_errors(of, _ideal(name), period, names=("slider_y",)).peak("slider_y").value)
        for of in (table, exact)
    )
    ratios = {
        "slider_y_error": deviation / right,
        "impulse": table.events["impulse"].sum() / exact.events["impulse"].sum(),
        "peak_force": table.events["peak_force"].max() / exact.events["peak_force"].max(),
    }
    return {"slider_x": _apart(table, exact)} | {key: float(abs(of - 1)) for key, of in ratios.items()}


@cache
def truth(name: str) -> Table:
    """Return the run of a scene that counts as exact; of the ideal mechanism the closed form."""
    return run_one(_exact(name).scene, "reference")


def confirmations(names: Sequence[str], n_jobs: int) -> list[float]:
    """Return how far the other model's most accurate run of each scene is from the exact one, m of x."""
    settings = {**TREE.changes, "solver.exudyn.tolerance": CONFIRMING}
    jobs = [_exact(name) for name in names] + [Job(cycle(name, settings), "exudyn") for name in names]
    tables = list(map(successful, run_all(jobs, n_jobs), jobs))
    return [_apart(a, b) for a, b in zip(tables, tables[len(names) :], strict=False)]


def _exact(name: str) -> Job:
    return Job(cycle(name, {**MINIMAL.changes, "solver.reference.tolerance": TRUTH}), "reference")


@cache
def _ideal(name: str) -> Table:
    return run_one(cycle(name, {"joints.slider": "ideal"}), "reference")


def _apart(a: Table, b: Table) -> float:
    return float(np.abs(a.values("slider_x") - b.values("slider_x")).max())
