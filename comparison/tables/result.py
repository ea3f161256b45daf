"""The result of a model, and what is wrong with its parts: each fault is one line, of which the first counts.

Pulses are the normal forces of the contacts in time: columns ``row`` (in the events), ``time`` (s) and
``force`` (N), sorted by row and time; of a contact with many samples a table keeps the envelope.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from comparison.files import json_text
from comparison.tables.arrays import BoolArray

Columns = dict[str, NDArray[Any]]

_PARTS: dict[str, type] = dict.fromkeys(("columns", "events", "extrema", "provenance"), dict)
_PARTS |= {"status": str, "remedy": str}
_PULSES = {"row": "iu", "time": "f", "force": "f"}
_KEPT = 32  # samples of a contact; of one with more the envelope in half as many columns
_LONG = 400  # samples from which on a contact's first _KEPT are kept too, and six times the columns
_DEEPEST = 50


class Result(Protocol):
    """A model's result; it may also have ``pulses`` and ``cycle_extrema``, as a `Table` has."""

    columns: dict[str, NDArray[np.float64]]
    events: dict[str, NDArray[Any]]
    extrema: dict[str, dict[str, float]]
    provenance: dict[str, Any]
    status: str
    remedy: str


def first(bad: BoolArray) -> list[int]:
    """Return the first place that is bad, if one is."""
    return [int(n) for n in np.flatnonzero(bad)[:1]]


def result_faults(result: Result) -> Iterator[str]:
    """Yield which parts of a `Result` are missing or something else."""
    for name, kind in _PARTS.items():
        part = getattr(result, name, None)
        if not isinstance(part, kind):
            yield f"result: {name} must be a {kind.__name__}, not {type(part).__name__}"
    for name, faults in (("pulses", pulse_faults), ("cycle_extrema", cycle_faults)):
        part = getattr(result, name, None)
        if part is not None and not isinstance(part, dict):
            yield f"result: {name} must be a dict or None, not {type(part).__name__}"
        yield from faults(part) if part else ()
    record = {**result.provenance, "extrema": result.extrema}
    for fault in record_faults(record):
        yield f"extrema or provenance: {fault}"
    try:
        json_text(record)
    except (TypeError, ValueError) as error:
        yield f"extrema or provenance: {error}"


def cycle_faults(columns: Mapping[str, Any]) -> Iterator[str]:
    """Yield why these are no columns of real numbers of one length."""
    return _column_faults("cycle_extrema", columns, dict.fromkeys(columns, "f"))


def pulse_faults(pulses: Mapping[str, Any]) -> Iterator[str]:
    """Yield why these are no columns of pulses."""
    yield from _column_faults("pulses", pulses, _PULSES)
    for name in ("time", "force"):
        for n in first(~np.isfinite(pulses[name])):
            yield f"pulses: {name} is {pulses[name][n]} in sample {n + 1}"
    step = np.diff(pulses["row"].astype(np.int64))
    for n in first((step < 0) | ((step == 0) & (np.diff(pulses["time"]) <= 0.0))):
        yield f"pulses: not sorted by row and time at sample {n + 2}"


def _column_faults(part: str, columns: Mapping[str, Any], kinds: Mapping[str, str]) -> Iterator[str]:
    for name, kind in kinds.items():
        column = columns.get(name)
        if not isinstance(column, np.ndarray) or column.ndim != 1 or column.dtype.kind not in kind:
            what = "real numbers" if kind == "f" else "integers"
            yield f"{part}: {name} must be an array of {what}, shape (n,)"
    if len({columns[name].size for name in kinds}) > 1:
        yield f"{part}: columns differ in length"


def record_faults(record: object) -> Iterator[str]:
    """Yield why this is no record of a run, such as another program's file of its name.

    Entries that are read must have the expected type; all others may be anything.
    """
    if not isinstance(record, Mapping):
        yield "must contain one JSON object"
        return
    if _is_deeper(record, _DEEPEST):
        yield "is nested too deeply"
    for name in ("settings", "counters", "constraints", "versions", "extrema"):
        if record.get(name) is not None and not isinstance(record[name], Mapping):
            yield f"{name} must be an object"
    for channel, values in (record.get("extrema") or {}).items():
        if not isinstance(values, Mapping) or not all(map(_is_number, values.values())):
            yield f"extrema of {channel} must be an object of numbers"
    if not _is_number(record.get("wall_time_s")):
        yield "wall_time_s must be a number"
    scene = record.get("scene")
    if isinstance(scene, Mapping) and not isinstance(scene.get("solver", {}), Mapping):
        yield "scene.solver must be an object"


def _is_number(value: object) -> bool:
    """Whether a value is a number, or the null that replaces one that is not finite."""
    return value is None or (isinstance(value, int | float) and not isinstance(value, bool))


def _is_deeper(value: object, left: int) -> bool:
    if not isinstance(value, Mapping | list | tuple):
        return False
    parts = list(value.values()) if isinstance(value, Mapping) else value
    return left == 0 or any(_is_deeper(part, left - 1) for part in parts)


def thinned(pulses: Columns) -> Columns:
    """Return the pulses with fewer samples of each long contact: its ends, and the extrema of equal parts.

    All samples of a short contact are kept, and the first ones of a very long one: there its impact is.
    """
    row, force = pulses["row"].astype(np.int64), pulses["force"].astype(np.float64)
    begun = np.flatnonzero(np.diff(row, prepend=row[0] - 1))
    counts = np.diff(begun, append=row.size)
    parts = np.where(counts <= _KEPT, counts, np.where(counts < _LONG, _KEPT // 2, 3 * _KEPT))
    count = np.repeat(counts, counts)
    place = np.arange(row.size) - np.repeat(begun, counts)
    part = place * np.repeat(parts, counts) // count
    kept = (place == count - 1) | (place < np.where(count < _LONG, 1, _KEPT))
    edges = np.flatnonzero((place == 0) | (np.diff(part, prepend=-1) != 0))
    number = np.repeat(np.arange(edges.size), np.diff(edges, append=row.size))
    for extreme in (np.minimum, np.maximum):
        reached = np.flatnonzero(force == extreme.reduceat(force, edges)[number])
        kept[reached[np.flatnonzero(np.diff(number[reached], prepend=-1))]] = True
    return {"row": row[kept], "time": pulses["time"][kept].astype(np.float64), "force": force[kept]}
