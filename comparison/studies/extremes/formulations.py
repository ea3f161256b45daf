"""The formulations that run a cell, at their standard accuracy, and the runs that they are held against."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from comparison.accuracy.levels import solver_values
from comparison.scene import load_scene
from comparison.studies.extremes.runs import BASE


@dataclass(frozen=True)
class Method:
    """A formulation of a model with its settings.

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
    changes: Mapping[str, object] = field(default_factory=dict, hash=False)


def _settings(model: str, accuracy: str, formulation: str) -> dict[str, object]:
    chosen: dict[str, object] = {f"solver.{model}.formulation": formulation}
    return chosen | solver_values(model, accuracy, load_scene(BASE, chosen))


# What is lost or created needs no further coordinates in the reference: it is asked for everywhere.
_ENERGY: dict[str, object] = {"output.groups": ["energy"]}
_INDEX2: dict[str, object] = _ENERGY | {"solver.exudyn.method": "trapezoidal-index2"}
_LSODA: dict[str, object] = {"solver.reference.method": "LSODA"}
_MINIMAL = _ENERGY | _settings("reference", "standard", "auto")
_STRICT = _ENERGY | _settings("reference", "strict", "auto")
_FULL = _settings("exudyn", "standard", "full")

MINIMAL = Method("minimal", "reference", _MINIMAL)
IMPLICIT = Method("minimal, LSODA", "reference", _MINIMAL | _LSODA)
MULTIPLIERS = Method("multipliers", "reference", _ENERGY | _settings("reference", "standard", "multiplier"))
TREE = Method("tree", "exudyn", _settings("exudyn", "standard", "tree"))
FULL = Method("full (five bodies)", "exudyn", _FULL)
INDEX2 = Method("full (five bodies), index 2", "exudyn", _FULL | _INDEX2)
NATIVE = Method("full (five bodies), Exudyn's contact", "exudyn", _settings("exudyn", "standard", "native"))
METHODS = (MINIMAL, IMPLICIT, MULTIPLIERS, TREE, FULL, INDEX2, NATIVE)
COMPARED = (MINIMAL, TREE, FULL)
"""Whose classes are compared: the smallest formulation of each model and the full one."""

STRICT = Method("minimal, strict", "reference", _STRICT)
STRICT_TREE = Method("tree, strict", "exudyn", _settings("exudyn", "strict", "tree"))
STRICT_IMPLICIT = Method("minimal by LSODA, strict", "reference", _STRICT | _LSODA)
"""Instead of the reference's strict run, where that does not come to the end."""
EXACT = (STRICT, STRICT_TREE, STRICT_IMPLICIT)
"""What the others are held against: the most accurate runs of either model."""
PERTURBED = Method("minimal, strict, perturbed", "reference", _STRICT)
"""From a start beside the cell's: how much the scene magnifies."""
