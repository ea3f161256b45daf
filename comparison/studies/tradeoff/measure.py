"""One setting measured: processor time, work, and the errors of what users read.

One run at a time, in this process: timings of runs side by side would be those of a busy machine. What was
measured is kept, so that an interrupted study goes on where it stopped.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import cache

import numpy as np

from comparison.cache import cache_folder
from comparison.engines import fingerprint
from comparison.ledger import Row, append_row, read_rows
from comparison.machine import platform_name
from comparison.run import RunError, run_one, runner
from comparison.scene import Scene, SceneError, digest, load_scene
from comparison.studies.tradeoff.methods import LOOSE, METHODS, SCENES, TURNS, Method
from comparison.table import Table, TableError

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


def measured(on_progress: Callable[[float], None] | None, methods: tuple[Method, ...] = METHODS) -> list[Row]:
    """Measure every method at every setting on its scenes; progress by the number of settings."""
    asked = [
        (method, name, setting) for method in methods for name in method.scenes for setting in method.settings
    ]
    rows = []
    for number, (method, name, setting) in enumerate(asked):
        if on_progress:
            on_progress(number / len(asked))
        rows.append(_row(method, name, setting))
    if on_progress:
        on_progress(1.0)
    return rows


def _row(method: Method, name: str, setting: float) -> Row:
    scene = method.scene(name, setting)
    row = kept(scene, method.model, [TRUTH, list(QUANTITIES)], lambda: measure(scene, method.model, name))
    return row | {"method": method.name, "model": method.model, "scene": name, "setting": setting}


def kept(scene: Scene, model: str, asked: object, work: Callable[[], Row]) -> Row:
    """Return what was found of a run before; else let it be found, and keep it.

    Raises
    ------
    LedgerError
        If it cannot be kept.
    """
    key = digest(
        {
            "scene": scene.hash,
            "models": [fingerprint(name) for name in ("reference", model)],
            "asked": [asked, ROUNDS, BUSY, LONG],
            "machine": platform_name(),
        }
    )
    ledger = cache_folder() / "tradeoff.jsonl"
    if (row := read_rows(ledger).get(key)) is not None:
        return row
    ledger.parent.mkdir(parents=True, exist_ok=True)
    return append_row(ledger, key, work())


def measure(scene: Scene, model: str, name: str) -> Row:
    """Run a scene some times and return status, the least time, the work and the errors."""
    try:
        seconds, table = timed(scene, model)
    except (RunError, SceneError, TableError) as error:
        return {"status": str(error), "seconds": None, "evaluations": None, "errors": {}}
    counters = table.provenance["counters"]
    return {
        "status": "success",
        "seconds": seconds,
        "evaluations": counters.get("rhs", counters.get("newton_iterations")),
        "errors": errors(table, name),
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
