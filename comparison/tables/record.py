"""Record beside a table: where its results come from. Entries that are read have the expected type."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from comparison.files import contents

_SECTIONS = ("settings", "counters", "constraints", "versions", "extrema")
_DEEPEST = 50


def read_record(path: Path) -> dict[str, Any]:
    """Read the record of a table; empty if there is no file.

    Raises
    ------
    OSError
        If it cannot be read, or is too large.
    ValueError
        If it is not one JSON object with entries of the expected types.
    """
    if not path.is_file():
        return {}
    try:
        record = json.loads(contents(path))
    except RecursionError as error:
        raise ValueError("is nested too deeply") from error
    check_record(record)
    return dict(record)


def check_record(record: object) -> None:
    """Reject what is no record, such as the file of another program that happens to have this name.

    Raises
    ------
    ValueError
        Which entry is not what it must be.
    """
    if fault := _fault(record):
        raise ValueError(fault)


def _fault(record: object) -> str:
    if not isinstance(record, Mapping):
        return "must contain one JSON object"
    if _is_deep(record, _DEEPEST):
        return "is nested too deeply"
    for name in _SECTIONS:
        if record.get(name) is not None and not isinstance(record[name], Mapping):
            return f"{name} must be an object"
    for channel, values in (record.get("extrema") or {}).items():
        if not isinstance(values, Mapping) or not all(map(_is_number, values.values())):
            return f"extrema of {channel} must be an object of numbers"
    if not _is_number(record.get("wall_time_s", 0.0)):
        return "wall_time_s must be a number"
    scene = record.get("scene")
    if isinstance(scene, Mapping) and not isinstance(scene.get("solver", {}), Mapping):
        return "scene.solver must be an object"
    return ""


def _is_number(value: object) -> bool:
    """Whether a value is a number, or the null that replaces one that is not finite."""
    return value is None or (isinstance(value, int | float) and not isinstance(value, bool))


def _is_deep(value: object, left: int) -> bool:
    if not isinstance(value, Mapping | list | tuple):
        return False
    parts: Iterable[object] = value.values() if isinstance(value, Mapping) else value
    return left == 0 or any(_is_deep(part, left - 1) for part in parts)
