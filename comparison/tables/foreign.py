"""Tables of any origin as `Table`: which column is which channel, in SI units with the channels' signs.

What is no channel of the press is compared under its own name and in the tables' units.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Sequence
from collections.abc import Mapping as Pairs
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from comparison.tables.arrays import Array
from comparison.tables.channels import Channel, channels
from comparison.tables.dialect import Column, Source, position
from comparison.tables.formats import open_source
from comparison.tables.mapping import (
    TIME,
    Mapping,
    Quantity,
    Rule,
    Stated,
    check_rates,
    is_prose,
    own_channel,
)
from comparison.tables.table import Table, TableError
from comparison.tables.units import parse, same_dimension

AT_EVENTS = ("left", "right", "both")
"""Which rows of one time are compared: the first, the last, or these two."""
_HINT = "a mapping file (--mapping) assigns columns to channels"


@dataclass(frozen=True)
class _Assigned:
    """A table's columns by channel, the rules of those that have one, and columns without a channel."""

    source: Source
    columns: dict[str, Column] = field(default_factory=dict)
    rules: dict[str, Rule] = field(default_factory=dict)
    others: list[str] = field(default_factory=list)

    def unit(self, name: str) -> str | None:
        """Return the unit of a column by its rule, else as its table states it."""
        by_rule = self.rules[name].unit if name in self.rules else None
        return self.columns[name].unit if by_rule is None else by_rule


def read_tables(
    paths: Sequence[Path], sides: Sequence[str], mapping: Mapping | None = None, at_events: str | None = None
) -> tuple[list[Table], tuple[str, ...]]:
    """Read the runs of two programs, native or not, as tables that are not yet checked.

    Parameters
    ----------
    paths, sides
        Files of any kind that `comparison.tables.formats` knows; "a" or "b" for each, whose rules hold.
    mapping
        Assigns columns to channels. Without one they have the name of a channel, or the same in all tables.
    at_events
        Which of several rows at one time are compared (`AT_EVENTS`); with "both" the last one is moved to the
        next larger double. None: there must be none.

    Returns
    -------
    tables, warnings
        In SI units; what was left out or assumed.
    """
    mapping = mapping or Mapping()
    sources = [open_source(path) for path in paths]
    _refuse_missing(sources, sides, mapping)
    assigned = _assign(sources, sides, mapping)
    completed = list(_complete(assigned, mapping))
    known = _definitions(assigned, mapping)
    warnings = [*_assumptions(sources, known), *completed]
    tables = []
    for one in assigned:
        if one.others:
            reason = f"{one.source.path.name}: not compared, since the mapping leaves it out"
            warnings.append(f"{reason}: {', '.join(one.others)}")
        tables.append(_table(one, known, mapping, at_events))
    return tables, tuple(warnings)


def _refuse_missing(sources: Sequence[Source], sides: Sequence[str], mapping: Mapping) -> None:
    """Reject rules for missing columns: a misspelt name would leave a channel out."""
    every = [name for source in sources for name in source.names]
    most = max(len(source.names) for source in sources)
    checks = [
        (str(source.path), mapping.only(side), source.names, len(source.names))
        for source, side in zip(sources, sides, strict=True)
    ]
    for where, rules, shown, count in [*checks, ("either table", mapping.columns, every, most)]:
        for name in rules:
            if name not in shown and name not in map(position, range(count)):
                close = difflib.get_close_matches(name, shown, n=1)
                columns = f"columns: {', '.join(sorted(set(shown)))}"
                meant = f"did you mean {close[0]!r}?" if close else columns
                raise TableError(f"{mapping.file}: column {name!r} is not in {where}; {meant}")
    for name in mapping.compare or ():
        if name not in {*channels(), *mapping.channels, *every}:
            raise TableError(f"{mapping.file}: compare: {name!r} is not a channel")


def _assign(sources: Sequence[Source], sides: Sequence[str], mapping: Mapping) -> list[_Assigned]:
    """Assign the columns of all tables to channels: by rules, by name, else by one name in all tables."""
    assigned = [
        _by_rules(source, {**mapping.columns, **mapping.only(side)}, mapping)
        for source, side in zip(sources, sides, strict=True)
    ]
    shared = set.intersection(*(set(one.others) for one in assigned))
    # A mapping that names columns leaves out the others, even if both tables have them.
    wanted = shared & set(mapping.compare or ()) if any(one.rules for one in assigned) else shared
    for one in assigned:
        one.columns.update((column.name, column) for column in one.source.columns if column.name in wanted)
        lacking = [*(name for name in one.others if name not in wanted), *one.source.others]
        unknown = [name for name in lacking if name not in shared]
        if unknown and not one.rules and mapping.compare is None:
            raise TableError(
                f"{one.source.path}: {unknown[0]!r} is not a channel, nor a column of both tables; {_HINT}"
            )
        if mapping.compare is not None:
            left = [name for name in one.columns if name not in (TIME, *mapping.compare)]
            lacking += [name for name in left if one.columns.pop(name)]
        one.others[:] = lacking
    return assigned


def _by_rules(source: Source, rules: Pairs[str, Rule], mapping: Mapping) -> _Assigned:
    assigned = _Assigned(source)
    own = [rules.get(name) or rules.get(position(n)) for n, name in enumerate(source.names)]
    times = [name for name in source.names if name.casefold() == TIME]
    if not times and not any(rule and rule.channel == TIME for rule in own):
        first = source.names[:1] if source.nameless else []
        times = ["t"] if "t" in source.names else first
    for column, rule in zip(source.columns, own, strict=True):
        if rule is not None:
            channel = rule.channel
        elif column.name in times:
            channel = TIME
        elif column.name in channels() or column.name in mapping.channels:
            channel = column.name
        else:
            assigned.others.append(column.name)
            continue
        if channel in assigned.columns:
            both = f"{assigned.columns[channel].name!r} and {column.name!r}"
            raise TableError(f"{source.path}: columns {both} are both the channel {channel}")
        assigned.columns[channel] = column
        if rule is not None:
            assigned.rules[channel] = rule
    if TIME not in assigned.columns:
        names = ", ".join(sorted(source.names))
        raise TableError(f"{source.path}: channel time is missing; columns: {names}; {_HINT}")
    return assigned


def _complete(assigned: Sequence[_Assigned], mapping: Mapping) -> Iterable[str]:
    """Give tables of ours what their scenes prescribe, where another table has it; say so."""
    wanted = {name for one in assigned for name in one.columns}
    if mapping.compare is not None:
        wanted &= set(mapping.compare)
    for one in assigned:
        prescribed = _prescribed(one.source.record, one.columns[TIME].numbers)
        added = {c.name: c for c in prescribed if c.name in wanted - one.columns.keys()}
        one.columns.update(added)
        if added:
            yield f"{one.source.path.name}: as its scene prescribes: {', '.join(added)}"


def _prescribed(record: Pairs[str, Any] | None, time: Array) -> list[Column]:
    """Return crank angle and speed (rad, rad/s) of our table: its scene prescribes what no model writes."""
    scene: Any = (record or {}).get("scene")
    try:
        start = np.radians(float(scene["mechanism"]["crank_angle_deg"]))
        omega = float(scene["drive"]["speed_rpm"]) * np.pi / 30.0
    except (KeyError, TypeError, ValueError):  # of another program's record
        return []
    speed = np.full(time.shape, omega)
    return [Column("crank_angle", "rad", start + omega * time), Column("crank_speed", "rad/s", speed)]


def _definitions(assigned: Sequence[_Assigned], mapping: Mapping) -> dict[str, Channel]:
    """Return the channels of these tables that are not the press's, or have a scale of their own."""
    defined = {}
    for name in dict.fromkeys(name for one in assigned for name in one.columns if name != TIME):
        quantity = mapping.channels.get(name, Quantity())
        if name not in channels():
            holding = [one for one in assigned if name in one.columns]
            stated = [
                Stated(one.source.path.name, one.unit(name), one.columns[name].numbers) for one in holding
            ]
            defined[name] = own_channel(name, quantity, stated, mapping.file)
        elif quantity.scale is not None:
            defined[name] = replace(channels()[name], given=quantity.scale)
    check_rates(defined.values(), mapping.file)
    return defined


def _assumptions(sources: Sequence[Source], known: Pairs[str, Channel]) -> Iterable[str]:
    for source in sources:
        if source.nameless:
            yield f"{source.path.name}: columns without names: the first is the time, others are numbered"
        for column in source.columns:
            if column.name in known and column.unit is not None and is_prose(column.unit):
                yield f"{source.path.name}: {column.unit!r} beside {column.name} is not a unit"
    if bare := [name for name, channel in known.items() if not channel.unit]:
        yield f"no unit is stated for {', '.join(bare)}: compared as numbers"


def _table(one: _Assigned, known: Pairs[str, Channel], mapping: Mapping, at_events: str | None) -> Table:
    source, converted, settings = one.source, {}, {}
    for name in (TIME, *(name for name in one.columns if name != TIME)):
        channel = None if name == TIME else known.get(name) or channels()[name]
        converted[name], settings[name] = _converted(one, name, channel, mapping)
    frame = _resolved(pd.DataFrame(converted, copy=False), at_events, str(source.path))
    provenance = source.record
    if provenance is None or one.rules:
        provenance = {"formulation": f"taken from {source.path.name}", "settings": settings}
    own = {name: channel for name, channel in known.items() if name in one.columns}
    return Table(frame, source.events, source.extrema, provenance, own)


def _converted(one: _Assigned, name: str, channel: Channel | None, mapping: Mapping) -> tuple[Array, str]:
    """Return a column in its channel's unit (None: the time), and a description of the conversion."""
    column, rule = one.columns[name], one.rules.get(name, Rule(channel=name))
    where = f"{one.source.path}: column {column.name!r}"
    if column.text is not None:
        row, text = column.text
        hint = "" if channel is None else "; a mapping (--mapping) with compare = [...] leaves it out"
        raise TableError(f"{where} is not a number in data row {row}: {text!r}{hint}")
    wanted = "s" if channel is None else channel.unit
    own = channel is not None and name not in channels()
    stated = one.unit(name)
    if stated is None and name in one.rules and not own:
        raise TableError(f"{where} has no unit, neither in the table nor in the mapping")
    if stated is None or (own and parse(stated) is None):
        stated = wanted
    values = column.numbers if rule.sign == 1 else -column.numbers
    description = ("-" if rule.sign < 0 else "") + (f"{column.name} in {stated}" if stated else column.name)
    usual = mapping.channels.get(name, Quantity()).factor
    factor = usual if rule.factor is None else rule.factor
    if factor != 1:
        values, description = values * factor, f"{factor:g} {description}"
    if rule.offset:
        values, description = values + rule.offset, description + f" {rule.offset:+g}"
    unit, to = parse(stated), parse(wanted)
    in_table = parse(column.unit) if column.unit is not None else None
    if factor != 1 and unit == parse("1"):
        in_table, unit, stated = None, to, wanted  # the factor of a normalised column has the unit
    if stated != wanted or not own:
        if unit is None:
            raise TableError(f"{where}: unit {stated!r} is not known")
        if not same_dimension(unit, to):
            misfit = f"does not fit the channel {name}, which is in {wanted}"
            raise TableError(f"{where}: unit {stated!r} {misfit}")
    if in_table is not None and in_table != unit:
        raise TableError(f"{where}: the unit is {column.unit!r} in the table and {stated!r} in the mapping")
    return (values if unit is None or to is None else unit.convert(values, to)), description


def _resolved(frame: pd.DataFrame, at_events: str | None, name: str) -> pd.DataFrame:
    """Return the rows to compare: a program that locates events writes two rows of one time."""
    time = frame["time"].to_numpy()
    again = np.append(False, np.diff(time) == 0)
    if not again.any():
        return frame
    if at_events is None:
        row, count = int(again.argmax()), int(again.sum())
        raise TableError(
            f"{name}: time {time[row]!s} s is repeated in data row {row + 1} ({count} such "
            f"{'row' if count == 1 else 'rows'}): if these are events, say by --at-events which rows count: "
            f"{', '.join(AT_EVENTS)}"
        )
    first, last = ~again, np.append(~again[1:], True)
    kept = {"left": first, "right": last, "both": first | last}[at_events]
    rows: pd.DataFrame = frame[kept].reset_index(drop=True)
    if at_events == "both":
        times = time[kept]
        after = np.append(False, np.diff(times) == 0)
        rows["time"] = np.where(after, np.nextafter(times, np.inf), times)
    return rows
