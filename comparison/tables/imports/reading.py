"""Reading of tables of any origin as `Table`: which column is which channel.

The result has SI units and the names and signs of the channels; columns that are
no channels of the press are compared under their own names and in the tables' units.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Sequence
from collections.abc import Mapping as Pairs
from dataclasses import dataclass, field, replace
from pathlib import Path

import pandas as pd

from comparison.tables.channels import Channel, channels
from comparison.tables.imports.conversion import convert, prescribed, resolved
from comparison.tables.imports.mapping import TIME, Mapping, Quantity, Rule
from comparison.tables.imports.own_channels import Stated, check_rates, is_prose, own_channel
from comparison.tables.imports.source import open_source
from comparison.tables.imports.text import Column, Source, position
from comparison.tables.table import Table, TableError

_HINT = "a mapping file (--mapping) assigns columns to channels"


@dataclass(frozen=True)
class _Assigned:
    """A table's columns by channel."""

    source: Source
    columns: dict[str, Column]
    rules: dict[str, Rule]
    """By channel, of those that have one."""
    others: list[str] = field(default_factory=list)
    """Columns without a channel."""


def read_tables(
    paths: Sequence[Path], sides: Sequence[str], mapping: Mapping | None = None, at_events: str | None = None
) -> tuple[list[Table], tuple[str, ...]]:
    """Read the runs of two programs, native or not.

    Parameters
    ----------
    paths
        Files of any kind that `comparison.tables.imports.source` knows.
    sides
        Of each, which rules hold: "a" or "b".
    mapping
        Assigns columns to channels. Without one they have the name of a channel, or the same in all tables.
    at_events
        Which rows of one time are compared, see `comparison.tables.imports.conversion.resolved`.

    Returns
    -------
    tables
        In SI units; not yet checked.
    warnings
        What was left out or assumed.

    Raises
    ------
    TableError
        One line: file, column and rule.
    """
    mapping = mapping or Mapping()
    sources = [open_source(path) for path in paths]
    _refuse_missing_columns(sources, sides, mapping)
    assigned = _assign(sources, sides, mapping)
    completed = list(_complete(assigned, mapping))
    known = _definitions(assigned, mapping)
    warnings = [*_assumptions(sources, known), *completed]
    tables = []
    for one in assigned:
        if one.others:
            warnings.append(
                f"{one.source.path.name}: not compared, since the mapping leaves it out: "
                f"{', '.join(one.others)}"
            )
        tables.append(_convert_all(one, known, mapping, at_events))
    return tables, tuple(warnings)


def _assign(sources: Sequence[Source], sides: Sequence[str], mapping: Mapping) -> list[_Assigned]:
    """Assign the columns of all tables to channels: by rules, by name, else by one name in all tables."""
    rules = [mapping.of("a" if side == "a" else "b") for side in sides]
    assigned = [_by_rules(source, own, mapping) for source, own in zip(sources, rules, strict=True)]
    shared = set.intersection(*(set(one.others) for one in assigned))
    # A mapping that names columns leaves out the others, even if both tables have them.
    wanted = shared & set(mapping.compare or ()) if any(one.rules for one in assigned) else shared
    for one in assigned:
        for column in one.source.columns:
            if column.name in wanted:
                one.columns[column.name] = column
        others = [name for name in one.others if name not in wanted]
        lacking = [*others, *one.source.others]
        unknown = [name for name in lacking if name not in shared]
        if unknown and not one.rules and mapping.compare is None:
            raise TableError(
                f"{one.source.path}: {unknown[0]!r} is not a channel, nor a column of both tables; {_HINT}"
            )
        one.others[:] = lacking
        if mapping.compare is not None:
            left = [name for name in one.columns if name not in (TIME, *mapping.compare)]
            one.others.extend(name for name in left if one.columns.pop(name))
    return assigned


def _by_rules(source: Source, rules: Pairs[str, Rule], mapping: Mapping) -> _Assigned:
    assigned = _Assigned(source, {}, {})
    own = [rules.get(column.name) or rules.get(position(n)) for n, column in enumerate(source.columns)]
    time = None
    if TIME not in {rule.channel for rule in own if rule is not None}:
        time = _time(source)
    for column, rule in zip(source.columns, own, strict=True):
        channel = rule.channel if rule is not None else _channel(column.name, mapping)
        if rule is None and column.name == time:
            channel = TIME
        if channel is None:
            assigned.others.append(column.name)
        elif channel in assigned.columns:
            both = f"{assigned.columns[channel].name!r} and {column.name!r}"
            raise TableError(f"{source.path}: columns {both} are both the channel {channel}")
        else:
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
        found = prescribed(one.source.record, one.columns[TIME].numbers)
        added = {c.name: c for c in found if c.name in wanted and c.name not in one.columns}
        one.columns.update(added)
        if added:
            yield f"{one.source.path.name}: as its scene prescribes: {', '.join(added)}"


def _time(source: Source) -> str | None:
    """Return the name of the column that is the time for want of one that is called so."""
    if any(name.casefold() == TIME for name in source.names):
        return None
    if "t" in source.names:
        return "t"
    return source.names[0] if source.nameless else None


def _channel(name: str, mapping: Mapping) -> str | None:
    """Return the channel of a column without a rule, if any; case is ignored for ``time``."""
    if name.casefold() == TIME:
        return TIME
    return name if name in channels() or name in mapping.channels else None


def _definitions(assigned: Sequence[_Assigned], mapping: Mapping) -> dict[str, Channel]:
    """Return the channels of these tables that are not the press's, or have a scale of their own."""
    degrees = {one.source.degrees: one.source.path.name for one in assigned if one.source.degrees}
    if len(degrees) > 1:
        raise TableError(
            f"{degrees['yes']} is inDegrees=yes and {degrees['no']} inDegrees=no: export both alike"
        )
    names = dict.fromkeys(name for one in assigned for name in one.columns if name != TIME)
    defined = {}
    for name in names:
        quantity = mapping.channels.get(name, Quantity())
        if name in channels():
            if quantity.scale is not None:
                defined[name] = replace(channels()[name], given=quantity.scale)
            continue
        stated = [
            Stated(one.source.path.name, _stated_unit(one, name), one.columns[name].numbers)
            for one in assigned
            if name in one.columns
        ]
        defined[name] = own_channel(name, quantity, stated)
    check_rates(defined.values())
    return defined


def _stated_unit(one: _Assigned, name: str) -> str | None:
    rule = one.rules.get(name)
    return one.columns[name].unit if rule is None or rule.unit is None else rule.unit


def _assumptions(sources: Sequence[Source], known: Pairs[str, Channel]) -> Iterable[str]:
    for source in sources:
        if source.nameless:
            yield f"{source.path.name}: columns without names: the first is the time, others are numbered"
        for column in source.columns:
            if column.name in known and column.unit is not None and is_prose(column.unit):
                yield f"{source.path.name}: {column.unit!r} beside {column.name} is not a unit"
    if bare := [name for name, channel in known.items() if not channel.unit]:
        yield f"no unit is stated for {', '.join(bare)}: compared as numbers"


def _convert_all(
    one: _Assigned, known: Pairs[str, Channel], mapping: Mapping, at_events: str | None
) -> Table:
    converted, settings = {}, {}
    for name in (TIME, *(name for name in one.columns if name != TIME)):
        channel = None if name == TIME else known.get(name) or channels()[name]
        factor = mapping.channels[name].factor if name in mapping.channels else 1.0
        converted[name], settings[name] = convert(
            one.source.path, one.columns[name], channel, one.rules.get(name), factor
        )
    frame = resolved(pd.DataFrame(converted, copy=False), at_events, str(one.source.path))
    provenance = one.source.record
    if provenance is None or one.rules:
        provenance = {"formulation": f"taken from {one.source.path.name}", "settings": settings}
    own = {name: channel for name, channel in known.items() if name in one.columns}
    return Table(frame, one.source.events, one.source.extrema, provenance, own)


def _refuse_missing_columns(sources: Sequence[Source], sides: Sequence[str], mapping: Mapping) -> None:
    """Reject rules for missing columns: a misspelt name would leave a channel out."""
    names = [{*source.names, *map(position, range(len(source.names)))} for source in sources]
    for source, side, own in zip(sources, sides, names, strict=True):
        _refuse_missing(str(source.path), mapping.a if side == "a" else mapping.b, own, source.names)
    _refuse_missing(
        "either table", mapping.columns, set().union(*names), [n for s in sources for n in s.names]
    )
    every = {*channels(), *mapping.channels}.union(*(source.names for source in sources))
    for name in mapping.compare or ():
        if name not in every:
            raise TableError(f"mapping: compare: {name!r} is not a channel")


def _refuse_missing(where: str, rules: Pairs[str, Rule], names: set[str], shown: Sequence[str]) -> None:
    for name in rules:
        if name not in names:
            close = difflib.get_close_matches(name, shown, n=1)
            meant = (
                f"; did you mean {close[0]!r}?" if close else f"; columns: {', '.join(sorted(set(shown)))}"
            )
            raise TableError(f"mapping: column {name!r} is not in {where}{meant}")
