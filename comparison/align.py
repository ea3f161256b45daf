"""Two tables on one time grid."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicHermiteSpline

from comparison.channels import Channel, channels
from comparison.table import Table, TableError

Array = NDArray[np.float64]

# Two grids are the same where their times differ by less than this share of a sample interval: what a text
# file of ten digits loses. At 2 m/s and 0.4 ms samples it is 1e-12 m.
SAME_GRID = 1e-9


@dataclass(frozen=True)
class Aligned:
    """Both tables' channels on a common grid.

    Attributes
    ----------
    time
        Common time, s, shape (n,).
    a, b
        Channel -> values, shape (n,).
    interpolated
        Which of the two was interpolated: ``""``, ``"a"`` or ``"b"``.
    """

    time: Array
    a: dict[str, Array]
    b: dict[str, Array]
    interpolated: str


def align(a: Table, b: Table, names: list[str]) -> Aligned:
    """Bring two checked tables onto a common time grid.

    Identical grids are used as they are. Otherwise the times of the table with the longer mean interval are
    taken, as far as both tables reach, and the other is interpolated: a position whose velocity the table
    holds by the cubic Hermite polynomial of both (error of order h^4), everything else linearly (h^2; a
    contact shorter than an interval cannot be recovered from samples). Angles are unwrapped first, and a
    whole number of turns between the two is taken out of ``b``.

    Parameters
    ----------
    a, b
        Tables that passed `comparison.table.check` for the channels ``names``.
    names
        The channels to align.

    Raises
    ------
    TableError
        If the tables have fewer than two common times.
    """
    known = channels()
    columns_a = {name: _continuous(a.values(name), known.get(name)) for name in names}
    columns_b = {name: _continuous(b.values(name), known.get(name)) for name in names}
    time_a, time_b = a.time, b.time
    interval = min(_interval(time_a), _interval(time_b))
    if time_a.size == time_b.size and np.abs(time_a - time_b).max() <= SAME_GRID * interval:
        time, interpolated = time_a, ""
    elif _interval(time_a) >= _interval(time_b):
        time, interpolated = _within(time_a, time_b), "b"
    else:
        time, interpolated = _within(time_b, time_a), "a"
    if interpolated:
        if time.size < 2:
            raise TableError(
                f"the tables have {time.size} common times: "
                f"{time_a[0]:g} to {time_a[-1]:g} s against {time_b[0]:g} to {time_b[-1]:g} s"
            )
        columns_a = _sampled(time_a, columns_a, time, hermite=interpolated == "a")
        columns_b = _sampled(time_b, columns_b, time, hermite=interpolated == "b")
    for name in names:
        channel = known.get(name)
        if channel is not None and channel.angle:
            turns = np.round((columns_a[name][0] - columns_b[name][0]) / (2 * np.pi))
            if turns:
                columns_b[name] = columns_b[name] + 2 * np.pi * turns
    return Aligned(time, columns_a, columns_b, interpolated)


def _interval(time: Array) -> float:
    """Mean sample interval, s."""
    return float(time[-1] - time[0]) / (time.size - 1)


def _continuous(values: Array, channel: Channel | None) -> Array:
    """Take the jumps by a turn out of an angle; leave it untouched (bit for bit) where it has none."""
    if channel is None or not channel.angle or np.abs(np.diff(values)).max() <= np.pi:
        return values
    return np.unwrap(values)


def _within(time: Array, other: Array) -> Array:
    """Return the times inside the other's span; an end that sticks out by round-off is moved onto its end."""
    slack = SAME_GRID * _interval(time)
    inside = time[(time >= other[0] - slack) & (time <= other[-1] + slack)]
    clipped: Array = np.clip(inside, other[0], other[-1])
    return clipped


def _sampled(time: Array, columns: dict[str, Array], at: Array, *, hermite: bool) -> dict[str, Array]:
    """Evaluate at other times; the table whose grid was taken is merely cut (linear, at its own nodes)."""
    known = channels()
    sampled = {}
    for name, values in columns.items():
        rate = known[name].rate if name in known else None
        if hermite and rate in columns:
            sampled[name] = CubicHermiteSpline(time, values, columns[rate])(at)
        else:
            sampled[name] = np.interp(at, time, values)
    return sampled
