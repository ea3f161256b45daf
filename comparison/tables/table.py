"""Result table of a run: its channels, events, extrema and provenance, and whether it can be compared."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Self

import numpy as np
import pandas as pd

from comparison.formatting import instant
from comparison.tables.arrays import Array
from comparison.tables.channels import CONTACTS, Channel, channels, is_uncertainty
from comparison.tables.result import (
    Columns,
    Result,
    cycle_faults,
    first,
    pulse_faults,
    result_faults,
    thinned,
)

_LARGEST = 1e30  # no quantity is larger in its unit; its square overflows not even in single precision
_LONGER = 1e-3  # share of a contact's duration by which its pulse may be outside
_MEASURES = ("normal_speed", "impulse", "peak_force", "largest_depth")


class TableError(ValueError):
    """Unusable table; the message is one line with file, channel and row."""


@dataclass(frozen=True)
class Table:
    """Results of a run."""

    frame: pd.DataFrame
    """``time`` (s) first, then one column per channel."""
    events: pd.DataFrame | None = None
    """One row per contact, or None where the source has no events."""
    extrema: dict[str, dict[str, float]] = field(default_factory=dict)
    """Channel -> min, time_of_min, max, time_of_max over integration steps, whatever the samples."""
    provenance: dict[str, Any] = field(default_factory=dict)
    """Model, settings and versions that produced the results."""
    own: dict[str, Channel] = field(default_factory=dict)
    """Definitions of the channels that are not the press's, or have a scale of their own."""
    pulses: Columns | None = None
    """Normal forces of the events in time (`comparison.tables.result`), or None where the source has none."""
    cycle_extrema: Columns | None = None
    """The extrema of each crank cycle, such as ``slider_ay_time_of_min``, shape (cycles,); or None."""

    @classmethod
    def from_result(cls, result: Result) -> Self:
        """Convert the result of a model's ``simulate``, whatever its status; a `TableError` if it is none."""
        if fault := next(result_faults(result), ""):
            raise TableError(f"the model's {fault}")
        try:
            frame = pd.DataFrame(result.columns)
            events = pd.DataFrame(result.events) if result.events else None
        except ValueError as error:
            raise TableError(f"the model's columns are inconsistent: {error}") from error
        pulses = getattr(result, "pulses", None)
        return cls(
            frame,
            events,
            result.extrema,
            {**result.provenance, "status": result.status, "remedy": result.remedy},
            pulses=thinned(pulses) if pulses and pulses["row"].size else None,
            cycle_extrema=getattr(result, "cycle_extrema", None) or None,
        )

    @property
    def known(self) -> dict[str, Channel]:
        """Definitions of all channels that the table may hold, by name."""
        return channels() | self.own

    @property
    def time(self) -> Array:
        """Time, s, shape (n,)."""
        return self.values("time")

    @property
    def names(self) -> list[str]:
        """Names of all columns."""
        return [str(name) for name in self.frame]

    @property
    def channels(self) -> list[str]:
        """Column names without ``time`` and without the estimated errors of channels."""
        return [name for name in self.names if name != "time" and not is_uncertainty(name)]

    def only(self, names: Sequence[str]) -> Self:
        """Return the time and these channels alone; those that it lacks are left out, and so are events."""
        wanted = ("time", *dict.fromkeys(names))
        frame = self.frame[[name for name in wanted if name in self.frame]]
        return replace(self, frame=frame, events=None, pulses=None)

    def values(self, channel: str) -> Array:
        """Return one column, shape (n,)."""
        return np.asarray(self.frame[channel], dtype=np.float64)


def check(
    table: Table, channels: Sequence[str], span: tuple[float, float] | None = None, *, name: str = "table"
) -> None:
    """Reject a table that does not permit a meaningful comparison, by a `TableError` that calls it ``name``.

    It must hold these channels (in any order, without ``time``) and no others, and reach the first and last
    time of ``span`` (s) within half a sample.
    """
    if fault := next(_faults(table, channels, span), ""):
        raise TableError(f"{name}: {fault}")


def _faults(table: Table, channels: Sequence[str], span: tuple[float, float] | None) -> Iterator[str]:
    missing = [channel for channel in ("time", *channels) if channel not in table.names]
    unexpected = [channel for channel in table.channels if channel not in channels]
    for names, fault in ((missing, "missing"), (unexpected, "unexpected")):
        if names:
            yield f"channel {names[0]} is {fault}{_and_more(names)}"
    # All at once, where it is sound: a look at each column alone takes as long as a short run.
    frame = table.frame if all(kind.kind in "fiu" for kind in table.frame.dtypes) else None
    if frame is None or not (np.abs(frame.to_numpy(dtype=np.float64)) <= _LARGEST).all():
        for channel in ("time", *channels):
            yield from _number_faults(channel, table.frame[channel])
    time = table.time
    if time.size < 2:
        yield f"{time.size} data rows; at least 2 are required"
    steps = np.diff(time)
    for n in first(steps <= 0):
        yield f"time does not increase in data row {n + 2}: {time[n]!s} s, then {time[n + 1]!s} s"
    slack = 0.5 * float(np.median(steps))
    if span is not None and (abs(time[0] - span[0]) > slack or abs(time[-1] - span[1]) > slack):
        yield (
            f"truncated: it spans {instant(time[0], span[0])} to {instant(time[-1], span[1])} s "
            f"and must span {instant(span[0], time[0])} to {instant(span[1], time[-1])} s"
        )
    events = pd.DataFrame({"start": [], "end": []}) if table.events is None else table.events
    if len(events):
        yield from _event_faults(events, time[0], time[-1], slack)
    if table.pulses is not None:
        yield from (f"its {fault}" for fault in pulse_faults(table.pulses))
        yield from (f"its pulses: {fault}" for fault in _faults_beside(events, table.pulses))
    yield from (f"its {fault}" for fault in cycle_faults(table.cycle_extrema or {}))


def _number_faults(channel: str, column: pd.Series) -> Iterator[str]:
    values = _numbers(column)
    bad = ~np.isfinite(values)
    if column.dtype.kind not in "fiu":
        row = int(bad.argmax()) if bad.size else 0
        text = str(column.iloc[row]) if len(column) else ""
        yield f"{channel} is not a number in data row {row + 1}: {text!r}"
    for n in first(bad):
        yield f"{channel} is {values[n]} in data row {n + 1} ({bad.sum()} such rows)"
    for n in first(np.abs(values) > _LARGEST):
        yield f"{channel} = {values[n]:g} in data row {n + 1} must be at most {_LARGEST:g} in size"


def _event_faults(events: pd.DataFrame, begin: float, stop: float, slack: float) -> Iterator[str]:
    if missing := [column for column in ("corner", "start", "end", *_MEASURES) if column not in events]:
        yield f"its events have no column {missing[0]}{_and_more(missing)}"
    for n in first(~events["corner"].isin(list(CONTACTS)).to_numpy()):
        yield f"contact at {events['corner'].tolist()[n]!r}, which is none of {', '.join(CONTACTS)}"
    columns = {name: _numbers(events[name]) for name in ("start", "end", *_MEASURES)}
    for name, values in columns.items():
        for n in first(~np.isfinite(values)):
            yield f"{name} of contact {n + 1} is not a number: {events[name].iloc[n]}"
        for n in first((values < 0.0) & (name in _MEASURES)):
            yield f"{name} = {values[n]:g} of contact {n + 1} must be >= 0"
    start, end = columns["start"], columns["end"]
    for n in first(end < start):
        yield f"contact {n + 1} ends at {end[n]!s} s, before its start at {start[n]!s} s"
    for n in first((start < begin - slack) | (end > stop + slack)):
        contact = f"contact {n + 1}, {instant(start[n], begin)} to {instant(end[n], stop)} s,"
        times = f"{instant(begin, start[n])} to {instant(stop, end[n])} s"
        yield f"{contact} is outside the times of the table, {times}"


def _faults_beside(events: pd.DataFrame, pulses: Columns) -> Iterator[str]:
    """Yield what is wrong with sound pulses beside these events."""
    row, time = pulses["row"], pulses["time"]
    start, end = _numbers(events["start"]), _numbers(events["end"])
    for n in first((row < 0) | (row >= start.size)):
        yield f"row {row[n]} is none of {start.size} events"
    start, end = start[row], end[row]
    slack = _LONGER * (end - start)
    for n in first((time < start - slack) | (time > end + slack)):
        yield f"{time[n]!s} s is outside contact {row[n] + 1}, {start[n]!s} to {end[n]!s} s"


def _numbers(column: pd.Series) -> Array:
    """Return the values of a column, nan where one is not a number."""
    if column.dtype.kind == "b":  # which pandas would count as 0 and 1
        return np.full(len(column), np.nan)
    return pd.to_numeric(column, errors="coerce").to_numpy(dtype=np.float64, na_value=np.nan)


def _and_more(names: Sequence[str]) -> str:
    return f" (and {len(names) - 1} more)" if len(names) > 1 else ""
