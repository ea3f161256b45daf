"""Every method over its settings on three scenes, timed one by one, with the errors of what users read."""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

from comparison.accuracy.work_precision import WARM
from comparison.execution.run import Job, Progress, RunError, run_all, run_one, successful
from comparison.execution.store import Row
from comparison.execution.tasks import Task
from comparison.reliability.errors import slider_errors
from comparison.scene import Scene, SceneError, load_scene
from comparison.studies.shared import scenes as catalogue
from comparison.studies.shared.scenes import MINIMAL, MULTIPLIERS, TREE, Method
from comparison.tables.table import Table, TableError

TRUTH = 1e-14  # tolerance of the run that counts as exact: a hundredth of the smallest that is measured
CONFIRMING = 1e-12  # tolerance of the other model's most accurate run
LONG = 3.0  # s; a longer run is measured once
BASE = "150rpm-0.2mm"
WITH_CLEARANCE = (BASE, "300rpm-0.2mm")
CHIEF = {"ideal": "crank_torque"} | dict.fromkeys(WITH_CLEARANCE, "slider_x")
"""Scene, of which one crank cycle is run -> the quantity whose error stands for its accuracy."""


@dataclass(frozen=True)
class Sweep:
    """A method over its settings."""

    method: Method
    settings: tuple[float, ...]  # tolerances, or step sizes in s, coarsest first
    order: float = 1.0  # of the error in the setting: 1 for a tolerance
    scenes: tuple[str, ...] = WITH_CLEARANCE

    @property
    def key(self) -> str:
        """Dotted key of the setting."""
        return f"solver.{self.method.model}.{'step' if self.order == 2 else 'tolerance'}"

    def scene(self, name: str, setting: float) -> Scene:
        """Return a crank cycle of one of the scenes as this method runs it."""
        return cycle(name, {**self.method.changes, self.key: setting})


def cycle(name: str, changes: Mapping[str, object]) -> Scene:
    """Return one crank cycle of one of the scenes; settings after the formulation that they belong to."""
    if name in WITH_CLEARANCE:
        return load_scene(name, {"output.groups": [], "drive.cycles": 1.0}).variant(changes)
    ideal = {"joints.slider": "ideal", "output.groups": ["accelerations", "joints"], "drive.cycles": 1.0}
    return load_scene(BASE, ideal).variant(changes)


def _decades(first: int, last: int) -> tuple[float, ...]:
    return tuple(float(f"1e-{n}") for n in range(first, last + 1))


_STEPS = (4e-5, 2e-5, 8e-6, 4e-6, 2e-6, 1e-6, 5e-7)
SWEEPS = (
    Sweep(MINIMAL, _decades(6, 12)),
    Sweep(catalogue.MINIMAL_SCIPY, _decades(6, 9)),
    Sweep(catalogue.MINIMAL_LSODA, _decades(6, 10)),
    Sweep(catalogue.MINIMAL_RADAU, _decades(6, 8)),
    Sweep(catalogue.MINIMAL_BDF, _decades(6, 9)),
    Sweep(MULTIPLIERS, _decades(6, 12), scenes=tuple(CHIEF)),
    Sweep(catalogue.MULTIPLIERS_BDF, _decades(6, 8), scenes=tuple(CHIEF)),
    Sweep(TREE, _decades(4, 11)),
    Sweep(catalogue.TREE_LONG_STEPS, _decades(2, 8)),
    Sweep(catalogue.FULL, _STEPS, order=2.0),
    Sweep(catalogue.FULL_INDEX2, _STEPS, order=2.0, scenes=tuple(CHIEF)),
)


@dataclass(frozen=True)
class Timed(Task):
    """A scene to be timed."""

    model: str
    scene: Scene
    rounds: int  # runs of which the least time counts, or as many more as take ``busy`` seconds together
    busy: float
    exact: str = ""  # name of the scene whose accurate run gives the errors; "": none are measured

    @property
    def models(self) -> tuple[str, ...]:
        """Its model, and the reference, whose run counts as exact."""
        return self.model, "reference"


def measure(task: Timed, progress: Progress) -> Row:
    """Run a scene some times and return status, the least time, the work, contacts and the errors."""
    del progress
    try:
        run_one(task.scene.with_values({"drive.cycles": WARM}), task.model)
        times: list[float] = []
        while len(times) < task.rounds or sum(times) < task.busy:
            before = time.process_time()
            table = run_one(task.scene, task.model)
            times.append(time.process_time() - before)
            if times[0] > LONG:
                break
        errors_by_quantity = errors(table, task.exact) if task.exact else {}
    except (RunError, SceneError, TableError) as error:
        return {"status": str(error), "seconds": None, "evaluations": None, "errors": {}}
    counters = table.provenance["counters"]
    return {
        "seconds": min(times),
        "evaluations": counters.get("rhs", counters.get("newton_iterations")),
        "contacts": 0 if table.events is None else len(table.events),
        "errors": errors_by_quantity,
    }


def errors(table: Table, name: str) -> dict[str, float]:
    """Return the errors of a run of one of the scenes: of x in m, all others relative."""
    right, ideal = exact(name)
    if name not in WITH_CLEARANCE:
        torque = right.values("crank_torque")
        return {"crank_torque": float(np.abs(table.values("crank_torque") - torque).max() / np.ptp(torque))}
    numbers = []
    for run in (table, right):
        assert run.events is not None
        y = slider_errors(run, ideal, cycle(name, {}).period, names=("slider_y",)).peak("slider_y").value
        numbers.append([abs(y), run.events["impulse"].sum(), run.events["peak_force"].max()])
    relative = np.abs(np.array(numbers[0]) / np.array(numbers[1]) - 1)
    names = ("slider_y_error", "impulse", "peak_force")
    return {"slider_x": _apart(table, right)} | dict(zip(names, relative.tolist(), strict=True))


def confirmations(names: Sequence[str], n_jobs: int) -> list[float]:
    """Return how far the other model's most accurate run of each scene is from the exact one, m of x."""
    settings = {**TREE.changes, "solver.exudyn.tolerance": CONFIRMING}
    jobs = [_exact(name) for name in names] + [Job(cycle(name, settings), "exudyn") for name in names]
    tables = list(map(successful, run_all(jobs, n_jobs), jobs))
    return [_apart(a, b) for a, b in zip(tables, tables[len(names) :], strict=False)]


def _exact(name: str) -> Job:
    """Return the run of a scene that counts as exact; of the ideal mechanism it is the closed form."""
    return Job(cycle(name, {**MINIMAL.changes, "solver.reference.tolerance": TRUTH}), "reference")


@cache
def exact(name: str) -> tuple[Table, Table]:
    """Return the exact run of a scene, and that of the ideal mechanism."""
    job = _exact(name)
    return run_one(job.scene, job.model), run_one(cycle(name, {"joints.slider": "ideal"}), "reference")


def _apart(a: Table, b: Table) -> float:
    return float(np.abs(a.values("slider_x") - b.values("slider_x")).max())


# ---- how the cost of a run grows: with the cycles, the contacts and the channels that are recorded

LENGTHS = {MINIMAL: (1.0, 10.0, 100.0, 1000.0), MULTIPLIERS: (1.0, 10.0, 100.0), TREE: (1.0, 3.0, 10.0)}
"""Method -> how many cycles it runs."""
CLEARANCES = ("90rpm-0.1mm", BASE, "300rpm-0.2mm", "90rpm-0.5mm")
ALL = ("accelerations", "corners", "joints", "energy")


def growing(most: float) -> list[tuple[Row, Method, Scene]]:
    """Return what is timed, of no run more than so many cycles: the labels of its row, method and scene."""

    def one(table: str, cycles: float, method: Method, name: str, *groups: str) -> tuple[Row, Method, Scene]:
        few = {} if table == "channels" else {"output.samples_per_cycle": 100}
        changes = {**few, "output.groups": list(groups), **method.changes, "drive.cycles": cycles}
        labels = {"table": table, "cycles": cycles, "scene": name, "channels": ", ".join(("motion", *groups))}
        return labels | {"method": method.title}, method, load_scene(name, changes)

    ten, lengths = min(10.0, most), [(method, n) for method, all_of in LENGTHS.items() for n in all_of]
    return [
        *(one("cycles", n, method, BASE) for method, n in lengths if n <= most),
        *(one("contacts", ten, MINIMAL, name) for name in CLEARANCES),
        *(one("channels", ten, MINIMAL, BASE, *each) for each in ((), ALL[:2], ALL[2:3], ALL[3:], ALL)),
    ]
