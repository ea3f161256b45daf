"""Validation of tables before a comparison."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from comparison.formatting import instant
from comparison.tables.arrays import Array
from comparison.tables.channels import CONTACTS
from comparison.tables.columns import check_cycle_extrema
from comparison.tables.pulses import check_pulses
from comparison.tables.table import Table, TableError

if TYPE_CHECKING:
    import pandas as pd

LARGEST_NUMBER = 1e30
"""No quantity is larger in its unit. Its square does not overflow, nor does it in single precision."""
_LONGER = 1e-3  # share of a contact's duration by which its pulse may be outside
_EVENTS = ("corner", "start", "end", "normal_speed", "impulse", "peak_force", "largest_depth")


def check(
    table: Table, channels: Sequence[str], span: tuple[float, float] | None = None, *, name: str = "table"
) -> None:
    """Reject a table that does not permit a meaningful comparison.

    Parameters
    ----------
    table
        Table to check.
    channels
        Required channels (no others are allowed), in any order, without ``time``.
    span
        First and last time (s) that it must reach, within half a sample; None: any.
    name
        Name of the table in messages.

    Raises
    ------
    TableError
        With the channel and the first invalid row (data rows are counted from 1, without the header), or the
        contact.
    """
    missing = [channel for channel in ("time", *channels) if channel not in table.names]
    if missing:
        raise TableError(f"{name}: channel {missing[0]} is missing{_and_more(missing)}")
    unexpected = [channel for channel in table.channels if channel not in channels]
    if unexpected:
        raise TableError(f"{name}: channel {unexpected[0]} is unexpected{_and_more(unexpected)}")
    # All at once: a look at each column alone takes as long as a short run.
    for channel in () if _is_sound(table) else ("time", *channels):
        column = table.frame[channel]
        values = _numbers(column)
        bad = np.flatnonzero(~np.isfinite(values))
        if column.dtype.kind not in "fiu":
            row = int(bad[0]) if bad.size else 0
            text = str(column.iloc[row]) if len(column) else ""
            raise TableError(f"{name}: {channel} is not a number in data row {row + 1}: {text!r}")
        if bad.size:
            raise TableError(
                f"{name}: {channel} is {values[bad[0]]} in data row {bad[0] + 1} ({bad.size} such rows)"
            )
        if (large := np.flatnonzero(np.abs(values) > LARGEST_NUMBER)).size:
            raise TableError(
                f"{name}: {channel} = {values[large[0]]:g} in data row {large[0] + 1} must be at most "
                f"{LARGEST_NUMBER:g} in size"
            )
    time = table.time
    if time.size < 2:
        raise TableError(f"{name}: {time.size} data rows; at least 2 are required")
    steps = np.diff(time)
    back = np.flatnonzero(steps <= 0)
    if back.size:
        raise TableError(
            f"{name}: time does not increase in data row {back[0] + 2}: "
            f"{time[back[0]]!s} s, then {time[back[0] + 1]!s} s"
        )
    if span is not None:
        slack = 0.5 * float(np.median(steps))
        if abs(time[0] - span[0]) > slack or abs(time[-1] - span[1]) > slack:
            raise TableError(
                f"{name}: truncated: it spans {instant(time[0], span[0])} to {instant(time[-1], span[1])} s "
                f"and must span {instant(span[0], time[0])} to {instant(span[1], time[-1])} s"
            )
    contacts = table.contacts
    if contacts is not None and any(column.size for column in contacts.values()):
        _check_events(contacts, time, name)
    if table.pulses is not None:
        _check_pulses(table.pulses, contacts or {"start": np.zeros(0), "end": np.zeros(0)}, name)
    if table.cycle_extrema is not None:
        try:
            check_cycle_extrema(table.cycle_extrema)
        except ValueError as error:
            raise TableError(f"{name}: its {error}") from None


def _check_events(events: Mapping[str, NDArray[Any]], time: Array, name: str) -> None:
    if missing := [column for column in _EVENTS if column not in events]:
        raise TableError(f"{name}: its events have no column {missing[0]}{_and_more(missing)}")
    if unknown := [place for place in dict.fromkeys(events["corner"].tolist()) if place not in CONTACTS]:
        raise TableError(f"{name}: contact at {unknown[0]!r}, which is none of {', '.join(CONTACTS)}")
    for column in _EVENTS[1:]:
        values = _numbers(events[column])
        if (bad := np.flatnonzero(~np.isfinite(values))).size:
            raise TableError(
                f"{name}: {column} of contact {bad[0] + 1} is not a number: {events[column][bad[0]]}"
            )
        if column not in ("start", "end") and (bad := np.flatnonzero(values < 0.0)).size:
            raise TableError(f"{name}: {column} = {values[bad[0]]:g} of contact {bad[0] + 1} must be >= 0")
    start, end = _numbers(events["start"]), _numbers(events["end"])
    if (bad := np.flatnonzero(end < start)).size:
        raise TableError(
            f"{name}: contact {bad[0] + 1} ends at {end[bad[0]]!s} s, before its start at {start[bad[0]]!s} s"
        )
    slack = 0.5 * float(np.median(np.diff(time)))
    if (bad := np.flatnonzero((start < time[0] - slack) | (end > time[-1] + slack))).size:
        raise TableError(
            f"{name}: contact {bad[0] + 1}, {instant(start[bad[0]], time[0])} to "
            f"{instant(end[bad[0]], time[-1])} s, is outside the times of the table, "
            f"{instant(time[0], start[bad[0]])} to {instant(time[-1], end[bad[0]])} s"
        )


def _check_pulses(pulses: Mapping[str, NDArray[Any]], events: Mapping[str, NDArray[Any]], name: str) -> None:
    try:
        check_pulses(pulses)
    except ValueError as error:
        raise TableError(f"{name}: its {error}") from None
    row, time = pulses["row"], pulses["time"]
    start, end = _numbers(events["start"]), _numbers(events["end"])
    if (bad := np.flatnonzero((row < 0) | (row >= start.size))).size:
        raise TableError(f"{name}: its pulses: row {row[bad[0]]} is none of {start.size} events")
    slack = _LONGER * (end - start)[row]
    if (bad := np.flatnonzero((time < start[row] - slack) | (time > end[row] + slack))).size:
        contact = row[bad[0]]
        raise TableError(
            f"{name}: its pulses: {time[bad[0]]!s} s is outside contact {contact + 1}, "
            f"{start[contact]!s} to {end[contact]!s} s"
        )


def _is_sound(table: Table) -> bool:
    """Return whether a table holds nothing but numbers of a size that a quantity has."""
    columns = table.columns
    if isinstance(columns, dict):
        parts = list(columns.values())
    elif all(kind.kind in "fiu" for kind in columns.dtypes):
        parts = [columns.to_numpy(dtype=np.float64)]
    else:
        return False
    # Not where one is nan.
    return all(part.dtype.kind == "f" and bool((np.abs(part) <= LARGEST_NUMBER).all()) for part in parts)


def _numbers(column: NDArray[Any] | pd.Series) -> Array:
    """Return the values of a column, nan where one is not a number."""
    if column.dtype.kind == "b":  # which pandas would count as 0 and 1
        return np.full(len(column), np.nan)
    if column.dtype.kind in "fiu":
        return np.asarray(column, dtype=np.float64)
    import pandas as pd

    return pd.to_numeric(pd.Series(column), errors="coerce").to_numpy(dtype=np.float64)


def _and_more(names: Sequence[str]) -> str:
    return f" (and {len(names) - 1} more)" if len(names) > 1 else ""
