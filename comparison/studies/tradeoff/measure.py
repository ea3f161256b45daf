"""One setting measured: processor time, work, and the errors of what users read.

One run at a time, in this process: timings of runs side by side would be those of a busy machine. What was
measured is kept, so that an interrupted study goes on where it stopped.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from comparison.cache import cache_folder
from comparison.engines import fingerprint
from comparison.files import write_json
from comparison.machine import platform_name
from comparison.run import RunError, run_one
from comparison.scene import Scene, SceneError, digest, load_scene
from comparison.studies.tradeoff.methods import LOOSE, METHODS, SCENES, TURNS, Method
from comparison.table import Table, TableError

Row = dict[str, Any]
"""method, scene, setting, status, seconds, evaluations, and `errors` by quantity."""

TRUTH = 1e-14
"""Tolerance of the run that counts as exact: a hundredth of the smallest that is measured."""
ROUNDS, LONG = 3, 3.0
"""The least time of so many runs counts; a run of more seconds is measured once."""
QUANTITIES = {
    "slider_x": ("largest error of x", "m"),
    "slider_y_error": ("error of the largest deviation of y from the ideal mechanism", ""),
    "impulse": ("error of the sum of all contacts' impulses", ""),
    "peak_force": ("error of the largest contact force", ""),
    "crank_torque": ("largest error of the crank's torque, over its range", ""),
}
"""What errors are measured of, and the unit; without one: relative."""


def measured(
    n_jobs: int, on_progress: Callable[[float], None] | None, methods: tuple[Method, ...] = METHODS
) -> list[Row]:
    """Measure every method at every setting on its scenes; progress by the number of settings."""
    del n_jobs  # see above
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
    key = digest(
        {
            "scene": scene.hash,
            "models": [fingerprint(model) for model in ("reference", method.model)],
            "truth": [TRUTH, ROUNDS, LONG, list(QUANTITIES)],
            "machine": platform_name(),
        }
    )
    path = cache_folder() / f"tradeoff-{key}.json"
    kept = _kept(path)
    if kept is not None:
        return {**kept, "method": method.name, "model": method.model}
    row: Row = {"method": method.name, "model": method.model, "scene": name, "setting": setting}
    row |= measure(scene, method.model, name)
    with suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        write_json(row, path)
    return row


def measure(scene: Scene, model: str, name: str) -> Row:
    """Run a scene some times and return status, the least time, the work and the errors."""
    _warm(model, scene)
    seconds, table = float("inf"), None
    for _ in range(ROUNDS):
        before = time.process_time()
        try:
            table = run_one(scene, model)
        except (RunError, SceneError, TableError) as error:
            return {"status": str(error), "seconds": None, "evaluations": None, "errors": {}}
        seconds = min(seconds, time.process_time() - before)
        if seconds > LONG:
            break
    assert table is not None
    counters = table.provenance["counters"]
    return {
        "status": "success",
        "seconds": seconds,
        "evaluations": counters.get("rhs", counters.get("newton_iterations")),
        "errors": errors(table, name),
    }


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


@cache
def _compiled() -> set[tuple[str, str]]:
    return set()


def _warm(model: str, scene: Scene) -> None:
    """Let the kernels of a formulation be compiled before anything is timed."""
    solver = scene.data["solver"][model]
    which = (model, digest({key: solver[key] for key in ("formulation", "method")} | scene.data["joints"]))
    if which not in _compiled():
        with suppress(RunError, SceneError, TableError):
            run_one(scene.with_values({"drive.cycles": 0.02}), model)
        _compiled().add(which)


def _kept(path: Path) -> Mapping[str, Any] | None:
    try:
        kept: dict[str, Any] = json.loads(path.read_text("utf-8"))
    except (OSError, ValueError):
        return None
    return kept
