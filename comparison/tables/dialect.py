"""Text tables of any program: where the numbers begin, what the columns are called, which sign is decimal.

Lines end with a line feed, a carriage return or both, as in `csv` and pandas; other characters that Python
takes for line ends (form feed, U+2028) are part of a line. The text is cut where the numbers begin, so that
no line is counted twice, and pandas reads the rest.
"""

from __future__ import annotations

import csv
import re
import warnings
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from comparison.tables.arrays import Array
from comparison.tables.heading import (
    COMMENT,
    EXPONENT,
    NUMBER,
    SEPARATORS,
    SPACES,
    is_below_time,
    is_comment,
    is_time,
    names_and_units,
    split,
)
from comparison.tables.table import TableError

_HEAD = 1 << 18  # characters that must contain the first row of numbers
_LONGEST_LINE = 100_000
_RECENT = 3  # names, units, a line below them
_DEGREES = re.compile(r"^\s*inDegrees\s*=\s*(yes|no)\s*$", re.IGNORECASE | re.MULTILINE)
_UNIT_SEPARATOR = "\x1f"


@dataclass(frozen=True)
class Column:
    """Unconverted column of another program's table.

    Attributes
    ----------
    name, unit
        Without quotes and brackets; None where the table has no unit. A column without a name has that of its
        place, ``#2``.
    numbers
        Shape (n,); nan where there is none.
    text
        Row (from 1) and text of the first entry that is no number; None if all are.
    """

    name: str
    unit: str | None
    numbers: Array
    text: tuple[int, str] | None = None


@dataclass(frozen=True)
class Source:
    """Unconverted table of any program.

    Attributes
    ----------
    path
        Its file.
    columns
        In the order of the file, but for empty ones, and one that counts the rows, without a name.
    others
        Other contents of the file, which cannot be compared.
    nameless
        Whether the first column has no name and must be the time.
    degrees
        Whether its angles are in degrees, where the file says so; else None.
    plain
        Whether it is in the layout of this project's tables: one line of names with ``time``, commas.
    events, extrema, record
        Companions of a table of this project; None: there is no record of its origin.
    """

    path: Path
    columns: list[Column]
    others: list[str] = field(default_factory=list)
    nameless: bool = False
    degrees: bool | None = None
    plain: bool = False
    events: pd.DataFrame | None = None
    extrema: dict[str, Any] = field(default_factory=dict)
    record: dict[str, Any] | None = None

    @property
    def names(self) -> list[str]:
        """Names of the columns."""
        return [column.name for column in self.columns]


def position(n: int) -> str:
    """Return the name of a column by its place, counted from 0: ``#1`` for the first."""
    return f"#{n + 1}"


def decoded(content: bytes) -> str:
    """Return a text with line feeds; in UTF-8, UTF-16 with its mark, or as older Windows programs write it.

    Raises
    ------
    TableError
        Without the file: if it is no text.
    """
    try:
        text = content.decode("utf-16" if content[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig")
    except UnicodeDecodeError:
        text = content.decode("cp1252", errors="replace")
    if "\0" in text:
        raise TableError("has a zero byte: it is not text, or not in UTF-8")
    return text.replace("\r\n", "\n").replace("\r", "\n")


def parse_text(
    path: Path, text: str, separators: Sequence[str] = SEPARATORS, decimal: str | None = None
) -> Source:
    """Read the columns of a text.

    Parameters
    ----------
    path, text
        The file, and what it holds, with line feeds.
    separators
        Separators to try, in this order.
    decimal
        Sign; None: as the numbers show.

    Raises
    ------
    TableError
        Without the file, one line: if it contains no table, or is not clear.
    """
    lines, first, separator = _first_row(text, separators)
    above, row = lines[:first], _fields(lines[first], separator)
    below_size = _below_size(row, text, lines, first, separator)
    if below_size is not None:
        first, row = below_size, _fields(lines[below_size], separator)
    heading = names_and_units(list(enumerate(above, 1)), separator, row)
    if heading is None and below_size is None:
        _check_nameless(first + 1, lines[first], above, separator, row)
    names, units = heading or ([""] * len(row), [None] * len(row))
    text = text[sum(len(line) + 1 for line in lines[:first]) :]  # not both, which may be large
    text, separator = _rows(text, first + 1, separator)
    if decimal is None:
        decimal, text = _decimal_sign(text, separator)
    frame = _frame(text, first + 1, separator, decimal, len(row))
    columns: list[Column] = []
    for n, (name, unit) in enumerate(zip(names, units, strict=True)):
        made = column(name or position(len(columns)), unit, frame[n], decimal)
        counted = (np.arange(made.numbers.size) + begin for begin in (0, 1))
        is_index = n == 0 and heading is not None and any(np.array_equal(made.numbers, c) for c in counted)
        if name or not (is_index or frame[n].isna().all()):
            columns.append(made)
    first_texts = {0 if made.text is None else made.text[0] for made in columns}
    if len(first_texts) == 1 and (row_of_text := first_texts.pop()):
        raise TableError(f"text after data row {row_of_text - 1}: save one block of columns per file")
    degrees = _DEGREES.search("\n".join(above))
    return Source(
        path,
        columns,
        nameless=[made.name for made in columns[:1]] == [position(0)] and not any(map(is_time, names)),
        degrees=None if degrees is None else degrees[1].lower() == "yes",
        plain="time" in names and above == [",".join(names)],
    )


def column(name: str, unit: str | None, entries: pd.Series, decimal: str = ".") -> Column:
    """Return a column as pandas has read it; numbers that it has read as text have this decimal sign."""
    if entries.dtype.kind in "fiu":
        return Column(name, unit, entries.to_numpy(dtype=np.float64, na_value=np.nan))
    text = entries.astype("str").str.strip()
    plain = text.str.translate(str.maketrans(",.", ".,")) if decimal == "," else text
    plain = plain.str.replace(r"^\+([\d.])", r"\1", regex=True)  # pandas rounds what has a plus otherwise
    plain = plain.str.replace(
        r"^(-?[\d.]+)[dDqQ]([+-]?\d+)$|^(-?\d*\.\d*)([+-]\d{3})$", r"\1\3e\2\4", regex=True
    )
    numbers = pd.to_numeric(plain, errors="coerce").to_numpy(dtype=np.float64)
    absent = entries.isna() | text.str.fullmatch("[+-]?nan", case=False)
    wrong = np.flatnonzero(np.isnan(numbers) & ~absent.to_numpy(dtype=bool))
    return Column(name, unit, numbers, (int(wrong[0]) + 1, str(text.iloc[wrong[0]])) if wrong.size else None)


def _fields(line: str, separator: str) -> list[str]:
    return split(_uncommented(line, separator), separator)


def _first_row(text: str, separators: Sequence[str]) -> tuple[list[str], int, str]:
    """Return the first lines, the place of the first row of numbers among them, and its separator."""
    lines = text[:_HEAD].split("\n")[: None if len(text) <= _HEAD else -1]
    if any(len(line) > _LONGEST_LINE for line in lines):
        raise TableError(f"has a line of more than {_LONGEST_LINE} characters")
    recent: list[str] = []
    for n, line in enumerate(lines):
        tried = () if is_comment(line) else separators
        rows = {separator: _fields(line, separator) for separator in tried}
        fitting = [separator for separator, row in rows.items() if is_below_time(row, recent, separator)]
        if fitting := fitting + [separator for separator, row in rows.items() if _are_numbers(row)]:
            return lines, n, fitting[0]
        recent = [*recent, line][-_RECENT:] if line.strip() else recent
    raise TableError("contains no row of two or more numbers")


def _are_numbers(row: Sequence[str]) -> bool:
    """Whether fields are two or more numbers or empty ones."""
    written = [field for field in row if field]
    return len(row) > 1 and bool(written) and all(map(NUMBER.fullmatch, written))


def _check_nameless(number: int, line: str, above: Sequence[str], separator: str, row: Sequence[str]) -> None:
    """Reject a first row that need not be one of numbers, or whose columns are not clear without names."""
    written = [field for field in row if field]
    counted = any(written == [str(n + begin) for n in range(len(written))] for begin in (0, 1))
    if counted and not "".join(above).strip():  # as pandas and others write for want of names
        raise TableError(
            f"line {number} holds {', '.join(written)}, which may be names or numbers: write a line of names "
            "above it, or instead of it"
        )
    if separator == SPACES and "\t" in line.strip():
        raise TableError(f"line {number} has tabs and spaces between its numbers: write names above them")


def _below_size(
    row: Sequence[str], text: str, lines: Sequence[str], first: int, separator: str
) -> int | None:
    """Return the line below one that holds only the number of rows and of columns; None if this is none.

    Raises
    ------
    TableError
        If it may as well be the first of two columns' rows.
    """
    if len(row) != 2 or not all(re.fullmatch(r"[0-9]{1,9}", field) for field in row):
        return None
    rows, columns = map(int, row)
    below = next((n for n in range(first + 1, len(lines)) if lines[n].strip()), 0)
    fields = split(lines[below], separator)
    if not below or columns != len(fields):
        return None
    if rows != sum(bool(line.strip()) for line in text.split("\n")[below:]):
        return None
    if columns == 2 and not column("", None, pd.Series(fields[:1])).numbers[0] <= rows:
        raise TableError(
            f"line {first + 1} may be a row, or the size of the table: write a line of names above it"
        )
    return below


def _rows(body: str, first: int, separator: str) -> tuple[str, str]:
    """Return the rows without comments and quotation marks, and their separator; all lines remain.

    A comment begins at the start of a line or after a space: ``1.#QNAN`` is none. Lines are counted from the
    given one.
    """
    if any(sign in body for sign in COMMENT):
        body = _uncommented(re.sub(rf"(?m)^[ \t]*[{COMMENT}].*", "", body), separator)
    if separator != SPACES and (f" {separator}" in body or " \n" in body):
        body = re.sub(rf" +(?=[{separator}\n])", "", body)  # pandas rounds what ends with a space otherwise
    if separator != SPACES and f"\n{separator}" in body:  # a spreadsheet's empty rows
        body = re.sub(rf"(?m)^{separator}+$", "", body)
    if '"' not in body:
        return body, separator
    lines = body.split("\n")
    delimiter = separator
    if separator == SPACES:
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


def _uncommented(text: str, separator: str) -> str:
    """Return text without the comments after a space at the ends of lines."""
    if "#" not in text:
        return text
    space, last = ("[ \t]", "") if separator == SPACES else (" ", separator)  # "; #N/A ;" is none
    return re.sub(rf'(?m){space}#[^"\n{last}]*$', "", text)


def _decimal_sign(body: str, separator: str) -> tuple[str, str]:
    """Return the decimal sign, and the rows without the sign that separates thousands.

    Raises
    ------
    TableError
        If the numbers of the whole text can be read in two ways.
    """
    if separator == ",":
        return ".", body
    edge = r" \t\n" if separator == SPACES else rf"{separator}\n"
    before, end = rf"(?P<before>(?:\A|[{edge}])[ \t]*)", rf"[ \t]*(?=[{edge}]|\Z)"

    def number(pattern: str) -> re.Match[str] | None:
        return re.search(rf"{before}(?P<n>{pattern}){end}", body)

    def one(sign: str) -> str:
        return rf"[+-]?(?:\d+[{sign}]\d*|[{sign}]\d+){EXPONENT}"

    def both(thousands: str, decimal: str) -> str:
        """Match where each sign can have no other meaning."""
        groups, rest = rf"[+-]?[1-9]\d{{0,2}}(?:[{thousands}]\d{{3}})", rf"[{decimal}]\d*"
        return rf"(?:{groups}{{2,}}(?:{rest})?|{groups}{rest}){EXPONENT}"

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
        raise TableError(
            f"whether a point or a comma is the decimal sign is not clear from "
            f"{' and '.join(map(repr, seen.values()))}: export the numbers without thousands separators, and "
            "not with three decimals"
        )
    decimal, group = readings[0]
    fitting = rf"[+-]?[1-9]\d{{0,2}}(?:[{group}]\d{{3}})+(?:[{decimal}]\d*)?{EXPONENT}"
    return decimal, re.sub(
        rf"{before}(?P<n>{fitting}){end}",
        lambda match: match["before"] + match["n"].replace(group, ""),
        body,
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
            if len(fields := split(line, separator)) > count:
                raise TableError(
                    f"line {n} holds {len(fields)} fields, but line {first} holds {count}"
                ) from None
        raise TableError(f"cannot be read: {' '.join(str(error).split())}") from error
    if separator == SPACES and (short := np.flatnonzero(frame[count - 1].isna())).size:
        raise TableError(f"data row {short[0] + 1} holds fewer than {count} fields")
    return frame
