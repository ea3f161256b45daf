"""The formulations that run a cell, at their standard accuracy, and the runs that they are held against."""

from __future__ import annotations

from collections.abc import Mapping

from comparison.accuracy.levels import solver_values
from comparison.scene import load_scene
from comparison.studies.extremes.runs import BASE
from comparison.studies.shared import formulations as catalogue
from comparison.studies.shared.formulations import Method


def _at(accuracy: str, method: Method, name: str, changes: Mapping[str, object] | None = None) -> Method:
    """Return a method of the catalogue at an accuracy."""
    values = solver_values(method.model, accuracy, load_scene(BASE, dict(method.changes)))
    return Method(name, method.model, {**method.changes, **values, **(changes or {})})


# What is lost or created needs no further coordinates in the reference: it is asked for everywhere.
_ENERGY: dict[str, object] = {"output.groups": ["energy"]}

MINIMAL = _at("standard", catalogue.MINIMAL, "minimal", _ENERGY)
IMPLICIT = _at("standard", catalogue.MINIMAL_LSODA, "minimal, LSODA", _ENERGY)
MULTIPLIERS = _at("standard", catalogue.MULTIPLIERS, "multipliers", _ENERGY)
TREE = _at("standard", catalogue.TREE, "tree")
FULL = _at("standard", catalogue.FULL, "full (five bodies)")
INDEX2 = _at("standard", catalogue.FULL_INDEX2, "full (five bodies), index 2", _ENERGY)
METHODS = (MINIMAL, IMPLICIT, MULTIPLIERS, TREE, FULL, INDEX2)
COMPARED = (MINIMAL, TREE, FULL)
"""Whose classes are compared: the smallest formulation of each model and the full one."""

STRICT = _at("strict", catalogue.MINIMAL, "minimal, strict", _ENERGY)
STRICT_TREE = _at("strict", catalogue.TREE, "tree, strict")
STRICT_IMPLICIT = _at("strict", catalogue.MINIMAL_LSODA, "minimal by LSODA, strict", _ENERGY)
"""Instead of the reference's strict run, where that does not come to the end."""
EXACT = (STRICT, STRICT_TREE, STRICT_IMPLICIT)
"""What the others are held against: the most accurate runs of either model."""
PERTURBED = Method("minimal, strict, perturbed", "reference", STRICT.changes)
"""From a start beside the cell's: how much the scene magnifies."""
