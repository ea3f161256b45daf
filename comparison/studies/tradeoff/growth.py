"""How the cost of a run grows: with the turns, the contacts and the channels that are asked for."""

from __future__ import annotations

from collections.abc import Sequence
from math import nan

from comparison.ledger import Row
from comparison.scene import load_scene
from comparison.studies.tradeoff.measure import kept, timed

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


def seconds(scene: str, model: str, changes: dict[str, object]) -> tuple[float, int]:
    """Return the least processor time of some runs, s, and the number of contacts; both are kept."""
    loaded = load_scene(scene, changes)

    def work() -> Row:
        least, table = timed(loaded, model)
        return {"seconds": least, "contacts": 0 if table.events is None else len(table.events)}

    row = kept(loaded, model, "growth", work)
    return row["seconds"], row["contacts"]


def by_turns() -> list[tuple[str, float, float, int]]:
    """Return way, turns, seconds and contacts; a hundred samples a turn, and no more than the motion."""
    rows = []
    for way, (model, changes, lengths) in WAYS.items():
        usual = {"output.groups": [], **FEW, **changes}
        for turns in lengths:
            rows.append((way, turns, *seconds("150rpm-0.2mm", model, usual | {"drive.cycles": turns})))
    return rows


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
    return [(name, *seconds(name, "reference", usual)) for name in CLEARANCES]


def by_channels() -> list[tuple[str, float]]:
    """Return groups and seconds of ten turns with a thousand samples each by the reference."""
    rows = []
    for groups in GROUPS:
        changes: dict[str, object] = {"output.groups": list(groups), "drive.cycles": 10.0}
        rows.append((", ".join(("motion", *groups)), seconds("150rpm-0.2mm", "reference", changes)[0]))
    return rows
