"""Changes of a scene's keys: dotted keys over a file, and a file over the one that it extends."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any


def changed(given: Mapping[str, Any], values: Mapping[str, object]) -> dict[str, Any]:
    """Apply dotted keys to a scene.

    Exudyn's step and tolerance in a scene are meant for the scene's formulation. They have another meaning in
    another formulation chosen here: a step for the five bodies makes the tree take a hundred times its steps.
    """
    solver, wanted = given.get("solver", {}), values.get("solver.exudyn.formulation")
    if wanted is not None and isinstance(solver, Mapping):
        exudyn = solver.get("exudyn", {})
        if isinstance(exudyn, Mapping) and exudyn.get("formulation", "auto") != wanted:
            kept = {key: value for key, value in exudyn.items() if key not in ("step", "tolerance")}
            given = {**given, "solver": {**solver, "exudyn": kept}}
    return merged(given, _nested(values))


def _nested(values: Mapping[str, object]) -> dict[str, Any]:
    """Convert dotted keys to nested mappings."""
    nested: dict[str, Any] = {}
    for dotted, value in values.items():
        inner: Any = value
        for part in reversed(dotted.split(".")):
            inner = {part: inner}
        nested = merged(nested, inner)
    return nested


def merged(base: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Merge ``changes`` into ``base``, section by section."""
    result = dict(base)
    for key, value in changes.items():
        below = result.get(key)
        result[key] = merged(below, value) if isinstance(below, dict) and isinstance(value, dict) else value
    return result
