"""Result table of a run: its channels, events, extrema and provenance, and whether it can be compared.

A check yields faults as lines, of which only the first is used: later checks rely on the earlier ones.
Pulses are the normal forces of the contacts in time: columns ``row`` (in the events), ``time`` (s) and
``force`` (N), sorted by row and time; of a contact with many samples a table keeps the envelope.
"""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import NDArray

from comparison.files import json_text
from comparison.formatting import spans
from comparison.scene import Scene, SceneError, scene_from_mapping
from comparison.tables.channels import Array, BoolArray, Channel, is_uncertainty, known_channels, places

if TYPE_CHECKING:
    import pandas as pd

Columns = dict[str, NDArray[Any]]

SAME_GRID = 1e-9
"""Share of a sample interval by which equal times may differ: a thousand rows written with 13 digits differ
by less, with 10 by more. At 2 m/s and 0.4 ms samples it is 1e-12 m."""
_PARTS = {"columns": dict, "events": dict, "extrema": dict, "provenance": dict, "status": str, "remedy": str}
_PULSES = {"row": "iu", "time": "f", "force": "f"}
_SAMPLES = 32  # stored samples of a contact; of longer ones the envelope, in half as many columns
_LONG = 400  # of a contact with so many the first _SAMPLES are stored too, and six times the columns
_LARGEST = 1e30  # no quantity is larger in its unit; its square, or itself in single precision, is finite
_MEASURES = ("normal_speed", "impulse", "peak_force", "largest_depth")


class TableError(ValueError):
    """Unusable table; the message is one line with file, channel and row."""


class _Frame:
    """Attribute of a table: a data frame, or arrays by name until its frame is read.

    Importing pandas takes longer than most runs; a run that is only checked and written does without.
    """

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name

    def __get__(self, table: Table | None, owner: type) -> Any:
        if table is None:
            return None  # the default, for which the dataclass asks
        if isinstance(part := table.__dict__[self.name], dict):
            import pandas as pd

            part = table.__dict__[self.name] = pd.DataFrame(part)
        return part

    def __set__(self, table: Table, part: object) -> None:
        table.__dict__[self.name] = part


@dataclass(frozen=True)
class Table:
    """Results of a run."""

    frame: pd.DataFrame = _Frame()  # type: ignore[assignment]
    """``time`` (s) first, then one column per channel."""
    events: pd.DataFrame | None = _Frame()  # type: ignore[assignment]
    """One row per contact, or None where the source has no events."""
    extrema: dict[str, dict[str, float]] = field(default_factory=dict)
    """Channel -> min, time_of_min, max, time_of_max over integration steps, whatever the samples."""
    provenance: dict[str, Any] = field(default_factory=dict)
    """Model, settings and versions that produced the results."""
    overrides: dict[str, Channel] = field(default_factory=dict)
    """Definitions of channels that are not the press's, or that a mapping gives a scale."""
    pulses: Columns | None = None
    """Normal forces of the events in time, or None where the source has none."""
    cycle_extrema: Columns | None = None
    """The extrema of each crank cycle, such as ``slider_ay_time_of_min``, shape (cycles,); or None."""
    dense: pd.DataFrame | None = _Frame()  # type: ignore[assignment]
    """The columns ``time`` and those of the reliability at more times than ``frame`` has; or None."""

    @classmethod
    def from_result(cls, result: Any) -> Self:
        """Convert the result of a model's ``simulate``, whatever its status; a `TableError` if it is none."""
        if fault := next(result_faults(result), ""):
            raise TableError(f"the model's {fault}")
        try:
            frame, events = (_arrays(part) for part in (result.columns, result.events))
        except ValueError as error:
            raise TableError(f"the model's columns are inconsistent: {error}") from error
        pulses = getattr(result, "pulses", None)
        return cls(
            frame,
            events if result.events else None,
            result.extrema,
            {**result.provenance, "status": result.status, "remedy": result.remedy},
            pulses=thin(pulses) if pulses and pulses["row"].size else None,
            cycle_extrema=getattr(result, "cycle_extrema", None) or None,
        )

    def __repr__(self) -> str:
        """Describe the table in a few lines, without its numbers."""
        head = " ".join(str(self.provenance[key]) for key in ("model", "status") if self.provenance.get(key))
        contacts = "" if self.events is None else f", {len(self.events)} contacts"
        text = f"{type(self).__name__}: {len(self.frame)} samples{contacts}{f' ({head})' if head else ''} of "
        return textwrap.fill(text + ", ".join(self.names), 100, max_lines=5)

    @property
    def definitions(self) -> dict[str, Channel]:
        """Definitions of all channels that the table may hold, by name."""
        return known_channels(self.provenance.get("scene") or {}) | self.overrides

    @property
    def time(self) -> Array:
        """Time, s, shape (n,)."""
        return self.values("time")

    @property
    def names(self) -> list[str]:
        """Names of all columns."""
        return [str(name) for name in self.columns]

    @property
    def columns(self) -> Mapping[Any, Any]:
        """Columns by name, as pandas' or as arrays."""
        return self.__dict__["frame"]  # type: ignore[no-any-return]

    @property
    def contacts(self) -> Mapping[Any, Any] | None:
        """Columns of the events by name, as pandas' or as arrays; None where the source has no events."""
        return self.__dict__["events"]  # type: ignore[no-any-return]

    @property
    def channels(self) -> list[str]:
        """Column names without ``time`` and without the estimated errors of channels."""
        return [name for name in self.names if name != "time" and not is_uncertainty(name)]

    @property
    def scene(self) -> Scene | None:
        """The scene recorded with the results; None without a valid one.

        Its solvers have the default settings: the model that wrote the table need not be installed here.
        """
        record = self.provenance.get("scene")
        if not isinstance(record, dict):
            return None
        criteria = {"reliability": self.provenance.get("reliability", {})}
        try:
            return scene_from_mapping(record | {"solver": {}} | criteria)
        except SceneError:
            return None

    def only(self, names: Sequence[str]) -> Self:
        """Return the time and these channels alone; channels that it lacks and its events are left out."""
        columns = ("time", *dict.fromkeys(names))
        frame = self.frame[[name for name in columns if name in self.frame]]
        return replace(self, frame=frame, events=None, pulses=None, dense=None)

    def values(self, channel: str) -> Array:
        """Return one column, shape (n,)."""
        return np.asarray(self.columns[channel], dtype=np.float64)

    def with_record(self, entries: Mapping[str, Any]) -> Self:
        """Return the table with these entries of its provenance."""
        table = copy(self)
        table.__dict__["provenance"] = self.provenance | dict(entries)
        return table


def _arrays(part: dict[str, Any]) -> Any:
    arrays = {name: np.asarray(column) for name, column in part.items()}
    shapes = {array.shape for array in arrays.values()}
    if [len(shape) for shape in shapes] not in ([], [1]):
        raise ValueError("all arrays must be of the same length, shape (n,)")
    return arrays


def check(
    table: Table, channels: Sequence[str], span: tuple[float, float] | None = None, *, name: str = "table"
) -> None:
    """Reject a table that does not permit a meaningful comparison, by a `TableError` that calls it ``name``.

    It must hold these channels (in any order, without ``time``) and no others, and have its first and last
    row at the ends of ``span`` (s), see `slacks`.
    """
    if fault := next(_faults(table, channels, span), ""):
        raise TableError(f"{name}: {fault}")


def slacks(*times: Array) -> tuple[float, float]:
    """Return the permitted distances, s, of the first times and of the last times of tables of one span.

    It is a fifth of the finest step there: a line continued by more is less exact than one between two rows.
    """
    rounding = 4 * float(max(np.spacing(np.abs(time).max()) for time in times))
    steps = [step[step > rounding] for step in map(np.diff, times)]  # not between two rows of an event
    first, last = (min((float(step[n]) for step in steps if step.size), default=0.0) for n in (0, -1))
    return max(0.2 * first, rounding), max(0.2 * last, rounding)


def _faults(table: Table, channels: Sequence[str], span: tuple[float, float] | None) -> Iterator[str]:
    if missing := [channel for channel in ("time", *channels) if channel not in table.names]:
        yield f"channel {missing[0]} is missing"
    if unexpected := [channel for channel in table.channels if channel not in channels]:
        yield f"channel {unexpected[0]} is unexpected"
    for channel in ("time", *channels):
        yield from _number_faults(channel, table.columns[channel])
    time = table.time
    if time.size < 2:
        yield f"{time.size} data rows; at least 2 are required"
    steps = np.diff(time)
    for n in _first(steps <= 0):
        yield f"time does not increase in data row {n + 2}: {time[n]!s} s, then {time[n + 1]!s} s"
    head, tail = slacks(time)
    if span is not None and (abs(time[0] - span[0]) > head or abs(time[-1] - span[1]) > tail):
        extent, limits = spans(float(time[0]), float(time[-1]), *span)
        yield f"truncated: it spans {extent} and must span {limits}"
    contacts = table.contacts
    count = 0 if contacts is None else rows(contacts)
    if contacts is not None and count:
        among = places(table.provenance.get("scene") or {})
        yield from _event_faults(contacts, among, time[[0, -1]], 0.5 * float(np.median(steps)))
    for name in ("pulses", "cycle_extrema"):
        yield from (f"its {fault}" for fault in _array_faults(name, getattr(table, name) or {}))
    row = (table.pulses or {"row": np.empty(0)})["row"]
    for n in _first((row < 0) | (row >= count)):
        yield f"its pulses: row {row[n]} is none of {count} events"


def rows(part: Mapping[Any, Any]) -> int:
    """Return the number of rows of columns."""
    return next((len(part[name]) for name in part), 0)


def _number_faults(channel: str, column: pd.Series | NDArray[Any]) -> Iterator[str]:
    bad = ~(np.abs(_numbers(column)) <= _LARGEST)
    bad = bad if bad.any() else np.full(bad.size, column.dtype.kind not in "fiu")
    for n in _first(bad):
        rule = f"must be a number of at most {_LARGEST:g} in size (such rows: {bad.sum()})"
        yield f"{channel} is {column.tolist()[n]!r} in data row {n + 1}, and {rule}"


def _event_faults(
    events: Mapping[Any, Any], among: Sequence[str], span: Array, slack: float
) -> Iterator[str]:
    begin, stop = span
    if missing := [column for column in ("corner", "start", "end", *_MEASURES) if column not in events]:
        yield f"its events have no column {missing[0]}"
    corners = events["corner"].tolist()
    for n in _first(np.array([corner not in among for corner in corners])):
        yield f"contact at {corners[n]!r}, which is none of {', '.join(among)}"
    columns = {name: _numbers(events[name]) for name in ("start", "end", *_MEASURES)}
    for name, values in columns.items():
        for n in _first(~np.isfinite(values) | ((values < 0.0) & (name in _MEASURES))):
            rule = "must be a number" + " >= 0" * (name in _MEASURES)
            yield f"{name} of contact {n + 1} {rule}, not {events[name].tolist()[n]!r}"
    start, end = columns["start"], columns["end"]
    for n in _first(end < start):
        yield f"contact {n + 1} ends at {end[n]!s} s, before its start at {start[n]!s} s"
    for n in _first((start < begin - slack) | (end > stop + slack)):
        interval, times = spans(float(start[n]), float(end[n]), begin, stop)
        yield f"contact {n + 1}, {interval}, is outside the times of the table, {times}"


def _numbers(column: pd.Series | NDArray[Any]) -> Array:
    """Return the values of a column, nan where one is not a number."""
    if isinstance(column, np.ndarray) and column.dtype.kind in "fiu":
        return np.asarray(column, dtype=np.float64)
    if column.dtype.kind == "b":  # pandas would count booleans as 0 and 1
        return np.full(len(column), np.nan)
    import pandas as pd

    return pd.to_numeric(pd.Series(column), errors="coerce").to_numpy(dtype=np.float64, na_value=np.nan)


def _first(bad: BoolArray) -> list[int]:
    """Return the first place that is bad, if one is."""
    return [int(n) for n in np.flatnonzero(bad)[:1]]


def result_faults(result: Any) -> Iterator[str]:
    """Yield the faults of a model's result (docs/engine.md): parts that are missing or of a wrong type."""
    for name, kind in _PARTS.items():
        part = getattr(result, name, None)
        if not isinstance(part, kind):
            yield f"result: {name} must be a {kind.__name__}, not {type(part).__name__}"
    for name in ("pulses", "cycle_extrema"):
        yield from (f"result: {fault}" for fault in _array_faults(name, getattr(result, name, None) or {}))
    for fault in record_faults({**result.provenance, "extrema": result.extrema}):
        yield f"extrema or provenance: {fault}"


def _array_faults(name: str, part: Any) -> Iterator[str]:
    """Yield the faults of pulses or cycle_extrema: no columns of numbers, or pulses not sorted."""
    if not isinstance(part, dict):
        yield f"{name} must be a dict or None, not {type(part).__name__}"
    for key, kind in (_PULSES if name == "pulses" and part else dict.fromkeys(part, "f")).items():
        column = part.get(key)
        if not isinstance(column, np.ndarray) or column.ndim != 1 or column.dtype.kind not in kind:
            what = "real numbers" if kind == "f" else "integers"
            yield f"{name}: {key} must be an array of {what}, shape (n,)"
    if len({column.size for column in part.values()}) > 1:
        yield f"{name}: columns differ in length"
    if name == "pulses" and part:
        for n in _first(~np.isfinite(part["time"] + part["force"])):
            yield f"pulses: time or force is not finite in sample {n + 1}"
        step = np.diff(part["row"].astype(np.int64))
        for n in _first((step < 0) | ((step == 0) & (np.diff(part["time"]) <= 0.0))):
            yield f"pulses: not sorted by row and time at sample {n + 2}"


def record_faults(record: object) -> Iterator[str]:
    """Yield the reasons why this is no record of a run, such as another program's file of that name.

    Only the entries that this package reads must have the expected type.
    """
    if not isinstance(record, Mapping):
        yield "must contain one JSON object"
        return
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
    try:
        json_text(record)
    except (TypeError, ValueError, RecursionError) as error:
        yield str(error)


def _is_number(value: object) -> bool:
    """Return whether a value is a number, or the null that replaces one that is not finite."""
    return value is None or (isinstance(value, int | float) and not isinstance(value, bool))


def thin(pulses: Columns) -> Columns:
    """Return the pulses with fewer samples of each long contact: its ends, and the extrema of equal parts.

    A short contact keeps all samples, a very long one the first ones too, which are its impact.
    """
    row, force = pulses["row"].astype(np.int64), pulses["force"].astype(np.float64)
    _, first, contact, counts = np.unique(row, return_index=True, return_inverse=True, return_counts=True)
    place, count = np.arange(row.size) - first[contact], counts[contact]
    parts = np.where(count <= _SAMPLES, count, np.where(count < _LONG, _SAMPLES // 2, 3 * _SAMPLES))
    mask = (place == count - 1) | (place < np.where(count < _LONG, 1, _SAMPLES))
    part = row * (3 * _SAMPLES) + place * parts // count
    starts = np.unique(part, return_index=True)[1]
    for values in (force, -force):
        mask[np.lexsort((values, part))[starts]] = True  # of equal ones the first
    columns = pulses | {"row": row, "time": pulses["time"].astype(np.float64), "force": force}
    return {name: column[mask] for name, column in columns.items()}
