"""Text tables of any program: where the numbers begin, what the columns are called, which sign is decimal.

Lines end as in `csv` and pandas: not with a form feed or U+2028, at which Python splits too.
"""

import csv
import re
import warnings
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from comparison.tables.channels import Array
from comparison.tables.mapping import parse_unit, same_dimension
from comparison.tables.table import Columns, TableError

_HEAD = 1 << 18  # characters that must contain the first row of numbers
_LONGEST_LINE = 100_000
_LONGEST_NAME = 1_000

_SPACES = r"\s+"  # the separator: any number of spaces and tabs
_SEPARATORS = (";", "\t", ",", _SPACES)
_UNIT_SEPARATOR = "\x1f"
_COMMENT = "#%!"
_RULE = " \t-=_*"  # characters of a line that only separates
_EXPONENT = r"(?:[eEdDqQ][+-]?\d+|[+-]\d{3})?"  # Fortran's has a D, or no letter before three digits
NUMBER = re.compile(
    rf"[+-]?(?=[.,]?\d)[\d.,]+{_EXPONENT}|[+-]?(?:nan|inf|infinity)(?:\(\w*\))?|[+-]?1[.,]#\w+",
    re.ASCII | re.IGNORECASE,
)
"""Whatever a program writes for a number, with any signs."""
# Names separated by spaces: quoted or a single word, either with a unit in brackets.
# Of a line of units each is in brackets of its own. Brackets are short: the time to find them is bounded.
_BRACKETS = r"\[[^\]]{0,99}\]|\([^)]{0,99}\)"
_WORD = re.compile(rf'(?:"[^"]*"|[^\s"\[(](?:[^\s"\[(]|{_BRACKETS})*)(?:\s+(?:{_BRACKETS}))?|{_BRACKETS}')
_WITH_BRACKETS = re.compile(r"(?P<name>.*\S)(?P<space>\s*)(?:\[(?P<square>[^\]]*)\]|\((?P<round>[^)]*)\))")

Heading = list[tuple[str, str | None]]  # name and unit of each column


class Column(NamedTuple):
    """Unconverted column of another program's table."""

    name: str  # without quotes and brackets; of one without a name that of its place, ``#2``
    unit: str | None
    numbers: Array  # nan where there is none
    text: tuple[int, str] | None = None  # row (from 1) and text of the first entry that is no number


@dataclass(frozen=True)
class Source:
    """Unconverted table of any program."""

    path: Path
    columns: list[Column]  # without empty ones, and one that counts the rows, that have no name
    others: list[str] = field(default_factory=list)  # other contents of the file, which cannot be compared
    nameless: bool = False  # whether the first column has no name and must be the time
    plain: bool = False
    """Whether it is in the layout of this project's tables: one line of names with ``time``, commas."""
    events: pd.DataFrame | None = None
    pulses: Columns | None = None
    extrema: dict[str, Any] = field(default_factory=dict)
    cycle_extrema: Columns | None = None
    record: dict[str, Any] | None = None  # of a table of this project; None: there is no record of its origin

    @property
    def names(self) -> list[str]:
        """Names of the columns."""
        return [column.name for column in self.columns]


def position(n: int) -> str:
    """Return the name of a column by its place, counted from 0: ``#1`` for the first."""
    return f"#{n + 1}"


def decoded(content: bytes) -> str:
    """Return a text with line feeds, of UTF-8, UTF-16 with its mark, or the code of old Windows programs."""
    try:
        text = content.decode("utf-16" if content[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig")
    except UnicodeDecodeError:
        text = content.decode("cp1252", errors="replace")
    if "\0" in text:
        raise TableError("has a zero byte: it is not text, or not in UTF-8")
    return text.replace("\r\n", "\n").replace("\r", "\n")


def parse_text(
    path: Path, text: str, separators: Sequence[str] = _SEPARATORS, decimal: str | None = None
) -> Source:
    """Read the columns of a text with line feeds; a `TableError`, without the file, if it is no clear table.

    The separators are tried in this order; without a decimal sign the numbers show it.
    """
    lines, first, separator = _first_row(text, separators)
    above, row = lines[:first], _fields(lines[first], separator)
    below_size = _below_size(row, text, lines, first, separator)
    if below_size:
        first, row = below_size, _fields(lines[below_size], separator)
    heading = _heading(above, separator, row)
    if heading is None and not below_size:
        _check_nameless(first + 1, lines[first], above, separator, row)
    text = text[sum(len(line) + 1 for line in lines[:first]) :]  # not both, which may be large
    text, separator = _rows(text, first + 1, separator)
    if decimal is None:
        decimal, text = _decimal_sign(text, separator)
    frame = _frame(text, first + 1, separator, decimal, len(row))
    columns: list[Column] = []
    for n, (name, unit) in enumerate(heading or [("", None)] * len(row)):
        made = read_column(name or position(len(columns)), unit, frame[n], decimal)
        counted = (np.arange(made.numbers.size) + begin for begin in (0, 1))
        is_index = n == 0 and heading is not None and any(np.array_equal(made.numbers, c) for c in counted)
        if name or not (is_index or frame[n].isna().all()):
            columns.append(made)
    texts = {made.text[0] if made.text else 0 for made in columns}
    if len(texts) == 1 and (row_of_text := texts.pop()):
        raise TableError(f"text after data row {row_of_text - 1}: save one block of columns per file")
    names = [name for name, _ in heading or ()]
    nameless = [made.name for made in columns[:1]] == [position(0)] and not any(map(_is_time, names))
    return Source(path, columns, nameless=nameless, plain="time" in names and above == [",".join(names)])


def read_column(name: str, unit: str | None, entries: pd.Series, decimal: str = ".") -> Column:
    """Return a column as pandas has read it; numbers that it has read as text have this decimal sign."""
    if entries.dtype.kind in "fiu":
        return Column(name, unit, entries.to_numpy(dtype=np.float64, na_value=np.nan))
    text = entries.astype("str").str.strip()
    plain = text.str.translate(str.maketrans(",.", ".,")) if decimal == "," else text
    plain = plain.str.replace(r"^\+([\d.])", r"\1", regex=True)  # pandas rounds what has a plus otherwise
    fortran = r"^(-?[\d.]+)[dDqQ]([+-]?\d+)$|^(-?\d*\.\d*)([+-]\d{3})$"
    plain = plain.str.replace(fortran, r"\1\3e\2\4", regex=True)
    numbers = pd.to_numeric(plain, errors="coerce").to_numpy(dtype=np.float64)
    absent = entries.isna() | text.str.fullmatch("[+-]?nan", case=False)
    wrong = np.flatnonzero(np.isnan(numbers) & ~absent.to_numpy(dtype=bool))
    return Column(name, unit, numbers, (int(wrong[0]) + 1, str(text.iloc[wrong[0]])) if wrong.size else None)


# Where the numbers begin


def _split(line: str, separator: str) -> list[str]:
    """Return the fields of a line without quotation marks and spaces around them."""
    if separator == _SPACES:
        return [field.strip('"') for field in re.split(r"[ \t]+", line.strip(" \t"))]
    rows = csv.reader([line], delimiter=separator, skipinitialspace=True)
    return [field.strip() for field in next(rows, [])]


def _fields(line: str, separator: str) -> list[str]:
    return _split(_without_comments(line, separator), separator)


def _without_comments(text: str, separator: str) -> str:
    """Return text without the comments after a space at the ends of lines."""
    if "#" not in text:
        return text
    space, last = ("[ \t]", "") if separator == _SPACES else (" ", separator)  # "; #N/A ;" is none
    return re.sub(rf'(?m){space}#[^"\n{last}]*$', "", text)


def _is_comment(line: str) -> bool:
    return line.lstrip(" \t").startswith(tuple(_COMMENT))


def _first_row(text: str, separators: Sequence[str]) -> tuple[list[str], int, str]:
    """Return the first lines, the place of the first row of numbers among them, and its separator."""
    lines = text[:_HEAD].split("\n")[: None if len(text) <= _HEAD else -1]
    if any(len(line) > _LONGEST_LINE for line in lines):
        raise TableError(f"has a line of more than {_LONGEST_LINE} characters")
    recent: list[str] = []
    for n, line in enumerate(lines):
        rows = {} if _is_comment(line) else {each: _fields(line, each) for each in separators}
        rows = {each: row for each, row in rows.items() if len(row) > 1 and any(map(NUMBER.fullmatch, row))}
        fitting = [each for each, row in rows.items() if _is_below_time(row, recent, each)]
        fitting += [each for each, row in rows.items() if all(map(NUMBER.fullmatch, filter(None, row)))]
        if fitting:
            return lines, n, fitting[0]
        recent = [*recent, line][-3:] if line.strip() else recent  # names, units, a line below them
    raise TableError("contains no row of two or more numbers")


def _is_below_time(row: Sequence[str], above: Sequence[str], separator: str) -> bool:
    """Whether one of the lines above a row names the time, and the row no unit of it.

    Text may stand for the time as well, such as that of a clock.
    """
    return any(
        _names_time([name]) and (NUMBER.fullmatch(field) or parse_unit(_bare(field) or "1") is None)
        for line in above
        for names in _fitting([_words(line, separator)], row)
        for name, field in zip(names, row, strict=True)
    )


def _check_nameless(number: int, line: str, above: Sequence[str], separator: str, row: Sequence[str]) -> None:
    """Reject a first row that need not be one of numbers, or whose columns are not clear without names."""
    written = [field for field in row if field]
    counted = any(written == [str(n + begin) for n in range(len(written))] for begin in (0, 1))
    if counted and not "".join(above).strip():  # as pandas and others write for want of names
        raise TableError(
            f"line {number} holds {', '.join(written)}, which may be names or numbers: write a line of names "
            "above it, or instead of it"
        )
    if separator == _SPACES and "\t" in line.strip():
        raise TableError(f"line {number} has tabs and spaces between its numbers: write names above them")


def _below_size(row: Sequence[str], text: str, lines: Sequence[str], first: int, separator: str) -> int:
    """Return the line below one that holds only the number of rows and of columns; 0 if this is none."""
    if len(row) != 2 or not all(re.fullmatch(r"[0-9]{1,9}", field) for field in row):
        return 0
    rows, columns = map(int, row)
    below = next((n for n in range(first + 1, len(lines)) if lines[n].strip()), 0)
    fields = _split(lines[below], separator)
    is_size = below and columns == len(fields)
    if not is_size or rows != sum(bool(line.strip()) for line in text.split("\n")[below:]):
        return 0
    if columns == 2 and not read_column("", None, pd.Series(fields[:1])).numbers[0] <= rows:
        either = "a row, or the size of the table: write a line of names above it"
        raise TableError(f"line {first + 1} may be {either}")
    return below


# What the columns are called


def _heading(above: Sequence[str], separator: str, row: Sequence[str]) -> Heading | None:
    """Return the names and units in the lines above the first row of numbers; None if they name no columns.

    The names are in the line that names the time, with at most a line of units below it; else in the last
    line, or in the one above it if the last one holds units. Either may be a comment.
    """
    lines = [(n, line) for n, line in enumerate(above, 1) if line.strip(_RULE)]
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
        if not _is_comment(line) and not (all(map(_is_comment, below)) and _units(line, separator, row, 0)):
            break
        below.append(line)
    number, line = lines[-1]
    names = next(reversed(_ways(line, separator, row)), None)
    # What begins like a row is passed over as no title.
    for n, text in lines if names is None else lines[-1:]:
        numbers = [bool(NUMBER.fullmatch(field)) for field in _split(text, separator)]
        like_row = len(numbers) == len(row) or 2 * sum(numbers) > max(len(numbers), 2)
        if not _is_comment(text) and numbers and numbers[0] and like_row:
            raise TableError(f"line {n} begins like a row of numbers, but is none")
    if _is_comment(line) and (names is None or any(map(NUMBER.fullmatch, names))):
        return None
    if names is None:
        raise TableError(
            f"line {len(above) + 1} holds {len(row)} numbers, but line {number} names "
            f"{len(_words(line, separator))}: each column needs a name, or none does"
        )
    titles = next(reversed(_ways(lines[-2][1], separator, row)), None) if len(lines) > 1 else None
    return _named(names, []) if titles is None or not _are_units(names) else _named(titles, names)


def _without_comment_sign(line: str) -> str:
    return line.lstrip(" " + _COMMENT).rstrip(" ")


def _words(line: str, separator: str) -> list[str]:
    line = _without_comment_sign(line)
    return _WORD.findall(line) if separator == _SPACES else _split(line, separator)


def _ways(line: str, separator: str, row: Sequence[str]) -> list[list[str]]:
    """Return the ways to split a line into the names of all columns.

    The last one is as the numbers are separated; any other must give a name of the time.
    """
    others = [_words(line, other) for other in _SEPARATORS if other not in (separator, _SPACES)]
    aligned = re.split(r"\s{2,}|\t", line.lstrip(" " + _COMMENT).rstrip())
    others.append([field.strip('"') for field in aligned])
    return [*filter(_names_time, _fitting(others, row)), *_fitting([_words(line, separator)], row)]


def _units(line: str, separator: str, row: Sequence[str], time: int) -> list[str]:
    """Return the fields of a line that holds units, that of the time in a given place; empty if it does not.

    A comment with as many words as there are columns need not hold units.
    """
    ways = _fitting([_split(_without_comment_sign(line), separator), *_ways(line, separator, row)], row)
    for way in ways:
        if _are_units(way) or same_dimension(parse_unit(_bare(way[time]) or ""), parse_unit("s")):
            return way
    return [] if _is_comment(line) or not ways or NUMBER.fullmatch(ways[0][time]) else ways[0]


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


def _is_time(name: str) -> bool:
    return name.casefold() == "time" or name == "t"


def _names_time(fields: Sequence[str]) -> bool:
    return any(_is_time(_name_and_unit(field)[0]) for field in fields)


def _named(names: Sequence[str], units: Sequence[str]) -> Heading:
    """Return names and units; brackets that tell apart what has one name are part of the name."""
    parts = [_name_and_unit(field) for field in names]
    bare = [name for name, _ in parts]
    for n, (name, unit) in enumerate(parts):
        if bare.count(name) > 1 and unit is not None and (parse_unit(unit) is None or unit.isdigit()):
            parts[n] = names[n].strip('"'), None
    final = [name for name, _ in parts]
    if twice := next((name for name in final if name and final.count(name) > 1), None):
        raise TableError(f"column {twice!r} occurs twice: which one is meant is ambiguous")
    below = [_bare(field) for field in units] or [None] * len(parts)
    return [(name, unit or beside) for (name, beside), unit in zip(parts, below, strict=True)]


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
    if not parts["space"] and (index or parse_unit(text) is None):
        return field.strip('"'), None
    return parts["name"].strip('"'), text or None


def _are_units(fields: Sequence[str]) -> bool:
    """Whether all fields are units, or in brackets."""
    written = [field for field in fields if field]
    return bool(written) and all(parse_unit(field) is not None or _bare(field) != field for field in written)


# The rows of numbers


def _rows(body: str, first: int, separator: str) -> tuple[str, str]:
    """Return the rows, as many lines, without comments and quotation marks, and their separator.

    A comment begins at the start of a line or after a space: ``1.#QNAN`` is none.
    """
    if any(sign in body for sign in _COMMENT):
        body = _without_comments(re.sub(rf"(?m)^[ \t]*[{_COMMENT}].*", "", body), separator)
    if separator != _SPACES:
        if f" {separator}" in body or " \n" in body:
            body = re.sub(rf" +(?=[{separator}\n])", "", body)  # pandas rounds what ends with a space
        if f"\n{separator}" in body:  # a spreadsheet's empty rows
            body = re.sub(rf"(?m)^{separator}+$", "", body)
    if '"' not in body:
        return body, separator
    lines, delimiter = body.split("\n"), separator
    if separator == _SPACES:
        lines, delimiter = [re.sub(r"[ \t]+", " ", line.strip(" \t")) for line in lines], " "
    reader = csv.reader(lines, delimiter=delimiter, skipinitialspace=True, strict=True)
    rows: list[str] = []
    with suppress(csv.Error):
        for fields in reader:
            if reader.line_num > len(rows) + 1:  # it takes a quoted line end for a part of a field
                break
            rows.append(_UNIT_SEPARATOR.join(fields))
    if len(rows) < len(lines):
        raise TableError(f"line {first + len(rows)}: a quotation mark is not closed in its field")
    return "\n".join(rows), _UNIT_SEPARATOR


def _decimal_sign(body: str, separator: str) -> tuple[str, str]:
    """Return the decimal sign, and the rows without the sign that separates thousands.

    The signs are those of the numbers of the whole text.
    """
    if separator == ",":
        return ".", body
    edge = r" \t\n" if separator == _SPACES else rf"{separator}\n"
    before, end = rf"(?P<before>(?:\A|[{edge}])[ \t]*)", rf"[ \t]*(?=[{edge}]|\Z)"

    def number(pattern: str) -> re.Match[str] | None:
        return re.search(rf"{before}(?P<n>{pattern}){end}", body)

    def one(sign: str) -> str:
        return rf"[+-]?(?:\d+[{sign}]\d*|[{sign}]\d+){_EXPONENT}"

    def both(thousands: str, decimal: str) -> str:
        """Match where each sign can have no other meaning."""
        groups, rest = rf"[+-]?[1-9]\d{{0,2}}(?:[{thousands}]\d{{3}})", rf"[{decimal}]\d*"
        return rf"(?:{groups}{{2,}}(?:{rest})?|{groups}{rest}){_EXPONENT}"

    patterns = {sign: [one(sign), both(".", ","), both(",", ".")] for sign in ".,"}
    seen = {
        sign: match["n"]
        for sign, tried in patterns.items()
        if sign in body and (match := next(filter(None, map(number, tried)), None))
    }
    signs = "".join(seen)
    if not signs:
        return ".", body
    if len(signs) == 1 and number(rf"(?![+-]?[1-9]\d{{0,2}}[{signs}]\d{{3}}{end}){one(signs)}"):
        return signs, body
    readings = [(d, g) for d, g in ((".", ","), (",", ".")) if g in signs and number(both(g, d))]
    if len(readings) != 1:
        numbers = " and ".join(map(repr, seen.values()))
        raise TableError(
            f"whether a point or a comma is the decimal sign is not clear from {numbers}: export the numbers "
            "without thousands separators, and not with three decimals"
        )
    decimal, group = readings[0]
    grouped = rf"[+-]?[1-9]\d{{0,2}}(?:[{group}]\d{{3}})+(?:[{decimal}]\d*)?{_EXPONENT}"
    return decimal, re.sub(
        rf"{before}{grouped}{end}", lambda match: match[0].replace(group, "").rstrip(" "), body
    )


def _frame(body: str, first: int, separator: str, decimal: str, count: int) -> pd.DataFrame:
    """Return the rows as pandas reads them; columns with anything but numbers are text."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", pd.errors.ParserWarning)  # it would drop what is too much
            frame = pd.read_csv(
                BytesIO(body.encode()),
                sep=separator,
                decimal=decimal,
                header=None,
                names=range(count),
                index_col=False,
                quoting=csv.QUOTE_NONE,
                skipinitialspace=True,
                keep_default_na=False,
                na_values=[""],
                low_memory=False,  # the type of a column follows from all of it
            )
    except (ValueError, pd.errors.ParserWarning) as error:
        for n, line in enumerate(body.split("\n"), first):
            if len(fields := _split(line, separator)) > count:
                message = f"line {n} holds {len(fields)} fields, but line {first} holds {count}"
                raise TableError(message) from None
        raise TableError(f"cannot be read: {' '.join(str(error).split())}") from error
    if separator == _SPACES and (short := np.flatnonzero(frame[count - 1].isna())).size:
        raise TableError(f"data row {short[0] + 1} holds fewer than {count} fields")
    return frame
