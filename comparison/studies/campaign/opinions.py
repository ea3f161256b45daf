"""Third opinions on a difference: other formulations, integrators and steps of either model.

Where rod 4 and slider alone are free and nothing touches, four numbers are the whole state. Then the opinions
begin at the last such sample before the difference, not at the scene's start: nothing has magnified their own
errors by then, and five bodies can afford a step of `SMALL_STEP`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from comparison.scene import Scene
from comparison.tables.arrays import BoolArray
from comparison.tables.table import Table

SMALL_STEP = 1e-7
"""s: a fifth of what five bodies take at "strict"."""
MOST_STEPS = 2_000_000
"""Of the five bodies, half a minute: what begins at the scene's start has a step as long as that takes."""
FINE_SAMPLES = 20
"""Times as many samples in the runs that are searched for corners inside their walls."""
BESIDE = 2
"""Samples between the restart and the difference, at least."""


@dataclass(frozen=True)
class Opinion:
    """A run that is asked."""

    name: str
    model: str
    scene: Scene


def restart_sample(scene: Scene, tables: tuple[Table, Table], before: int) -> int:
    """Return the last sample, `BESIDE` before another or more, at which nothing touches in either table.

    0, the scene's own start, where there is none, or the motion has more coordinates than a scene can give a
    start.
    """
    if scene.data["joints"]["crank_pin"] != "ideal":
        return 0
    free = ~(_touching(tables[0]) | _touching(tables[1]))
    found = np.flatnonzero(free[: max(1, before - BESIDE + 1)])
    return int(found[-1]) if found.size else 0


def _touching(table: Table) -> BoolArray:
    touching = np.zeros(table.time.size, dtype=np.bool_)
    for start, end in [] if table.events is None else table.events[["start", "end"]].to_numpy(float):
        touching |= (table.time >= start) & (table.time <= end)
    return touching


def excerpt(scene: Scene, table: Table, first: int, last: int, finer: int = 1) -> Scene:
    """Return the scene from one sample of its table to another, with ``finer`` times as many samples.

    The first is 0, or a sample at which nothing touches.
    """
    per_cycle = scene.data["output"]["samples_per_cycle"]
    values: dict[str, object] = {
        "drive.cycles": (last - first) / per_cycle,
        "output.samples_per_cycle": per_cycle * finer,
    }
    if first:
        sense = 1.0 if scene.data["drive"]["speed_rpm"] > 0 else -1.0
        x, guide = float(table.values("slider_x")[first]), scene.data["mechanism"]["guide_x"]
        values |= {
            "mechanism.crank_angle_deg": scene.data["mechanism"]["crank_angle_deg"]
            + sense * 360.0 * first / per_cycle,
            "initial.slider_offset": x - guide,
            "initial.slider_angle": float(table.values("slider_angle")[first]),
            "initial.slider_vx": float(table.values("slider_vx")[first]),
            "initial.slider_omega": float(table.values("slider_omega")[first]),
        }
    return scene.with_values(values)


def opinions(scene: Scene) -> list[Opinion]:
    """Return who is asked about a scene that is at the settings of the tight tier."""
    reference, exudyn = (scene.data["solver"][model]["tolerance"] for model in ("reference", "exudyn"))
    step = max(SMALL_STEP, scene.duration / MOST_STEPS)
    changes: list[tuple[str, str, dict[str, object]]] = [
        ("reference, run again", "reference", {}),
        ("reference, tolerance / 10", "reference", {"solver.reference.tolerance": reference / 10.0}),
        ("reference by scipy's DOP853", "reference", {"solver.reference.method": "scipy-DOP853"}),
        ("reference by LSODA", "reference", {"solver.reference.method": "LSODA"}),
        ("tree, run again", "exudyn", {}),
        (
            "tree, tolerance / 10, steps of 1e-5 s at most",
            "exudyn",
            {"solver.exudyn.tolerance": exudyn / 10.0, "solver.exudyn.step": 1e-5},
        ),
        ("five bodies", "exudyn", {"solver.exudyn.formulation": "full", "solver.exudyn.step": step}),
    ]
    if scene.data["joints"]["crank_pin"] == "ideal":
        changes.insert(1, ("multipliers", "reference", {"solver.reference.formulation": "multiplier"}))
    return [Opinion(name, model, scene.with_values(values)) for name, model, values in changes]
