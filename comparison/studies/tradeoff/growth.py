"""How the cost of a run grows: with the turns, the contacts and the channels that are asked for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import nan
from typing import Any

from comparison.execution.ledger import Row
from comparison.execution.run import Progress
from comparison.execution.task_store import SUCCESS, Task, measure_all, on_processes
from comparison.scene import Scene, load_scene
from comparison.studies.tradeoff.measure import timed

PLANNED, MULTIPLIERS = "reference", "reference, multipliers"
WAYS: dict[str, tuple[str, dict[str, object], tuple[float, ...]]] = {
    PLANNED: ("reference", {}, (1.0, 10.0, 100.0, 1000.0)),
    MULTIPLIERS: ("reference", {"solver.reference.formulation": "multiplier"}, (1.0, 10.0, 100.0)),
    "exudyn, tree": ("exudyn", {"solver.exudyn.formulation": "tree"}, (1.0, 3.0, 10.0)),
}
"""Way -> its model, what of the scene it changes, and how many turns it runs."""
CLEARANCES = ("90rpm-0.1mm", "150rpm-0.2mm", "300rpm-0.2mm", "90rpm-0.5mm")
GROUPS = (
    (),
    ("accelerations", "corners"),
    ("joints",),
    ("energy",),
    ("accelerations", "corners", "joints", "energy"),
)
FEW = {"output.samples_per_cycle": 100}


@dataclass(frozen=True)
class Growing(Task):
    """A scene to be timed."""

    scene: Scene
    model: str

    @property
    def identity(self) -> dict[str, Any]:
        """Scene and model."""
        return {"scene": self.scene.hash, "model": self.model}

    @property
    def models(self) -> tuple[str, ...]:
        """Its model."""
        return (self.model,)


def measure(task: Growing, progress: Progress) -> Row:
    """Return the least processor time of some runs, s, and the number of contacts."""
    del progress
    least, table = timed(task.scene, task.model)
    return {"seconds": least, "contacts": 0 if table.events is None else len(table.events)}


def timings(tasks: Sequence[Growing]) -> list[tuple[float, int]]:
    """Return the least processor time of some runs of each, s, and its number of contacts.

    Raises
    ------
    RuntimeError
        If a run does not succeed.
    """
    rows = measure_all(measure, tasks, on_processes(1))
    for row in rows:
        if row["status"] != SUCCESS:
            raise RuntimeError(row["message"])
    return [(row["seconds"], row["contacts"]) for row in rows]


def by_turns() -> list[tuple[str, float, float, int]]:
    """Return way, turns, seconds and contacts; a hundred samples a turn, and no more than the motion."""
    cases = [(way, turns) for way, (_, _, lengths) in WAYS.items() for turns in lengths]
    tasks = []
    for way, turns in cases:
        model, changes, _ = WAYS[way]
        values = {"output.groups": [], **FEW, **changes, "drive.cycles": turns}
        tasks.append(Growing(load_scene("150rpm-0.2mm", values), model))
    return [(*case, *found) for case, found in zip(cases, timings(tasks), strict=True)]


def ratio_in_long_runs(rows: Sequence[tuple[str, float, float, int]]) -> tuple[float, float]:
    """Return how many times the planned formulation's cost multipliers have in the longest run of both.

    And the turns of that run; both nan where they have none in common.
    """
    cost = {(way, turns): seconds for way, turns, seconds, _ in rows}
    common = [turns for way, turns in cost if way == MULTIPLIERS and (PLANNED, turns) in cost]
    if not common:
        return nan, nan
    longest = max(common)
    return cost[MULTIPLIERS, longest] / cost[PLANNED, longest], longest


def by_contacts() -> list[tuple[str, float, int]]:
    """Return scene, seconds and contacts of ten turns by the reference."""
    usual: dict[str, object] = {"output.groups": [], "drive.cycles": 10.0, **FEW}
    found = timings([Growing(load_scene(name, usual), "reference") for name in CLEARANCES])
    return [(name, *of) for name, of in zip(CLEARANCES, found, strict=True)]


def by_channels() -> list[tuple[str, float]]:
    """Return groups and seconds of ten turns with a thousand samples each by the reference."""
    tasks = []
    for groups in GROUPS:
        changes: dict[str, object] = {"output.groups": list(groups), "drive.cycles": 10.0}
        tasks.append(Growing(load_scene("150rpm-0.2mm", changes), "reference"))
    names = [", ".join(("motion", *groups)) for groups in GROUPS]
    return [(name, seconds) for name, (seconds, _) in zip(names, timings(tasks), strict=True)]
