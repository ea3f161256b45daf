"""The result of a model, and checks of its parts; each fault is one line.

Pulses are the normal forces of the contacts in time: columns ``row`` (in the events), ``time`` (s) and
``force`` (N), sorted by row and time; of a contact with many samples a table keeps the envelope.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from comparison.files import json_text
from comparison.tables.arrays import BoolArray

Columns = dict[str, NDArray[Any]]

_PARTS = dict.fromkeys(("columns", "events", "extrema", "provenance"), dict) | {
    "status": str,
    "remedy": str,
}
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


def reject(bad: BoolArray, fault: Callable[[int], str]) -> None:
    """Raise a ValueError with what is said of the first place that is bad, if one is."""
    if bad.any():
        raise ValueError(fault(int(bad.argmax())))


def check_result(result: Result) -> None:
    """Reject, by a TypeError or ValueError, what lacks a part of a `Result` or has another in its place."""
    for name, kind in _PARTS.items():
        part = getattr(result, name, None)
        if not isinstance(part, kind):
            raise TypeError(f"result: {name} must be a {kind.__name__}, not {type(part).__name__}")
    for name, check in (("pulses", check_pulses), ("cycle_extrema", check_cycle_extrema)):
        part = getattr(result, name, None)
        if part is not None and not isinstance(part, dict):
            raise TypeError(f"result: {name} must be a dict or None, not {type(part).__name__}")
        if part:
            check(part)
    record = {**result.provenance, "extrema": result.extrema}
    try:
        check_record(record)
        json_text(record)
    except (TypeError, ValueError) as error:
        raise ValueError(f"extrema or provenance: {error}") from error


def check_cycle_extrema(columns: Mapping[str, Any]) -> None:
    """Reject, by a ValueError, what are no columns of real numbers of one length."""
    _check_columns("cycle_extrema", columns, dict.fromkeys(columns, "f"))


def check_pulses(pulses: Mapping[str, Any]) -> None:
    """Reject, by a ValueError, what are no columns of pulses."""
    _check_columns("pulses", pulses, {"row": "iu", "time": "f", "force": "f"})
    for name in ("time", "force"):
        values = pulses[name]
        reject(~np.isfinite(values), lambda n: f"pulses: {name} is {values[n]} in sample {n + 1}")  # noqa: B023
    step = np.diff(pulses["row"].astype(np.int64))
    unsorted = (step < 0) | ((step == 0) & (np.diff(pulses["time"]) <= 0.0))
    reject(unsorted, lambda n: f"pulses: not sorted by row and time at sample {n + 2}")


def _check_columns(part: str, columns: Mapping[str, Any], kinds: Mapping[str, str]) -> None:
    for name, kind in kinds.items():
        column = columns.get(name)
        if not isinstance(column, np.ndarray) or column.ndim != 1 or column.dtype.kind not in kind:
            what = "real numbers" if kind == "f" else "integers"
            raise ValueError(f"{part}: {name} must be an array of {what}, shape (n,)")
    if len({columns[name].size for name in kinds}) > 1:
        raise ValueError(f"{part}: columns differ in length")


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


def check_record(record: object) -> None:
    """Reject, by a ValueError, what is no record of a run, such as another program's file of its name.

    Entries that are read must have the expected type; all others may be anything.
    """
    if fault := next(_faults(record), ""):
        raise ValueError(fault)


def _faults(record: object) -> Iterator[str]:
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
