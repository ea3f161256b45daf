"""Tables of any origin as `Table`: which column is which channel, in SI units with the channels' signs.

What is no channel of the press is compared under its own name and in the tables' units.
"""

import difflib
import io
import re
import subprocess
import sys
import warnings
from collections.abc import Iterator, Sequence
from collections.abc import Mapping as Pairs
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import numpy as np
import pandas as pd

from comparison.files import check_size
from comparison.tables import table_files
from comparison.tables.channels import Array, Channel, channels, is_uncertainty
from comparison.tables.dialect import (
    NUMBER,
    Column,
    Source,
    decode,
    parse_text,
    position,
    read_column,
    remedy,
)
from comparison.tables.mapping import (
    TIME,
    Dialect,
    Mapping,
    Quantity,
    Rule,
    check_rates,
    own_channel,
)
from comparison.tables.table import Table, TableError
from comparison.tables.units import parse_unit, same_dimension

# ---- files, recognised by their first bytes, not by their ending

_HEAD = 1024  # bytes in which text has no zero byte
_LARGEST_TEXT = 400_000_000  # bytes: read line by line it takes twenty times as much memory
_REFUSED = {
    b"MATLAB 7.3 MAT-file": "is of MATLAB's version 7.3 (HDF5): save it with the option -v7",
    b"\xd0\xcf\x11\xe0": "is a workbook of Excel before 2007, or one with a password: save its sheet as .csv",
    b"\x89HDF": "is an HDF5 file: export its columns as CSV, with their names in the first line",
}
_BINARY = "is a binary file: let the program write text or CSV (of OpenFAST OutFileFmt = 1)"
_EXPORT = "save its sheet as CSV"
_LONGEST = 600.0  # s to read a MATLAB file


def open_source(path: Path, dialect: Dialect | None = None) -> Source:
    """Read a file; the `TableError` for an unsupported kind says how to export the table."""
    with table_files.readable(path):
        check_size(path, table_files.LARGEST)
        with path.open("rb") as file:
            head = file.read(_HEAD)
        source = _source(path, head, dialect or Dialect())
    columns = [each for each in source.columns if not is_uncertainty(each.name)]
    source = replace(source, columns=columns)
    with table_files.unread(source.notes):
        source = replace(source, events=table_files.read_contacts(path))
        if source.events is not None:  # pulses are theirs
            source = replace(source, pulses=table_files.read_columns(path, "pulses"))
    if source.plain and path.suffix.lower() == (".parquet" if head.startswith(b"PAR1") else ".csv"):
        with table_files.unread(source.notes):
            extrema, record = table_files.read_record(path)
            source = replace(source, extrema=extrema, record=record)
    return source


def _source(path: Path, head: bytes, dialect: Dialect) -> Source:
    if rule := next((rule for start, rule in _REFUSED.items() if head.startswith(start)), ""):
        raise TableError(rule)
    if head.startswith(b"PAR1"):
        frame = table_files.read_parquet(path)
        return Source(
            path, [read_column(str(name), None, frame[name]) for name in frame], plain="time" in frame
        )
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
    """Return as text the one sheet of a workbook with a table; a formula counts by its stored value."""
    try:
        with ZipFile(path) as file:
            unpacked = sum(part.file_size for part in file.infolist())
        options: dict[str, Any] = {"header": None, "dtype": object, "na_filter": False, "engine": "openpyxl"}
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # warnings of styles and extensions do not matter
            small = unpacked <= table_files.LARGEST
            sheets = pd.read_excel(path, sheet_name=None, **options) if small else {}
    except ImportError as error:
        extra = "pip install 'sixbar-crossval[excel]'"
        raise TableError(f"is an Excel workbook: {extra} to read it, or {_EXPORT}") from error
    # Of a damaged file the parsers of ZIP, XML and cells raise errors of many kinds.
    except Exception as error:
        raise TableError(f"is not a readable .xlsx workbook: {_EXPORT}") from error
    if unpacked > table_files.LARGEST:
        raise TableError(f"holds more than {table_files.LARGEST} bytes once it is unpacked")
    with_numbers = [name for name, sheet in sheets.items() if (sheet.map(_is_number).sum(axis=1) > 1).any()]
    if not with_numbers:
        raise TableError("no sheet contains a row of two or more numbers")
    if len(with_numbers) > 1:
        raise TableError(f"sheets {' and '.join(map(repr, with_numbers))} hold numbers: save one per file")
    return str(sheets[with_numbers[0]].map(_cell_text).to_csv(sep="\t", header=False, index=False))


def _is_number(cell: object) -> bool:
    return isinstance(cell, int | float) and not isinstance(cell, bool)


def _cell_text(cell: object) -> str:
    """Return a cell as it is read again; text that looks like a number is marked as such, as Excel does."""
    text = re.sub(r"[\r\n\0]+", " ", str(cell))
    return f"'{text}" if isinstance(cell, str) and NUMBER.fullmatch(text.strip()) else text


def _vectors(path: Path) -> tuple[list[Column], list[str]]:
    """Return the real vectors of a MATLAB file, and descriptions of its other contents."""
    # -P: do not import a module of the same name from the working directory.
    reader = [sys.executable, "-P", "-m", "comparison.tables.matlab", str(path), str(4 * table_files.LARGEST)]
    try:
        done = subprocess.run(reader, capture_output=True, check=False, timeout=_LONGEST)
    except subprocess.TimeoutExpired as error:
        raise TableError(f"cannot be read within {_LONGEST:g} s") from error
    if done.returncode != 0:
        raise TableError("is not a readable .mat file")
    names, others, *vectors = np.load(io.BytesIO(done.stdout), allow_pickle=False).values()
    if other := next((n for n, vector in enumerate(vectors) if vector.size != vectors[0].size), None):
        raise TableError(
            f"{names[0]} holds {vectors[0].size} numbers and {names[other]} {vectors[other].size}"
        )
    columns = [Column(str(name), None, vector) for name, vector in zip(names, vectors, strict=True)]
    return columns, others.tolist()


# ---- columns as channels

AT_EVENTS = ("left", "right", "both")
"""Rows of one time that are compared: the first, the last, or these two."""
_HINT = "a mapping file (--mapping) assigns columns to channels"
_NO_RULE = Rule(channel="")


@dataclass
class _Assignment:
    """Table whose columns are assigned to channels."""

    source: Source
    columns: dict[str, tuple[Column, Rule]]  # by channel; with `_NO_RULE` where its name alone assigns it
    ruled: bool  # whether a rule of the mapping assigns one
    left_out: list[str] = field(default_factory=list)


def read_tables(
    paths: Sequence[Path | Source],
    sides: Sequence[str],
    mapping: Mapping | None = None,
    at_events: str | None = None,
    *,
    only: Sequence[str] | None = None,
) -> tuple[list[Table], tuple[str, ...]]:
    """Read the runs of two programs, native or not, as tables that are not yet checked, and warnings.

    The rules of a mapping hold for the side, "a", "b" or "ideal", of each file; what it does not assign has
    the name of a channel, or the same in all tables. Of several rows at one time those ``at_events`` count.
    With ``only`` all other channels are left out without a warning, except rates that interpolate these.
    """
    if at_events is not None and at_events not in AT_EVENTS:
        raise TableError(f"--at-events {at_events!r} must be one of {', '.join(AT_EVENTS)}")
    if isinstance(only, str):
        raise TableError(f"channels {only!r} must be a list of names")
    mapping = mapping or Mapping()
    if only is not None:
        mapping = mapping.model_copy(update={"compare": list(only)})
    compare = None if mapping.compare is None else [TIME, *mapping.compare]
    sources = [
        each if isinstance(each, Source) else open_source(each, mapping.dialect.of(side))
        for each, side in zip(paths, sides, strict=True)
    ]
    _refuse_missing(sources, sides, mapping, "--channels" if only else f"{mapping.file}: compare")
    assigned = [_by_rules(source, side, mapping) for source, side in zip(sources, sides, strict=True)]
    _add_shared(assigned, mapping, compare)
    known = _definitions(assigned, mapping)
    warnings = [*_assumptions(sources, known)]
    for each in assigned:
        if each.left_out and only is None:
            reason = "not compared, since the mapping leaves it out"
            warnings.append(f"{each.source.path.name}: {reason}: {', '.join(each.left_out)}")
    return [_table(each, known, mapping, at_events) for each in assigned], tuple(warnings)


def _table(table: _Assignment, known: dict[str, Channel], mapping: Mapping, at_events: str | None) -> Table:
    source, columns = table.source, table.columns
    names = [TIME, *(name for name in columns if name != TIME)]
    converted = {name: _converted(source.path, name, *columns[name], known, mapping) for name in names}
    frame = pd.DataFrame({name: values for name, (values, _) in converted.items()}, copy=False)
    provenance = source.record
    if provenance is None or table.ruled:
        settings = {name: description for name, (_, description) in converted.items()}
        provenance = {"formulation": f"taken from {source.path.name}", "settings": settings}
    own = {name: channel for name, channel in known.items() if name in columns}
    rows = _select_rows(frame, at_events, str(source.path))
    result = Table(rows, source.events, source.extrema, provenance, own)
    return replace(result, pulses=source.pulses, cycle_extrema=source.cycle_extrema)


def _refuse_missing(sources: Sequence[Source], sides: Sequence[str], mapping: Mapping, compare: str) -> None:
    """Reject rules for missing columns: a misspelt name would leave a channel out."""
    every = [name for source in sources for name in source.names]
    most = max(len(source.columns) for source in sources)
    checks = [
        (str(source.path), getattr(mapping, side), source.names, len(source.columns))
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
            raise TableError(f"{compare}: {name!r} is not a channel")


def _by_rules(source: Source, side: str, mapping: Mapping) -> _Assignment:
    """Assign columns to channels by rules, else by their names; one is the time."""
    special: dict[str, Rule] = getattr(mapping, side)
    if side == "ideal" and not special:  # it has the rules of the program that wrote it
        special = max(mapping.a, mapping.b, key=lambda rules: len(rules.keys() & {*source.names}))
    rules = {**mapping.columns, **special}
    own = [rules.get(name) or rules.get(position(n)) for n, name in enumerate(source.names)]
    times = [name for name in source.names if name.casefold() == TIME]
    if not times and not any(rule and rule.channel == TIME for rule in own):
        usual = sorted({"t", "tout"} & {*source.names})[:1]  # tout: of Simulink
        times = source.names[:1] if source.nameless else usual
    known = {TIME, *channels(), *mapping.channels}
    assigned: dict[str, tuple[Column, Rule]] = {}
    for column, rule in zip(source.columns, own, strict=True):
        name = TIME if column.name in times else column.name
        channel = rule.channel if rule else name
        if channel in assigned:
            both = f"{assigned[channel][0].name!r} and {column.name!r}"
            raise TableError(f"{source.path}: columns {both} are both the channel {channel}")
        if rule or name in known:
            assigned[channel] = column, rule or _NO_RULE
    if TIME not in assigned:
        names = ", ".join(sorted(source.names))
        raise TableError(f"{source.path}: channel {TIME} is missing; columns: {names}; {_HINT}")
    return _Assignment(source, assigned, ruled=any(own))


def _add_shared(assigned: Sequence[_Assignment], mapping: Mapping, compare: list[str] | None) -> None:
    """Assign columns that have one name in all tables, and leave out those that are not to be compared.

    The rates by which positions are interpolated remain, where all tables have them.
    """
    for each in assigned:
        taken = {column.name for column, _ in each.columns.values()}
        each.left_out = [name for name in each.source.names if name not in taken]
    shared = set.intersection(*(set(each.left_out) for each in assigned))
    # A mapping that names columns leaves out the others, even if both tables have them.
    wanted = shared & set(compare or ()) if any(each.ruled for each in assigned) else shared
    pairs = {name: each.rate for name, each in channels().items()}
    pairs |= {name: each.rate for name, each in mapping.channels.items()}
    rates = {pairs.get(name) for name in compare or ()}
    for each in assigned:  # not one that is missing, or holds text
        rates &= {name for name, (column, _) in each.columns.items() if not column.text}
    for each in assigned:
        columns = each.columns
        columns |= {own.name: (own, _NO_RULE) for own in each.source.columns if own.name in wanted}
        each.left_out = [*(name for name in each.left_out if name not in wanted), *each.source.others]
        unknown = [name for name in each.left_out if name not in shared]
        if unknown and not each.ruled and compare is None:
            rule = "is not a channel, nor a column of both tables"
            raise TableError(f"{each.source.path}: {unknown[0]!r} {rule}; {_HINT}")
        for name in [name for name in columns if compare is not None and name not in compare]:
            each.left_out.append(name)
            if name not in rates:
                del columns[name]


def _definitions(assigned: Sequence[_Assignment], mapping: Mapping) -> dict[str, Channel]:
    """Return the channels of these tables that are not the press's, or have a scale of their own."""
    defined = {}
    for name in dict.fromkeys(name for each in assigned for name in each.columns if name != TIME):
        quantity = mapping.channels.get(name, Quantity())
        if name not in channels():
            owning = [each for each in assigned if name in each.columns]
            stated = [
                (each.source.path.name, _unit(*each.columns[name]), each.columns[name][0].numbers)
                for each in owning
            ]
            defined[name] = own_channel(name, quantity, stated, mapping.file)
        elif quantity.scale is not None:
            defined[name] = replace(channels()[name], given=quantity.scale)
    check_rates(defined, mapping.file)
    return defined


def _unit(column: Column, rule: Rule) -> str | None:
    return column.unit if rule.unit is None else rule.unit


def _assumptions(sources: Sequence[Source], known: Pairs[str, Channel]) -> Iterator[str]:
    bare = ", ".join(name for name, channel in known.items() if not channel.unit)
    for source in sources:
        yield from (f"{source.path.name}: {note}" for note in source.notes)
        if source.nameless:
            yield f"{source.path.name}: columns without names: the first is the time, others are numbered"
    if bare:
        yield f"no unit is stated for {bare}: compared as numbers"


def _converted(
    path: Path, name: str, column: Column, rule: Rule, known: dict[str, Channel], mapping: Mapping
) -> tuple[Array, str]:
    """Return a column in its channel's unit, and a description of the conversion."""
    where = f"{path}: column {column.name!r}"
    if column.text is not None:
        row, text = column.text
        is_grouped = re.fullmatch(r"[+-]?\d+([.,'\s\u2019]\d+)+", text)
        keys = "decimal, thousands" if is_grouped else "skip, or comment if the line begins one"
        hint = f"{remedy(keys)}; compare = [...] there leaves it out"
        raise TableError(f"{where} is not a number in {row}: {text!r}; {hint}")
    own = name != TIME and name not in channels()
    wanted = "s" if name == TIME else (channels() | known)[name].unit
    stated = _unit(column, rule)
    if stated is None and rule is not _NO_RULE and not own:
        raise TableError(f"{where} has no unit, neither in the table nor in the mapping")
    if stated is None or (own and parse_unit(stated) is None):
        stated = wanted
    usual = mapping.channels.get(name, Quantity()).factor
    factor = rule.sign * (usual if rule.factor is None else rule.factor)
    values, description = factor * column.numbers, f"{column.name} in {stated}" if stated else column.name
    if factor != 1:
        description = f"{factor:g} {description}"
    if rule.offset:
        values, description = values + rule.offset, description + f" {rule.offset:+g}"
    unit, to = parse_unit(stated), parse_unit(wanted)
    in_table = parse_unit(column.unit) if column.unit is not None else None
    if abs(factor) != 1 and unit == parse_unit("1"):
        in_table, unit, stated = None, to, wanted  # the factor of a normalised column has the unit
    if unit is None and (stated != wanted or not own):
        raise TableError(f"{where}: unit {stated!r} is not known")
    if stated != wanted and not same_dimension(unit, to):
        raise TableError(f"{where}: unit {stated!r} does not fit the channel {name}, which is in {wanted}")
    if in_table is not None and in_table != unit:
        raise TableError(f"{where}: the unit is {column.unit!r} in the table and {stated!r} in the mapping")
    return (values if unit is None or to is None else unit.convert(values, to)), description


def _select_rows(frame: pd.DataFrame, at_events: str | None, name: str) -> pd.DataFrame:
    """Return the rows to compare, of those that a program with events writes for one time."""
    time = frame["time"].to_numpy()
    again = np.append(False, np.diff(time) == 0)
    row, count = int(again.argmax()), int(again.sum())
    if not count:
        return frame
    rows = "row" if count == 1 else "rows"
    where = f"{name}: time {time[row]!s} s is repeated in data row {row + 1} ({count} such {rows})"
    if count > time.size // 2:
        raise TableError(f"{where}: most rows have the time before: too few digits?")
    if at_events is None:
        events = f"if these are events, say by --at-events which rows count: {', '.join(AT_EVENTS)}"
        raise TableError(f"{where}: {events}")
    first, last = ~again, np.append(~again[1:], True)
    if at_events == "both" and (inner := time[~(first | last)]).size:
        rule = "of which --at-events both leaves out the inner ones: use left (the first) or right (the last)"
        raise TableError(f"{name}: time {inner[0]!s} s has more than two rows, {rule}")
    kept = {"left": first, "right": last, "both": first | last}[at_events]
    resolved: pd.DataFrame = frame[kept].reset_index(drop=True)
    if at_events == "both":  # the same distance of all, since at 0 s the next number is denormal
        resolved["time"] += again[kept] * np.spacing(np.abs(time).max())
    return resolved
