"""Alignment of two tables on a common time grid."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from comparison.tables.arrays import Array, BoolArray
from comparison.tables.channels import Channel
from comparison.tables.resample import resample
from comparison.tables.table import Table, TableError
from comparison.tables.time_shift import SAME_GRID, Shift, estimate


@dataclass(frozen=True)
class Aligned:
    """Channels of both tables on a common grid.

    Attributes
    ----------
    time
        Common time, s, shape (n,).
    a, b
        Channel -> values, shape (n,).
    interpolated
        The interpolated table: ``""``, ``"a"`` or ``"b"``.
    unknown
        Channel -> where no samples determine its value, because a contact starts or ends nearby: shape (n,);
        only channels with such samples. The values there serve plotting only.
    shift
        Estimated time shift between the tables; not applied.
    """

    time: Array
    a: dict[str, Array]
    b: dict[str, Array]
    interpolated: str
    unknown: dict[str, BoolArray]
    shift: Shift


def align(a: Table, b: Table, names: list[str]) -> Aligned:
    """Align two checked tables on a common time grid.

    Identical grids are used unchanged. Otherwise the grid is that of the table with the longer mean interval,
    within the common span, and the other table is interpolated (`comparison.tables.resample`), piecewise
    between its own contact events, or the other table's if it has none. Angles are unwrapped first, and a
    whole number of revolutions between the two is removed from ``b``.

    Parameters
    ----------
    a, b
        Tables that passed `comparison.tables.table.check` for the channels ``names``.
    names
        Channels to align.

    Raises
    ------
    TableError
        If the tables have fewer than two common times.
    """
    known = a.known | b.known
    columns_a = {name: _continuous(a.values(name), known.get(name)) for name in names}
    columns_b = {name: _continuous(b.values(name), known.get(name)) for name in names}
    time_a, time_b = a.time, b.time
    unknown: dict[str, BoolArray] = {}
    slack = SAME_GRID * min(_interval(time_a), _interval(time_b))
    # Late times round coarsely: two programs that count them differently are a few last digits apart.
    slack = max(slack, 4 * float(np.spacing(np.abs(time_a).max())))
    if time_a.size == time_b.size and np.abs(time_a - time_b).max() <= slack:
        time, interpolated = time_a, ""
    elif _is_coarser(time_a, time_b):
        time, interpolated = _within(time_a, time_b), "b"
    else:
        time, interpolated = _within(time_b, time_a), "a"
    if interpolated:
        if time.size < 2:
            raise TableError(
                f"the tables have {time.size} common times: "
                f"{time_a[0]:g} to {time_a[-1]:g} s against {time_b[0]:g} to {time_b[-1]:g} s"
            )
        # The table that provides the grid is only truncated, at its own samples.
        if interpolated == "a":
            columns_a, unknown = resample(
                time_a, columns_a, time, b.events if a.events is None else a.events, known
            )
            columns_b = {name: np.interp(time, time_b, own) for name, own in columns_b.items()}
        else:
            columns_b, unknown = resample(
                time_b, columns_b, time, a.events if b.events is None else b.events, known
            )
            columns_a = {name: np.interp(time, time_a, own) for name, own in columns_a.items()}
    for name in names:
        channel = known.get(name)
        if channel is not None and channel.angle:
            turns = np.round((columns_a[name][0] - columns_b[name][0]) / channel.turn)
            if turns:
                columns_b[name] = columns_b[name] + channel.turn * turns
    shift = estimate(time, columns_a, columns_b, known)
    return Aligned(time, columns_a, columns_b, interpolated, unknown, shift)


def unwound(table: Table, like: Table) -> Table:
    """Return a table whose angles are continuous and start within half a revolution of another table's.

    One whose angles are so already, or are no numbers, is returned unchanged.
    """
    changed = {}
    for name in table.channels:
        channel = table.known.get(name)
        if channel is None or not channel.angle or name not in like.names:
            continue
        columns = [of.columns[name] for of in (table, like)]
        if not all(len(of) and of.dtype.kind in "fiu" and np.isfinite(of).all() for of in columns):
            continue
        values = _continuous(table.values(name), channel)
        values = values + channel.turn * np.round((like.values(name)[0] - values[0]) / channel.turn)
        if not np.array_equal(values, table.values(name)):
            changed[name] = values
    return replace(table, frame=table.frame.assign(**changed)) if changed else table


def _interval(time: Array) -> float:
    """Mean sample interval, s."""
    return float(time[-1] - time[0]) / (time.size - 1)


def _is_coarser(time: Array, other: Array) -> bool:
    """Whether a grid has the longer mean interval; of equal ones, whether it starts earlier."""
    if _interval(time) != _interval(other):
        return _interval(time) > _interval(other)
    common = min(time.size, other.size)
    ahead = np.flatnonzero(time[:common] != other[:common])
    return bool(time[ahead[0]] < other[ahead[0]]) if ahead.size else time.size > other.size


def _continuous(values: Array, channel: Channel | None) -> Array:
    """Unwrap an angle; one without jumps is returned unchanged (bit for bit)."""
    if channel is None or not channel.angle or np.abs(np.diff(values)).max() <= channel.turn / 2:
        return values
    return np.unwrap(values, period=channel.turn)


def _within(time: Array, other: Array) -> Array:
    """Return the times inside the other's span; an end outside by round-off is moved onto its end."""
    slack = SAME_GRID * _interval(time)
    inside = time[(time >= other[0] - slack) & (time <= other[-1] + slack)]
    clipped: Array = np.clip(inside, other[0], other[-1])
    return clipped
