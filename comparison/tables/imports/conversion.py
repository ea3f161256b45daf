"""From a column as it stands in a file to the numbers of its channel: unit, sign, rows of one time."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from comparison.tables.arrays import Array
from comparison.tables.channels import Channel, channels
from comparison.tables.imports.mapping import TIME, Rule
from comparison.tables.imports.text import Column
from comparison.tables.imports.units import parse
from comparison.tables.table import TableError

AT_EVENTS = ("left", "right", "both")
"""Which rows of one time are compared."""


def convert(
    path: Path, column: Column, channel: Channel | None, rule: Rule | None, factor: float
) -> tuple[Array, str]:
    """Return a column in its channel's unit (None: the time), and a description of the conversion.

    Raises
    ------
    TableError
        If it holds text, or its unit is unknown, has the wrong dimension, or is missing for a column with a
        rule.
    """
    where = f"{path}: column {column.name!r}"
    if column.text is not None:
        row, text = column.text
        hint = "" if channel is None else "; a mapping (--mapping) with compare = [...] leaves it out"
        raise TableError(f"{where} is not a number in data row {row}: {text!r}{hint}")
    name, wanted = (TIME, "s") if channel is None else (channel.name, channel.unit)
    own = channel is not None and name not in channels()
    stated = column.unit if rule is None or rule.unit is None else rule.unit
    if stated is None and rule is not None and not own:
        raise TableError(f"{where} has no unit, neither in the table nor in the mapping")
    if stated is None or (own and parse(stated) is None):
        stated = wanted
    values = column.numbers
    description = f"{column.name} in {stated}" if stated else column.name
    if rule is not None:
        factor = factor if rule.factor is None else rule.factor
        values = values if rule.sign == 1 else -values
        description = ("-" if rule.sign < 0 else "") + description
    if factor != 1:
        values, description = values * factor, f"{factor:g} {description}"
    if rule is not None and rule.offset:
        values, description = values + rule.offset, description + f" {rule.offset:+g}"
    unit, kind = parse(stated), parse(wanted)
    other = parse(column.unit) if column.unit is not None else None
    if factor != 1 and unit == parse("1"):
        other, unit, stated = None, kind, wanted  # the factor of a normalised column has the unit
    if stated != wanted or not own:
        if unit is None:
            raise TableError(f"{where}: unit {stated!r} is not known")
        if kind is None or unit.powers != kind.powers:
            raise TableError(
                f"{where}: unit {stated!r} does not fit the channel {name}, which is in {wanted}"
            )
    if other is not None and other != unit:
        raise TableError(f"{where}: the unit is {column.unit!r} in the table and {stated!r} in the mapping")
    return (values if unit is None or kind is None else unit.over(kind).to_si(values)), description


def prescribed(record: Mapping[str, Any] | None, time: ArrayLike) -> list[Column]:
    """Return crank angle and speed (rad, rad/s) of our table: its scene prescribes what no model writes.

    Parameters
    ----------
    record
        Provenance of the table; without a scene the list is empty.
    time
        s, shape (n,).
    """
    scene: Any = (record or {}).get("scene")
    try:
        start, speed = scene["mechanism"]["crank_angle_deg"], scene["drive"]["speed_rpm"]
        start, omega = np.radians(float(start)), float(speed) * np.pi / 30.0
    except (KeyError, TypeError, ValueError):  # of another program's record
        return []
    time = np.asarray(time, dtype=np.float64)
    return [
        Column("crank_angle", "rad", start + omega * time),
        Column("crank_speed", "rad/s", np.full(time.shape, omega)),
    ]


def resolved(frame: pd.DataFrame, at_events: str | None, name: str) -> pd.DataFrame:
    """Return the rows to compare: a program that locates events writes two rows of one time.

    Parameters
    ----------
    frame
        With ``time`` in s.
    at_events
        Of the rows of one time "left" keeps the first, "right" the last, "both" these two: the last one at
        the next larger number. None: there must be none.
    name
        Of the table, in messages.

    Raises
    ------
    TableError
        If times are repeated and ``at_events`` is None.
    """
    time = frame["time"].to_numpy()
    again = np.append(False, np.diff(time) == 0)
    if not again.any():
        return frame
    if at_events is None:
        row = int(again.argmax())
        count = int(again.sum())
        raise TableError(
            f"{name}: time {time[row]!s} s is repeated in data row {row + 1} ({count} such "
            f"{'row' if count == 1 else 'rows'}): if these are events, say by --at-events which rows count: "
            f"{', '.join(AT_EVENTS)}"
        )
    first = ~again
    last = np.append(~again[1:], True)
    kept = {"left": first, "right": last, "both": first | last}[at_events]
    rows: pd.DataFrame = frame[kept].reset_index(drop=True)
    if at_events == "both":
        times = time[kept]
        after = np.append(False, np.diff(times) == 0)
        rows["time"] = np.where(after, np.nextafter(times, np.inf), times)
    return rows
