"""Alignment of two tables on a common time grid."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from comparison.formatting import instant
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
    between its own contact events, or the other table's if it has none. Angles are unwrapped first, and
    whole revolutions between the two are removed at every sample, as the table with more samples turns.

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
    columns_a = {name: continuous(a.values(name), known[name]) for name in names}
    columns_b = {name: continuous(b.values(name), known[name]) for name in names}
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
            ends = time_a[0], time_a[-1], time_b[0], time_b[-1]
            start_a, end_a, start_b, end_b = (instant(end, *ends) for end in ends)
            raise TableError(
                f"the tables have {time.size} common times: {start_a} to {end_a} s against {start_b} to "
                f"{end_b} s"
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
        channel = known[name]
        if channel.angle:
            revolutions = np.round((columns_a[name][0] - columns_b[name][0]) / channel.turn)
            columns_b[name] = columns_b[name] + channel.turn * revolutions
            if interpolated == "b":  # it has more samples to tell how often it has turned
                columns_a[name] = turned(columns_a[name], columns_b[name], channel)
            else:
                columns_b[name] = turned(columns_b[name], columns_a[name], channel)
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
        values = continuous(table.values(name), channel)
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


def continuous(values: Array, channel: Channel) -> Array:
    """Unwrap an angle; one without jumps, or that always turns so far in a step, is returned unchanged."""
    steps = np.abs(np.diff(values))
    if not channel.angle or steps.max() <= channel.turn / 2 or np.median(steps) > channel.turn / 2:
        return values
    return np.unwrap(values, period=channel.turn)


def turned(values: Array, towards: Array, channel: Channel) -> Array:
    """Return an angle with whole revolutions added at each sample, so that it is close to another one."""
    revolutions = np.round((towards - values) / channel.turn)
    return values + channel.turn * revolutions if channel.angle and revolutions.any() else values


def _within(time: Array, other: Array) -> Array:
    """Return the times inside the other's span; an end outside by round-off is moved onto its end."""
    slack = SAME_GRID * _interval(time)
    inside = time[(time >= other[0] - slack) & (time <= other[-1] + slack)]
    clipped: Array = np.clip(inside, other[0], other[-1])
    return clipped
