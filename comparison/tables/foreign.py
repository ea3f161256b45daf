"""Tables of any origin as `Table`: which column is which channel, in SI units with the channels' signs.

A column that is no channel of the press is compared under its name and in the tables' units.
"""

import io
import math
import re
import subprocess
import sys
import warnings
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from pandas.api.types import is_number

from comparison.files import check_size
from comparison.tables import table_files
from comparison.tables.channels import Array, Channel, channels, is_uncertainty
from comparison.tables.dialect import (
    MAPPING,
    NUMBER,
    Column,
    Source,
    decode,
    parse_text,
    position,
    read_column,
    remedy,
)
from comparison.tables.mapping import TIME, Dialect, Mapping, Quantity, Rule
from comparison.tables.table import Table, TableError
from comparison.tables.units import parse_unit, same_dimension

# ---- files, recognised by their first bytes, not by their ending

_HEAD = 1024  # bytes in which text has no zero byte
_LARGEST_TEXT = 400_000_000  # bytes: read line by line it takes twenty times as much memory
_REFUSALS = {
    b"MATLAB 7.3 MAT-file": "is of MATLAB's version 7.3 (HDF5): save it with the option -v7",
    b"\xd0\xcf\x11\xe0": "is a workbook of Excel before 2007, or one with a password: save its sheet as .csv",
    b"\x89HDF": "is an HDF5 file: export its columns as CSV, with their names in the first line",
}
_BINARY = "is a binary file: let the program write text or CSV (of OpenFAST OutFileFmt = 1)"
_EXPORT = "save its sheet as CSV"


def open_source(path: Path, dialect: Dialect | None = None) -> Source:
    """Read a file; the `TableError` for an unsupported kind says how to export the table."""
    with table_files.readable(path):
        check_size(path, table_files.LARGEST)
        with path.open("rb") as file:
            head = file.read(_HEAD)
        source = _source(path, head, dialect or Dialect())
    columns = [each for each in source.columns if not is_uncertainty(each.name)]
    records = ["record", "cycle_extrema"] * (path.suffix.lower() in table_files.FORMATS)
    companions = table_files.read_companions(path, ["events", "pulses", *records], source.notes)
    return replace(source, columns=columns, companions=companions)


def _source(path: Path, head: bytes, dialect: Dialect) -> Source:
    if rule := next((rule for start, rule in _REFUSALS.items() if head.startswith(start)), ""):
        raise TableError(rule)
    if head.startswith(b"PAR1"):
        frame = table_files.read_parquet(path)
        return Source(path, [read_column(str(name), None, frame[name]) for name in frame])
    if head.startswith(b"PK\x03\x04"):
        cells = {"separator": "\t", "decimal": ".", "thousands": None, "comment": dialect.comment or ""}
        return parse_text(path, _sheet(path), dialect.model_copy(update=cells))
    # Of MATLAB's files version 4 has no signature, but zero bytes; Octave writes text to .mat as well.
    if head.startswith(b"MATLAB 5.0 MAT-file") or (path.suffix.lower() == ".mat" and b"\0" in head):
        return Source(path, *_vectors(path))
    if b"\0" in head and not head.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise TableError(_BINARY)
    check_size(path, _LARGEST_TEXT)
    return parse_text(path, decode(path.read_bytes()), dialect)


def _sheet(path: Path) -> str:
    """Return the text of the only sheet of a workbook with a table; a formula counts by its stored value."""
    options: dict[str, Any] = {"header": None, "dtype": object, "na_filter": False, "engine": "openpyxl"}
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # warnings of styles and extensions do not matter
            sheets = pd.read_excel(path, sheet_name=None, **options)
    except ImportError as error:
        extra = "pip install 'sixbar-crossval[excel]'"
        raise TableError(f"is an Excel workbook: {extra} to read it, or {_EXPORT}") from error
    # Of a damaged file the parsers of ZIP, XML and cells raise errors of many kinds.
    except Exception as error:
        raise TableError(f"is not a readable .xlsx workbook: {_EXPORT}") from error
    tables = {name: each for name, each in sheets.items() if (each.map(is_number).sum(axis=1) > 1).any()}
    if len(tables) != 1:
        names = " and ".join(map(repr, tables)) or "none"
        raise TableError(f"of its sheets {names} hold rows of two or more numbers: save one table per file")
    (table,) = tables.values()
    return str(table.map(_cell_text).to_csv(sep="\t", header=False, index=False))


def _cell_text(cell: object) -> str:
    """Return a cell as text; a text that looks like a number gets an apostrophe in front, as in Excel."""
    text = re.sub(r"[\r\n\0]+", " ", str(cell))
    return f"'{text}" if isinstance(cell, str) and NUMBER.fullmatch(text.strip()) else text


def _vectors(path: Path) -> tuple[list[Column], list[str]]:
    """Return the real vectors of a MATLAB file, and descriptions of its other contents."""
    # -P: do not import a module of the same name from the working directory.
    reader = [sys.executable, "-P", "-m", "comparison.tables.matlab", str(path), str(4 * table_files.LARGEST)]
    process = subprocess.run(reader, capture_output=True, check=False)
    if process.returncode != 0:
        raise TableError("is not a readable .mat file")
    names, others, *vectors = np.load(io.BytesIO(process.stdout), allow_pickle=False).values()
    for name, vector in zip(names, vectors, strict=True):
        if vector.size != vectors[0].size:
            raise TableError(f"{names[0]} holds {vectors[0].size} numbers and {name} {vector.size}")
    columns = [Column(str(name), None, vector) for name, vector in zip(names, vectors, strict=True)]
    return columns, others.tolist()


# ---- columns as channels

_HINT = f"{MAPPING} assigns columns to channels"
_NO_RULE = Rule(channel="")
# Share of the largest value: a channel that varies by less varies by the rounding of its numbers.
_ROUND_OFF = 4 * float(np.finfo(np.float64).eps)
# Numbers with fewer digits are exact, such as those of a grid; those of a double need 15 or more.
_FEWEST_DIGITS, _ALL_DIGITS = 5, 15

Assigned = dict[str, tuple[Column, Rule]]
"""Channel -> its column in one table, and the rule; `_NO_RULE` where its name alone assigns it."""


def read_tables(
    paths: Sequence[Path | Source],
    sides: Sequence[str],
    mapping: Mapping | None = None,
    at_events: str | None = None,
    *,
    only: Sequence[str] | None = None,
) -> tuple[list[Table], tuple[str, ...]]:
    """Read the runs of two programs, native or not, as tables that are not yet checked, and warnings.

    The rules of a mapping hold for the side of each file, "a", "b" or "ideal"; other columns have the name of
    a channel, or one name in all tables. Of several rows at one time ``at_events`` selects "left" (the
    first), "right" (the last) or "both" (these two).
    ``only`` leaves out all other channels without a warning, except the rates that interpolate these.
    """
    mapping = mapping or Mapping()
    if only is not None:
        mapping = mapping.model_copy(update={"compare": list(only)})
    sources = [
        each if isinstance(each, Source) else open_source(each, mapping.dialect.of(side))
        for each, side in zip(paths, sides, strict=True)
    ]
    _refuse_missing(sources, sides, mapping, "--channels" if only else f"{mapping.file}: compare")
    assignments, omissions = _assign(sources, sides, mapping)
    overrides = _definitions(sources, assignments, mapping)
    warnings: list[str] = []
    for source, names in zip(sources, omissions, strict=True):
        warnings += (f"{source.path.name}: {note}" for note in source.notes)
        if source.time_name == position(0):
            rule = "columns without names: the first is the time, others are numbered"
            warnings.append(f"{source.path.name}: {rule}")
        if names and only is None:
            remark = f"not compared, since the mapping leaves it out: {', '.join(names)}"
            warnings.append(f"{source.path.name}: {remark}")
    if channel_names := ", ".join(name for name, channel in overrides.items() if not channel.unit):
        warnings.append(f"no unit is stated for {channel_names}: compared as numbers")
    tables = (_table(*each, overrides, mapping, at_events) for each in zip(sources, assignments, strict=True))
    return [*tables], tuple(warnings)


def _table(
    source: Source, columns: Assigned, overrides: dict[str, Channel], mapping: Mapping, at_events: str | None
) -> Table:
    names = [TIME, *(name for name in columns if name != TIME)]
    values = {name: _convert(source.path, name, *columns[name], overrides, mapping) for name in names}
    frame = pd.DataFrame(values, copy=False)
    base, provenance = source.companions, source.companions.provenance
    if not provenance or any(rule.channel for _, rule in columns.values()):
        provenance = {"formulation": f"taken from {source.path.name}"}
    definitions = {
        name: replace(channel, rounding=rounding(columns[name][0].numbers))
        for name, channel in overrides.items()
        if name in columns
    }
    rows = _select_rows(frame, at_events, str(source.path))
    return Table(rows, base.events, base.extrema, provenance, definitions, base.pulses, base.cycle_extrema)


def _largest(numbers: Array) -> float:
    return float(np.abs(numbers).max(initial=0.0, where=np.isfinite(numbers)))


def rounding(numbers: Array) -> float:
    """Return half a unit of the last digit of a column's numbers, as a share of them at most.

    It is 0 where they have all digits of double precision. Numbers with fewer than five digits, or with equal
    steps, count as exact: 0.
    """
    numbers = numbers[np.isfinite(numbers)]
    sizes = np.abs(numbers[numbers != 0.0])
    if sizes.size < 2 or np.ptp(np.diff(numbers)) <= _ROUND_OFF * sizes.max():
        return 0.0
    digits = _digits(sizes[:100])  # of most tables these have all digits already
    digits = _digits(sizes) if digits < _ALL_DIGITS else digits
    return 0.5 * 10.0 ** (1 - digits) if _FEWEST_DIGITS <= digits < _ALL_DIGITS else 0.0


def _digits(sizes: Array) -> int:
    """Return the number of significant digits that positive numbers need."""
    leading = sizes / 10.0 ** np.floor(np.log10(sizes))
    for digits in range(1, _ALL_DIGITS):
        units = leading * 10.0 ** (digits - 1)
        if (np.abs(units - np.round(units)) <= _ROUND_OFF * units).all():
            return digits
    return _ALL_DIGITS


def _refuse_missing(sources: Sequence[Source], sides: Sequence[str], mapping: Mapping, compare: str) -> None:
    """Reject rules for missing columns: a misspelt name would leave a channel out."""
    checks = [([source], getattr(mapping, side)) for source, side in zip(sources, sides, strict=True)]
    for tables, rules in [*checks, (sources, mapping.columns)]:
        names = {name for source in tables for name in source.names}
        places = {position(n) for source in tables for n, _ in enumerate(source.columns)}
        for name in sorted(rules.keys() - names - places):
            where = tables[0].path if len(tables) == 1 else "either table"
            listing = f"columns: {', '.join(sorted(names))}"
            raise TableError(f"{mapping.file}: column {name!r} is not in {where}; {listing}")
    for name in mapping.compare or ():
        if name not in {*channels(), *mapping.channels, *names}:
            raise TableError(f"{compare}: {name!r} is not a channel")


def _assign(
    sources: Sequence[Source], sides: Sequence[str], mapping: Mapping
) -> tuple[list[Assigned], list[list[str]]]:
    """Assign columns to channels by rules, else by their names; return also the columns left out.

    A name that is no channel's counts if all tables have it, and, where there are rules, if the mapping
    compares it. Of the channels that are not compared, the rates by which positions are interpolated
    remain where all tables have them.
    """
    rules = [_rules(source, side, mapping) for source, side in zip(sources, sides, strict=True)]
    common = set.intersection(*({*each.names} - own.keys() for each, own in zip(sources, rules, strict=True)))
    definitions: dict[str, Channel | Quantity] = {**channels(), **mapping.channels}
    compare = mapping.compare
    channel_names = {TIME, *definitions} | (common & {*(compare or ())} if any(rules) else common)
    assignments: list[Assigned] = []
    omissions: list[list[str]] = []
    for source, source_rules in zip(sources, rules, strict=True):
        columns: Assigned = {}
        time = None if TIME in (rule.channel for rule in source_rules.values()) else source.time_name
        for column in source.columns:
            rule = source_rules.get(column.name, _NO_RULE)
            channel = rule.channel or (TIME if column.name == time else column.name)
            if channel in columns:
                both = f"{columns[channel][0].name!r} and {column.name!r}"
                raise TableError(f"{source.path}: columns {both} are both the channel {channel}")
            if rule.channel or channel in channel_names:
                columns[channel] = column, rule
        column_names = {column.name for column, _ in columns.values()}
        rest = [*(name for name in source.names if name not in column_names), *source.others]
        if TIME not in columns:
            names = ", ".join(sorted(source.names))
            raise TableError(f"{source.path}: channel {TIME} is missing; columns: {names}; {_HINT}")
        unknown = [name for name in rest if name not in common]
        if unknown and not source_rules and compare is None:
            rule_of_names = "is not a channel, nor a column of both tables"
            hint = f"{_HINT}; compare = [...] there leaves it out"
            raise TableError(f"{source.path}: {unknown[0]!r} {rule_of_names}; {hint}")
        assignments.append(columns)
        omissions.append(rest)
    if compare is not None:
        rates = {definitions[name].rate for name in compare if name in definitions}
        for columns in assignments:  # not one that is missing, or holds text
            rates &= {name for name, (column, _) in columns.items() if not column.text}
        for columns, rest in zip(assignments, omissions, strict=True):
            for name in [name for name in columns if name not in (TIME, *compare)]:
                rest.append(name)
                if name not in rates:
                    del columns[name]
    return assignments, omissions


def _rules(source: Source, side: str, mapping: Mapping) -> dict[str, Rule]:
    """Return the rules for the columns of a table by their names."""
    side_rules: dict[str, Rule] = getattr(mapping, side)
    if side == "ideal" and not side_rules:  # it has the rules of the program that wrote it
        side_rules = max(mapping.a, mapping.b, key=lambda rules: len(rules.keys() & {*source.names}))
    rules = {**mapping.columns, **side_rules}
    matches = {name: rules.get(name) or rules.get(position(n)) for n, name in enumerate(source.names)}
    return {name: rule for name, rule in matches.items() if rule}


def _definitions(
    sources: Sequence[Source], assignments: Sequence[Assigned], mapping: Mapping
) -> dict[str, Channel]:
    """Return the channels of these tables that are not the press's, or that a mapping gives a scale.

    The unit is the one that a mapping gives, else that of the tables. A rate must be in that unit per second,
    since a cubic through both would be wrong otherwise.
    """
    definitions: dict[str, Channel] = {}
    native = {name: channel for source in sources for name, channel in source.companions.definitions.items()}
    for name in dict.fromkeys(name for columns in assignments for name in columns if name != TIME):
        quantity = mapping.channels.get(name, Quantity())
        where = f"{mapping.file}: channels.{name!r}"
        if name in native:
            if quantity.scale is not None or name not in channels():
                definitions[name] = replace(native[name], given=quantity.scale or native[name].given)
            continue
        uses = [
            (source.path.name, *columns[name])
            for source, columns in zip(sources, assignments, strict=True)
            if name in columns
        ]
        unit = _common_unit(name, uses) if quantity.unit is None else quantity.unit
        si_unit = parse_unit(unit)
        if quantity.angle and not same_dimension(si_unit, parse_unit("rad")):
            raise TableError(f"{where}: angle = true, but its unit {unit!r} is no angle")
        largest = max(_largest(column.numbers) for _, column, _ in uses)
        if any(column.numbers.size and np.ptp(column.numbers) == 0.0 for _, column, _ in uses):
            # In the other table this channel may be the residue of larger columns in its unit.
            alike = (c.numbers for source in sources for c in source.columns if unit and c.unit == unit)
            largest = max([largest, *map(_largest, alike)])
        definitions[name] = Channel(
            name=name,
            label=name,
            unit=unit,
            floor=max(_ROUND_OFF * max(largest, quantity.scale or 0.0), float(np.finfo(np.float64).tiny)),
            rate=quantity.rate,
            angle=quantity.angle,
            turn=2 * math.pi / float(si_unit.factor if si_unit and quantity.angle else 1),
            given=quantity.scale,
        )
    for channel in definitions.values():
        rate = (channels() | definitions).get(channel.rate or "")
        channel_unit, rate_unit, second = map(parse_unit, (channel.unit, rate.unit if rate else "", "s"))
        if rate and channel_unit and rate_unit and second and rate_unit.times(second) != channel_unit:
            units = f"is in {rate.unit}, which is not {channel.unit} per second"
            raise TableError(f"{mapping.file}: channels.{channel.name!r}: rate = {rate.name!r} {units}")
    return definitions


def _common_unit(name: str, uses: Sequence[tuple[str, Column, Rule]]) -> str:
    """Return the unit of a channel in several tables: the first one's, if the others measure the same."""
    units = {column.unit if rule.unit is None else rule.unit: table for table, column, rule in uses}
    (first, table), *others = units.items()
    for other, other_table in others[:1]:
        if not same_dimension(parse_unit(first or ""), parse_unit(other or "")):
            one, two = (f"in {unit}" if unit else "without a unit" for unit in (first, other))
            rule = f'{MAPPING} with [channels."{name}"] and its unit = "..." decides'
            raise TableError(f"column {name!r} is {one} in {table} and {two} in {other_table}: {rule}")
    return first or ""


def _convert(
    path: Path, name: str, column: Column, rule: Rule, overrides: dict[str, Channel], mapping: Mapping
) -> Array:
    """Return a column in its channel's unit."""
    where = f"{path}: column {column.name!r}"
    if column.text is not None:
        row, text = column.text
        hint = f"{remedy('skip, comment, decimal or thousands')}; compare = [...] there leaves it out"
        raise TableError(f"{where} is not a number in {row}: {text!r}; {hint}")
    is_new = name != TIME and name not in channels()
    new_unit = "s" if name == TIME else (channels() | overrides)[name].unit
    unit = column.unit if rule.unit is None else rule.unit
    if unit is None and rule is not _NO_RULE and not is_new:
        raise TableError(f"{where} has no unit, neither in the table nor in the mapping")
    if unit is None or (is_new and parse_unit(unit) is None):
        unit = new_unit
    default = mapping.channels.get(name, Quantity()).factor
    factor = rule.sign * (default if rule.factor is None else rule.factor)
    values = factor * column.numbers + rule.offset if rule.offset else factor * column.numbers
    origin, target = parse_unit(unit), parse_unit(new_unit)
    table_unit = parse_unit(column.unit) if column.unit is not None else None
    if unit != new_unit and not same_dimension(origin, target):
        raise TableError(f"{where}: unit {unit!r} does not fit the channel {name}, which is in {new_unit}")
    if table_unit is not None and table_unit != origin:
        raise TableError(f"{where}: the unit is {column.unit!r} in the table and {unit!r} in the mapping")
    return values if origin is None or target is None else origin.convert(values, target)


def _select_rows(frame: pd.DataFrame, at_events: str | None, name: str) -> pd.DataFrame:
    """Return the rows to compare where a program writes several for the time of an event."""
    time = frame["time"].to_numpy()
    repeats = np.append(False, np.diff(time) == 0)
    row, count = int(repeats.argmax()), int(repeats.sum())
    if not count:
        return frame
    where = f"{name}: time {time[row]!s} s is repeated in data row {row + 1} (such rows: {count})"
    if count > time.size // 2:
        raise TableError(f"{where}: most rows repeat the time of the row above: too few digits?")
    if at_events is None:
        events = "write one row of each time, or sixbar compare chooses by --at-events left, right or both"
        raise TableError(f"{where}: {events}")
    first, last = ~repeats, np.append(~repeats[1:], True)
    if at_events == "both" and (inner := time[~(first | last)]).size:
        rule = "of which --at-events both leaves out the inner ones: use left (the first) or right (the last)"
        raise TableError(f"{name}: time {inner[0]!s} s has more than two rows, {rule}")
    mask = {"left": first, "right": last, "both": first | last}[at_events]
    rows: pd.DataFrame = frame[mask].reset_index(drop=True)
    if at_events == "both":  # one distance for all: at 0 s the next number is denormal
        rows["time"] += repeats[mask] * np.spacing(np.abs(time).max())
    return rows
