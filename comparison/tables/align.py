"""Two tables on one time grid: the coarser one's, at which the channels of the other are interpolated."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from comparison.formatting import instant
from comparison.tables.channels import CONTACTS, Array, BoolArray, Channel, channels
from comparison.tables.table import Table, TableError
from comparison.tables.times import SAME_GRID, Shift, estimate, hermite


@dataclass(frozen=True)
class Aligned:
    """Channels of both tables on a common grid."""

    time: Array
    a: dict[str, Array]
    b: dict[str, Array]
    interpolated: str  # the interpolated table: ``""``, ``"a"`` or ``"b"``
    unknown: dict[str, BoolArray]
    """Channel -> where no samples determine its value, if anywhere; that serves plotting only."""
    shift: Shift  # estimated time shift between the tables; not applied


def align(a: Table, b: Table, names: list[str]) -> Aligned:
    """Align two tables that passed `comparison.tables.table.check` for these channels.

    Of two grids that of the table with the longer mean interval counts, within the common span; the other one
    is interpolated between its own contacts, or the other table's if it has none. Whole revolutions between
    two angles are removed at every sample.
    """
    known, tables = a.known | b.known, {"a": a, "b": b}
    sides = {
        side: {name: continuous(table.values(name), known[name]) for name in names}
        for side, table in tables.items()
    }
    unknown: dict[str, BoolArray] = {}
    slack = SAME_GRID * min(_interval(a.time), _interval(b.time))
    # Late times round coarsely: two programs that count them differently are a few last digits apart.
    slack = max(slack, 4 * float(np.spacing(np.abs(a.time).max())))
    if a.time.size == b.time.size and np.abs(a.time - b.time).max() <= slack:
        time, fine = a.time, ""
    else:
        # Of equal intervals the grid that starts earlier is the coarser one, whichever table is the first.
        order = {side: (_interval(table.time), (-table.time).tolist()) for side, table in tables.items()}
        fine, coarse = sorted(order, key=lambda side: order[side])
        finer, coarser = tables[fine], tables[coarse]
        # An end outside the other's span by round-off is moved onto its end.
        first, last, slack = finer.time[0], finer.time[-1], SAME_GRID * _interval(coarser.time)
        inside = (coarser.time >= first - slack) & (coarser.time <= last + slack)
        time = np.clip(coarser.time[inside], first, last)
        if time.size < 2:
            ends = a.time[0], a.time[-1], b.time[0], b.time[-1]
            start_a, end_a, start_b, end_b = (instant(end, *ends) for end in ends)
            spans = f"{start_a} to {end_a} s against {start_b} to {end_b} s"
            raise TableError(f"the tables have {time.size} common times: {spans}")
        events = coarser.events if finer.events is None else finer.events
        sides[fine], unknown = resample(finer.time, sides[fine], time, events, known)
        # The table that provides the grid is only truncated, at its own samples.
        sides[coarse] = {name: np.interp(time, coarser.time, own) for name, own in sides[coarse].items()}
    # The side with more samples tells how often an angle has turned.
    turned, guide = ("a", "b") if fine == "b" else ("b", "a")
    for name in names:
        if known[name].angle:
            sides["b"][name] = _turned(sides["b"][name], sides["a"][name], known[name], at=0)
            sides[turned][name] = _turned(sides[turned][name], sides[guide][name], known[name])
    shift = estimate(time, sides["a"], sides["b"], known)
    return Aligned(time, sides["a"], sides["b"], fine, unknown, shift)


def unwound(table: Table, like: Table) -> Table:
    """Return a table whose angles are continuous and start within half a revolution of another table's."""
    changed = {}
    for name in table.channels:
        channel = table.known.get(name)
        if channel is None or not channel.angle or name not in like.names:
            continue
        columns = [each.frame[name] for each in (table, like)]
        if all(len(c) and c.dtype.kind in "fiu" and np.isfinite(c).all() for c in columns):
            values = table.values(name)
            turned = _turned(continuous(values, channel), like.values(name), channel, at=0)
            if not np.array_equal(turned, values):
                changed[name] = turned
    return replace(table, frame=table.frame.assign(**changed)) if changed else table


def cut(table: Table, start: float, end: float) -> Table:
    """Return the rows of a span of time (s), and the parts of contacts in it without their pulses."""
    frame = table.frame[(table.time >= start) & (table.time <= end)].reset_index(drop=True)
    events = table.events
    if events is not None:
        inside = events[(events["end"] >= start) & (events["start"] <= end)].reset_index(drop=True)
        events = inside.assign(start=inside["start"].clip(lower=start), end=inside["end"].clip(upper=end))
    return replace(table, frame=frame, events=events, pulses=None)


def moved(table: Table, by: float) -> Table:
    """Return a table whose times, those of its contacts included, are later by so many s."""
    events, pulses = table.events, table.pulses
    return replace(
        table,
        frame=table.frame.assign(time=table.time + by),
        events=None if events is None else events.assign(start=events["start"] + by, end=events["end"] + by),
        pulses=None if pulses is None else {**pulses, "time": pulses["time"] + by},
    )


def over_angle(table: Table, start: float, speed: float) -> Table:
    """Return a table whose ``time`` is a crank angle (rad) with the time (s) of that angle.

    The angle is ``start`` at time zero, but for whole revolutions, and turns at ``speed`` (rad/s), which is
    then no channel any more.
    """
    angle = table.time
    revolutions = np.round((start - angle[:1]) / (2 * np.pi))
    frame = table.frame.drop(columns="crank_speed", errors="ignore")
    return replace(table, frame=frame.assign(time=(angle + 2 * np.pi * revolutions - start) / speed))


def continuous(values: Array, channel: Channel) -> Array:
    """Unwrap an angle; one without jumps, or that always turns so far in a step, is returned unchanged."""
    steps = np.abs(np.diff(values))
    if not channel.angle or steps.max(initial=0.0) <= channel.turn / 2 or np.median(steps) > channel.turn / 2:
        return values
    return np.unwrap(values, period=channel.turn)


def _turned(values: Array, towards: Array, channel: Channel, at: int | slice = slice(None)) -> Array:
    """Return an angle with whole revolutions added that bring it close to another one, there or always."""
    revolutions = np.round((towards[at] - values[at]) / channel.turn)
    return values + channel.turn * revolutions if np.any(revolutions) else values


def _interval(time: Array) -> float:
    """Mean sample interval, s."""
    return float(time[-1] - time[0]) / (time.size - 1)


def resample(
    time: Array,
    columns: dict[str, Array],
    at: Array,
    events: pd.DataFrame | None,
    known: Mapping[str, Channel] | None = None,
) -> tuple[dict[str, Array], dict[str, BoolArray]]:
    """Interpolate channels at other times inside their span, and tell where no two samples determine them.

    Positions whose velocity is among the channels use the cubic of both (error of order h^4), all others
    lines (h^2). Forces and accelerations jump at the start and end of a contact: each interval between two
    such instants, which belong to the following one, is interpolated by itself, with lines to its ends.
    """
    known = channels() if known is None else known
    pairs: dict[str, tuple[NDArray[np.intp], BoolArray] | None] = {"": None}  # by the contacts of an interval
    sampled, unknown = {}, {}
    for name, values in columns.items():
        rate = known[name].rate if name in known else None
        place = _jumps_with(known[name]) if name in known else ""
        if place not in pairs:
            places = list(CONTACTS) if place == "all" else [place]
            own = None if events is None else events.loc[events["corner"].isin(places), ["start", "end"]]
            edges = np.empty(0) if own is None else np.unique(own.to_numpy(np.float64))
            edges = edges[(edges > time[0]) & (edges <= time[-1])]
            pairs[place] = _determining(time, at, edges) if edges.size else None
        if rate is not None and rate in columns:
            sampled[name], _ = hermite(time, values, columns[rate], at)
        elif (pair := pairs[place]) is None:
            sampled[name] = np.interp(at, time, values)
        else:
            first, undetermined = pair
            step = (values[first + 1] - values[first]) / (time[first + 1] - time[first])
            line = values[first] + step * (at - time[first])
            sampled[name] = np.where(at == time[-1], values[-1], line)
            if undetermined.any():
                unknown[name] = undetermined
    return sampled, unknown


def _jumps_with(channel: Channel) -> str:
    """Return the contact at whose events a channel jumps, "all" for any contact, "" if it is continuous."""
    if channel.name.startswith("corner_"):
        _, corner, quantity = channel.name.split("_")
        return corner if quantity in {"normal", "friction"} else ""
    return "all" if channel.group in {"accelerations", "joints"} else ""


def _determining(time: Array, at: Array, edges: Array) -> tuple[NDArray[np.intp], BoolArray]:
    """Return the first of the two samples that determine each instant, and where there are none."""
    own, wanted = (np.searchsorted(edges, instants, side="right") for instants in (time, at))
    last = time.size - 2
    here = np.clip(np.searchsorted(time, at, side="right") - 1, 0, last)
    first = np.full(at.shape, -1, dtype=np.intp)
    for offset in (0, -1, 1):  # the samples around, else the two before, else the two after
        pair = np.clip(here + offset, 0, last)
        fits = (first < 0) & (own[pair] == wanted) & (own[pair + 1] == wanted)
        first[fits] = pair[fits]
    outside: BoolArray = (first < 0) & (time[here] != at) & (at != time[-1])
    # At a sample the value is known regardless of its neighbours.
    first = np.where((time[here] == at) | (first < 0), here, first)
    return first, outside
