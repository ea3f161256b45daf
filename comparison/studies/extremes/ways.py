"""Who runs a cell: every formulation at its standard accuracy, and the runs they are held against."""

from __future__ import annotations

from dataclasses import dataclass, field

from comparison.accuracy.levels import solver_values
from comparison.scene import Scene, load_scene
from comparison.studies.extremes.cells import BASE, HYPERCUBE, LAWS, NEWTON, Cell


@dataclass(frozen=True)
class Way:
    """One way to run a scene.

    Attributes
    ----------
    name
        What it is called.
    model
        "reference" or "exudyn".
    changes
        Of the scene, dotted keys.
    """

    name: str
    model: str
    changes: dict[str, object] = field(hash=False)

    def scene(self, cell: Cell) -> Scene:
        """Return a cell's scene as this way runs it; what counts as exact keeps its own settings.

        Raises
        ------
        SceneError
            If there is no such scene.
        """
        settings = {} if self in (*TIGHT, STIFF, TWIN) else cell.settings
        return cell.scene.with_values({**self.changes, **settings})


def _settings(model: str, accuracy: str, formulation: str) -> dict[str, object]:
    chosen: dict[str, object] = {f"solver.{model}.formulation": formulation}
    return chosen | solver_values(model, accuracy, load_scene(BASE, chosen))


def _reference(accuracy: str, formulation: str) -> dict[str, object]:
    # What is lost or created needs no further coordinates there: it is asked for everywhere.
    return {"output.groups": ["energy"], **_settings("reference", accuracy, formulation)}


def _exudyn(accuracy: str, formulation: str, **more: object) -> dict[str, object]:
    return _settings("exudyn", accuracy, formulation) | more


ENERGY: dict[str, object] = {"output.groups": ["energy"], "solver.exudyn.method": "trapezoidal-index2"}
LSODA: dict[str, object] = {"solver.reference.method": "LSODA"}
MINIMAL = Way("minimal", "reference", _reference("standard", "auto"))
IMPLICIT = Way("minimal, LSODA", "reference", MINIMAL.changes | LSODA)
MULTIPLIERS = Way("multipliers", "reference", _reference("standard", "multiplier"))
TREE = Way("tree", "exudyn", _exudyn("standard", "tree"))
BODIES = Way("five bodies", "exudyn", _exudyn("standard", "full"))
INDEX2 = Way("five bodies, index 2", "exudyn", _exudyn("standard", "full", **ENERGY))
NATIVE = Way("five bodies, Exudyn's contact", "exudyn", _exudyn("standard", "native"))
WAYS = (MINIMAL, IMPLICIT, MULTIPLIERS, TREE, BODIES, INDEX2, NATIVE)
TIGHT = (
    Way("minimal, strict", "reference", _reference("strict", "auto")),
    Way("tree, strict", "exudyn", _exudyn("strict", "tree")),
)
"""What the others are held against: the most accurate run of either model."""
STIFF = Way("minimal by LSODA, strict", "reference", TIGHT[0].changes | LSODA)
"""Instead of the reference's, where that does not come to the end."""
TWIN = Way("minimal, strict, moved", "reference", TIGHT[0].changes)
"""From a start beside the cell's: how much the scene magnifies."""
AUDITED = (
    "base",
    "clearance",
    "speed",
    "modulus",
    "restitution",
    "friction",
    NEWTON,
    "step",
    "turns",
)
"""Axes on which the five bodies are run with constraints at velocity level too: that gives their energies."""


def exact_of(cell: Cell) -> list[Way]:
    """Return the ways that count as exact: but for one law the tree's strict run takes too long."""
    return [way for way in TIGHT if way.model == "reference" or cell.law == LAWS[0]]


def ways_of(cell: Cell) -> list[Way]:
    """Return the ways that run a cell.

    Exudyn's own contact is a law of corners alone, and under the other laws LSODA takes all its time. In the
    hypercube are those that are compared.
    """
    chosen = [MINIMAL, MULTIPLIERS, TREE, BODIES]
    if cell.axis != HYPERCUBE and cell.law == LAWS[0]:
        chosen += [IMPLICIT, NATIVE] + ([INDEX2] if cell.axis in AUDITED else [])
    return [way for way in WAYS if way in chosen and (not cell.only or way.name in cell.only)]
