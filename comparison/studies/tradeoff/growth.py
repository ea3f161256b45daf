"""How the cost of a run grows: with the turns, the contacts and the channels that are asked for."""

from __future__ import annotations

from comparison.ledger import Row
from comparison.scene import load_scene
from comparison.studies.tradeoff.measure import kept, timed

TURNS = {"reference": (1.0, 10.0, 100.0, 1000.0), "exudyn": (1.0, 3.0, 10.0)}
CLEARANCES = ("90rpm-0.1mm", "150rpm-0.2mm", "300rpm-0.2mm", "90rpm-0.5mm")
GROUPS = (
    (),
    ("accelerations", "corners"),
    ("joints",),
    ("energy",),
    ("accelerations", "corners", "joints", "energy"),
)
TREE = {"solver.exudyn.formulation": "tree"}
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
    """Return model, turns, seconds and contacts; a hundred samples a turn, and no more than the motion."""
    rows = []
    for model, lengths in TURNS.items():
        usual = {"output.groups": [], **FEW, **(TREE if model == "exudyn" else {})}
        for turns in lengths:
            rows.append((model, turns, *seconds("150rpm-0.2mm", model, usual | {"drive.cycles": turns})))
    return rows


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
