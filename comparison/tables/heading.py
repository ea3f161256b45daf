"""Names and units of a text table's columns, from the lines above its numbers."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Sequence

from comparison.tables.table import TableError
from comparison.tables.units import parse, same_dimension

SPACES = r"\s+"
"""Separator: any number of spaces and tabs."""
SEPARATORS = (";", "\t", ",", SPACES)
COMMENT = "#%!"
EXPONENT = r"(?:[eEdDqQ][+-]?\d+|[+-]\d{3})?"  # Fortran's has a D, or no letter before three digits
NUMBER = re.compile(
    rf"[+-]?(?=[.,]?\d)[\d.,]+{EXPONENT}|[+-]?(?:nan|inf|infinity)(?:\(\w*\))?|[+-]?1[.,]#\w+",
    re.ASCII | re.IGNORECASE,
)
"""Whatever a program writes for a number, with any signs."""

_RULE = " \t-=_*"  # characters of a line that only separates
_LONGEST_NAME = 1_000
# Names separated by spaces: quoted or a single word, either with a unit in brackets.
# Of a line of units each is in brackets of its own. Brackets are short: the time to find them is bounded.
_BRACKETS = r"\[[^\]]{0,99}\]|\([^)]{0,99}\)"
_WORD = re.compile(rf'(?:"[^"]*"|[^\s"\[(](?:[^\s"\[(]|{_BRACKETS})*)(?:\s+(?:{_BRACKETS}))?|{_BRACKETS}')
_WITH_BRACKETS = re.compile(r"(?P<name>.*\S)(?P<space>\s*)(?:\[(?P<square>[^\]]*)\]|\((?P<round>[^)]*)\))")


def split(line: str, separator: str) -> list[str]:
    """Return the fields of a line without quotation marks and spaces around them."""
    if separator == SPACES:
        return [field.strip('"') for field in re.split(r"[ \t]+", line.strip(" \t"))]
    rows = csv.reader([line], delimiter=separator, skipinitialspace=True)
    return [field.strip() for field in next(rows, [])]


def is_time(name: str) -> bool:
    """Return whether a name without a unit is that of the time."""
    return name.casefold() == "time" or name == "t"


def is_comment(line: str) -> bool:
    """Return whether a line begins with the sign of a comment."""
    return line.lstrip(" \t")[:1] in tuple(COMMENT)


def is_below_time(row: Sequence[str], above: Sequence[str], separator: str) -> bool:
    """Return whether one of the lines above a row with numbers names the time, and the row no unit of it.

    Text may stand for the time as well, such as that of a clock.
    """
    return (len(row) > 1 and any(map(NUMBER.fullmatch, row))) and any(
        is_time(_name_and_unit(name)[0]) and (NUMBER.fullmatch(field) or parse(_bare(field) or "1") is None)
        for line in above
        for names in _fitting([_words(line, separator)], row)
        for name, field in zip(names, row, strict=True)
    )


def names_and_units(
    above: Sequence[tuple[int, str]], separator: str, row: Sequence[str]
) -> tuple[list[str], list[str | None]] | None:
    """Return the names of columns, and their units or None; None if the lines name no columns.

    The names are in the line that names the time, with at most a line of units below it; else in the last
    line, or in the one above it if the last one holds units. Either may be a comment.

    Parameters
    ----------
    above
        Number and text of the lines above the numbers.
    separator
        Of the numbers.
    row
        Fields of the first row of numbers.

    Raises
    ------
    TableError
        Without the file: if the last line is no comment, and has another number of fields than the row, or a
        name occurs twice.
    """
    lines = [(n, line) for n, line in above if line.strip(_RULE)]
    while len(lines) > 1 and lines[-1][1].count('"') % 2:  # a name of two lines
        lines[-2:] = [(lines[-2][0], f"{lines[-2][1]} {lines[-1][1]}")]
    if not lines:
        return None
    below: list[str] = []
    for _, line in reversed(lines):
        if names := next(filter(_names_time, _ways(line, separator, row)), None):
            place = next(n for n, name in enumerate(names) if _names_time([name]))
            units = (_units(text, separator, row, place) for text in below)
            return _named(names, next(filter(None, units), []))
        if not is_comment(line) and not (all(map(is_comment, below)) and _units(line, separator, row, 0)):
            break
        below.append(line)
    number, line = lines[-1]
    names = next(reversed(_ways(line, separator, row)), None)
    for n, text in lines if names is None else lines[-1:]:
        if not is_comment(text) and _may_be_row(split(text, separator), len(row)):
            raise TableError(f"line {n} begins like a row of numbers, but is none")
    if is_comment(line) and (names is None or any(map(NUMBER.fullmatch, names))):
        return None
    if names is None:
        raise TableError(
            f"line {above[-1][0] + 1} holds {len(row)} numbers, but line {number} names "
            f"{len(_words(line, separator))}: each column needs a name, or none does"
        )
    titles = next(reversed(_ways(lines[-2][1], separator, row)), None) if len(lines) > 1 else None
    return _named(names, []) if titles is None or not _are_units(names) else _named(titles, names)


def _words(line: str, separator: str) -> list[str]:
    line = line.lstrip(" " + COMMENT).rstrip(" ")
    return _WORD.findall(line) if separator == SPACES else split(line, separator)


def _ways(line: str, separator: str, row: Sequence[str]) -> list[list[str]]:
    """Return the ways to split a line into the names of all columns.

    The last one is as the numbers are separated; any other must give a name of the time.
    """
    others = [_words(line, other) for other in SEPARATORS if other not in (separator, SPACES)]
    aligned = re.split(r"\s{2,}|\t", line.lstrip(" " + COMMENT).rstrip())
    others.append([field.strip('"') for field in aligned])
    return [*filter(_names_time, _fitting(others, row)), *_fitting([_words(line, separator)], row)]


def _units(line: str, separator: str, row: Sequence[str], time: int) -> list[str]:
    """Return the fields of a line that holds units, that of the time in a given place; empty if it does not.

    A comment with as many words as there are columns need not hold units.
    """
    text = line.lstrip(" " + COMMENT).rstrip(" ")
    ways = _fitting([split(text, separator), *_ways(line, separator, row)], row)
    for way in ways:
        if _are_units(way) or same_dimension(parse(_bare(way[time]) or ""), parse("s")):
            return way
    return [] if is_comment(line) or not ways or NUMBER.fullmatch(ways[0][time]) else ways[0]


def _fitting(ways: Iterable[list[str]], row: Sequence[str]) -> list[list[str]]:
    """Return those with as many fields as the row, but for a separator at the end of either."""
    fitting = []
    for fields in ways:
        if len(fields) == len(row) + 1 and not fields[-1]:
            fields = fields[:-1]
        if len(fields) == len(row) - 1 and not row[-1]:
            fields = [*fields, ""]
        if len(fields) == len(row):
            fitting.append(fields)
    if any(len(field) > _LONGEST_NAME for fields in fitting for field in fields):
        raise TableError(f"has a name of more than {_LONGEST_NAME} characters")
    return fitting


def _may_be_row(fields: Sequence[str], count: int) -> bool:
    """Whether fields that are no row of numbers begin like one: it is not passed over as a title."""
    numbers = sum(NUMBER.fullmatch(field) is not None for field in fields)
    return bool(fields and NUMBER.fullmatch(fields[0])) and (
        len(fields) == count or 2 * numbers > max(len(fields), 2)
    )


def _names_time(fields: Sequence[str]) -> bool:
    return any(is_time(_name_and_unit(field)[0]) for field in fields)


def _named(names: Sequence[str], units: Sequence[str]) -> tuple[list[str], list[str | None]]:
    """Return names and units; brackets that tell apart what has one name are part of the name."""
    parts = [_name_and_unit(field) for field in names]
    bare = [name for name, _ in parts]
    for n, (name, unit) in enumerate(parts):
        if bare.count(name) > 1 and unit is not None and (parse(unit) is None or unit.isdigit()):
            parts[n] = names[n].strip('"'), None
    final = [name for name, _ in parts]
    if twice := next((name for name in final if name and final.count(name) > 1), None):
        raise TableError(f"column {twice!r} occurs twice: which one is meant is ambiguous")
    below = [_bare(field) for field in units] or [None] * len(parts)
    return final, [unit or beside for unit, (_, beside) in zip(below, parts, strict=True)]


def _bare(field: str) -> str | None:
    """Return a unit without its brackets; None for an empty field."""
    inside = re.fullmatch(r"\[(.*)\]|\((.*)\)", field)
    return (inside[1] or inside[2] or "" if inside else field).strip() or None


def _name_and_unit(field: str) -> tuple[str, str | None]:
    """Return name and unit of ``x [mm]``, ``x(mm)`` or ``x``; ``r[1]`` and ``der(x)`` are names."""
    field = re.sub(r'^"([^"]*)"$', r"\1", field)
    parts = _WITH_BRACKETS.fullmatch(field)
    if parts is None:
        return field.strip('"'), None
    text = (parts["square"] or parts["round"] or "").strip()
    index = text.isdigit() or parts["name"].endswith("der")
    if not parts["space"] and (index or parse(text) is None):
        return field.strip('"'), None
    return parts["name"].strip('"'), text or None


def _are_units(fields: Sequence[str]) -> bool:
    """Whether all fields are units, or in brackets."""
    written = [field for field in fields if field]
    return bool(written) and all(parse(field) is not None or _bare(field) != field for field in written)
