"""Conversion of other programs' tables to `Table`.

All conversions happen here: the result has SI units and the names and signs of the channels.
"""

from __future__ import annotations

import difflib
from collections.abc import Mapping as Pairs
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from comparison.tables.channels import channels
from comparison.tables.imports.exports import Column, layout, read_columns
from comparison.tables.imports.mapping import TIME, Mapping, Rule
from comparison.tables.imports.units import parse
from comparison.tables.table import FORMATS, Table, TableError, read, read_events, read_frame

_TEXT = (".csv", ".txt", ".tab", ".tsv", ".dat")
_NO_RULES = Mapping()
_HINT = "a mapping file (--mapping) assigns columns to channels"


def read_pair(a: Path, b: Path, mapping: Mapping | None = None) -> tuple[Table, Table, tuple[str, ...]]:
    """Read two tables, each native or from another program.

    Parameters
    ----------
    a, b
        CSV, text, Parquet or .mat files.
    mapping
        For tables that are not native. None: every column must have the name of a channel.

    Returns
    -------
    a, b
        In SI units; not yet checked.
    warnings
        Columns that were left out.

    Raises
    ------
    TableError
        One line: file, column and rule.
    """
    mapping = mapping or _NO_RULES
    tables: list[Table] = []
    warnings: list[str] = []
    found: set[str] = set()
    for path, rules in ((a, mapping.of("a")), (b, mapping.of("b"))):
        table, names, left = _read(path, rules)
        found |= names
        if mapping.compare is not None:
            wanted = [name for name in table.frame if name == TIME or name in mapping.compare]
            left += [name for name in table.channels if name not in wanted]
            table = Table(table.frame[wanted], table.events, table.extrema, table.provenance)
        if left:
            warnings.append(f"{path.name}: not compared, since the mapping leaves it out: {', '.join(left)}")
        tables.append(table)
        _refuse_missing(str(path), (mapping.a, mapping.b)[len(tables) - 1], names)
    _refuse_missing("either table", mapping.columns, found)
    return tables[0], tables[1], tuple(warnings)


def _read(path: Path, rules: Pairs[str, Rule]) -> tuple[Table, set[str], list[str]]:
    """Return a table, the names of its columns in the file, and those that are left out."""
    ending = path.suffix.lower()
    others: list[str] = []
    if ending == ".mat":
        from comparison.tables.imports.matlab import read_mat

        columns, others = read_mat(path)
    elif ending == ".parquet":
        frame = read_frame(path)
        if TIME in frame and not rules.keys() & set(frame):
            return read(path), {str(name) for name in frame}, []
        columns = [Column(str(name), None, frame[name].to_numpy(dtype=np.float64)) for name in frame]
    elif ending in _TEXT:
        how = layout(path)
        if how is None or (how.plain and TIME in how.names and not rules.keys() & set(how.names)):
            if ending in FORMATS:
                table = read(path)
                return table, {TIME, *table.channels}, []
            raise TableError(f"{path}: contains no row of two or more numbers")
        columns = read_columns(path, how)
    else:
        raise TableError(f"{path}: the name must end in {', '.join((*_TEXT, '.parquet'))} or .mat")
    names = {column.name for column in columns}
    mapped = bool(names & rules.keys())
    taken: dict[str, Column] = {}
    for column in columns:
        channel = rules[column.name].channel if column.name in rules else _channel(column.name)
        if channel is None:
            others.append(column.name)
        elif channel in taken:
            both = f"{taken[channel].name!r} and {column.name!r}"
            raise TableError(f"{path}: columns {both} are both the channel {channel}")
        else:
            taken[channel] = column
    if others and not mapped:
        raise TableError(f"{path}: {others[0]!r} is not a channel; {_HINT}")
    if TIME not in taken:
        raise TableError(f"{path}: channel time is missing; columns: {', '.join(sorted(names))}; {_HINT}")
    converted, settings = {}, {}
    for channel in (TIME, *(name for name in taken if name != TIME)):
        column = taken[channel]
        converted[channel], settings[channel] = _convert(path, column, channel, rules.get(column.name))
    provenance = {"formulation": f"taken from {path.name}", "settings": settings}
    return Table(pd.DataFrame(converted, copy=False), read_events(path), {}, provenance), names, others


def _channel(name: str) -> str | None:
    """Return the channel of a column without a rule, if any; case is ignored for ``time``."""
    if name.lower() == TIME:
        return TIME
    return name if name in channels() else None


def _convert(path: Path, column: Column, channel: str, rule: Rule | None) -> tuple[NDArray[np.float64], str]:
    """Return a column in SI units, and a description of the conversion.

    Raises
    ------
    TableError
        If its unit is unknown, has the wrong dimension, or is missing for a column with a rule.
    """
    where = f"{path}: column {column.name!r}"
    wanted = "s" if channel == TIME else channels()[channel].unit
    stated = column.unit if rule is None or rule.unit is None else rule.unit
    if stated is None and rule is not None:
        raise TableError(f"{where} has no unit, neither in the table nor in the mapping")
    stated = wanted if stated is None else stated
    unit, kind = parse(stated), parse(wanted)
    if unit is None:
        raise TableError(f"{where}: unit {stated!r} is not known")
    if kind is None or unit.powers != kind.powers:
        raise TableError(f"{where}: unit {stated!r} does not fit the channel {channel}, which is in {wanted}")
    other = parse(column.unit) if column.unit is not None else None
    if other is not None and other != unit:
        raise TableError(f"{where}: the unit is {column.unit!r} in the table and {stated!r} in the mapping")
    values = column.numbers
    reported = f"{column.name} in {stated}"
    if rule is not None:
        values = values if rule.sign == 1 else -values
        values = values if rule.offset == 0 else values + rule.offset
        reported = ("-" if rule.sign < 0 else "") + reported + (f" {rule.offset:+g}" if rule.offset else "")
    return unit.to_si(values), reported


def _refuse_missing(where: str, rules: Pairs[str, Rule], names: Sequence[str] | set[str]) -> None:
    """Reject rules for missing columns: a misspelt name would leave a channel out."""
    for name in rules:
        if name not in names:
            close = difflib.get_close_matches(name, list(names), n=1)
            meant = f"; did you mean {close[0]!r}?" if close else f"; columns: {', '.join(sorted(names))}"
            raise TableError(f"mapping: column {name!r} is not in {where}{meant}")
