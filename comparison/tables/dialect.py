"""Text tables of any program: first row of numbers, names of the columns, decimal sign.

The separator, the line of names, and an unambiguous decimal sign are guessed. All else is refused with the
key of a mapping's ``[dialect]`` that settles it. Lines end as in `csv` and pandas: not with a form
feed or U+2028, at which Python splits too.
"""

import csv
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from comparison.tables.channels import Array, channels
from comparison.tables.mapping import TIME, Dialect
from comparison.tables.table import Table, TableError
from comparison.tables.units import parse_unit, same_dimension

_SPACES = r"\s+"  # the separator: any number of spaces and tabs
_SEPARATORS = (";", "\t", ",", _SPACES)
_COMMENTS = ("#", "%", "!")
_DIGIT = re.compile(r"\W*(?:\d|nan|inf)", re.IGNORECASE)  # beginning of a number, also of a misread one
_EXPONENT = r"(?:[eEdDqQ][+-]?\d+|[+-]\d{3})?"  # Fortran's has a D, or no letter before three digits
_FORTRAN = re.compile(  # 1.5D-3, 1.5-101
    r"([+-]?(?=\.?\d)\d*\.?\d*)[dDqQ]([+-]?\d+)|([+-]?(?=\.?\d)\d*\.\d*)([+-]\d{3})"
)
NUMBER = re.compile(
    rf"[+-]?(?=[.,]?\d)[\d.,]+{_EXPONENT}|[+-]?(?:nan|inf|infinity)(?:\(\w*\))?|[+-]?1[.,]#\w+",
    re.ASCII | re.IGNORECASE,
)
"""Any text that a program writes for a number, with any decimal sign."""
# Names separated by spaces: quoted or a single word, either with a unit in brackets.
# Of a line of units each is in brackets of its own. Brackets are short: the time to find them is bounded.
_BRACKETS = r"\[[^\]]{0,99}\]|\([^)]{0,99}\)"
_WORD = re.compile(rf'(?:"[^"]*"|[^\s"\[(](?:[^\s"\[(]|{_BRACKETS})*)(?:\s+(?:{_BRACKETS}))?|{_BRACKETS}')
_WITH_BRACKETS = re.compile(r"(?P<name>.*\S)(?P<space>\s*)(?:\[(?P<square>[^\]]*)\]|\((?P<round>[^)]*)\))")

Heading = list[tuple[str, str | None]]  # name and unit of each column


class Column(NamedTuple):
    """Unconverted column of another program's table."""

    name: str  # without quotes and brackets; of a nameless column its place, ``#2``
    unit: str | None
    numbers: Array  # nan where there is none
    text: tuple[str, str] | None = None  # of the first entry that is no number: place, such as "line 7", text


@dataclass(frozen=True)
class Source:
    """Unconverted table of any program."""

    path: Path
    columns: list[Column]  # without empty columns and row counters that have no name
    others: list[str] = field(default_factory=list)  # other contents of the file, which cannot be compared
    notes: list[str] = field(default_factory=list)  # warnings
    companions: Table = field(default_factory=lambda: Table(pd.DataFrame()))
    """Its events, pulses, extrema and provenance, where it has them; their frame is empty or ignored."""

    @property
    def names(self) -> list[str]:
        """Names of the columns."""
        return [column.name for column in self.columns]

    @property
    def time_name(self) -> str | None:
        """Name of the time's column: by its name, else a nameless first column; None without one."""
        names = [name for name in self.names if name_and_unit(name)[0] == name]  # Parquet's state no unit
        place = time_place(names)
        nameless = position(0) if self.names[:1] == [position(0)] else None
        return nameless if place is None else names[place]


class _Line(NamedTuple):
    number: int  # in the file, from 1
    text: str


class _Layout(NamedTuple):
    """Rules by which the lines of a table are split, and its first row."""

    separator: str
    comments: tuple[str, ...]  # the signs with which they begin
    thousands: str = ""
    row: Sequence[str] = ()

    def is_comment(self, line: str) -> bool:
        return line.lstrip(" \t").startswith(self.comments)

    def fields(self, line: str) -> list[str]:
        """Return the fields of a row without a comment at its end; of guessed signs only ``#`` begins one."""
        if self.comments and self.comments[0] in line:
            line = re.sub(rf'[ \t]{re.escape(self.comments[0])}[^"]*$', "", line)
        fields = self._split(line)
        if sign := re.escape(self.thousands):
            pattern = re.compile(rf"^[+-]?[1-9]\d{{0,2}}(?:{sign}\d{{3}})+(?!\d|{sign})")
            fields = [pattern.sub(lambda match: match[0].replace(self.thousands, ""), f) for f in fields]
        return fields

    def _split(self, line: str) -> list[str]:
        """Return the fields of a line without quotation marks and spaces around them."""
        if self.separator == _SPACES:
            return [field.strip('"') for field in re.split(r"[ \t]+", line.strip(" \t"))]
        if '"' not in line:
            return [field.strip() for field in line.split(self.separator)]
        rows = csv.reader([line], delimiter=self.separator, skipinitialspace=True)
        return [field.strip() for field in next(rows, [])]

    def words(self, line: str) -> list[str]:
        """Return the names or units of all columns in a line, which may be a comment; else none."""
        signs = "|".join(map(re.escape, self.comments)) or " "
        line = re.sub(rf"^(?: |{signs})*", "", line).rstrip(" ")
        if self.separator == _SPACES:
            return self.fit([word.strip('",;') for word in _WORD.findall(line)])
        return self.fit(self._split(line))

    def fit(self, fields: list[str]) -> list[str]:
        """Return fields if they are as many as the row's, apart from a separator at the end; else none."""
        if len(fields) == len(self.row) + 1 and not fields[-1]:
            fields = fields[:-1]
        if len(fields) == len(self.row) - 1 and not self.row[-1]:
            fields = [*fields, ""]
        return fields if len(fields) == len(self.row) else []

    def units(self, line: str, time: int) -> list[str]:
        """Return the fields of a line of units, with a unit of time in the time's column; else none."""
        fields = self.words(line)
        time_unit = parse_unit(_strip_brackets(fields[time]) or "") if fields else None
        return fields if same_dimension(time_unit, parse_unit("s")) else []

    def check_comment(self, line: _Line) -> None:
        """Reject a comment that may be a row or another heading, if its sign is guessed."""
        text = line.text.strip()
        is_row = len(self.fields(text)) == len(self.row)
        if self.comments == _COMMENTS and (is_row or self.words(text)):
            may_be = f"a comment, a row or another heading: {text[:60]!r}"
            raise TableError(f"line {line.number} may be {may_be}: {remedy('comment')}")


def position(n: int) -> str:
    """Return the name of a column by its place, counted from 0: ``#1`` for the first."""
    return f"#{n + 1}"


MAPPING = "a mapping (--mapping, or [mapping] of a pair file)"
"""A mapping, in messages of ``sixbar compare``, ``reliability`` and ``judge``."""


def remedy(keys: str) -> str:
    """Return the end of a message: the keys of a mapping that settle how a table is read."""
    return f"state {keys} in [dialect] of {MAPPING}"


def decode(content: bytes) -> str:
    """Return a text with line feeds, of UTF-8, UTF-16 with its mark, or the code of old Windows programs."""
    try:
        text = content.decode("utf-16" if content[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig")
    except UnicodeDecodeError:
        text = content.decode("cp1252", errors="replace")
    if "\0" in text:
        raise TableError("has a zero byte: it is not text, or not in UTF-8")
    text = text.lstrip("\ufeff").replace("\r\n", "\n").replace("\r", "\n")
    return re.sub(r"\x1a+\s*\Z", "", text)  # DOS ends a file so


def parse_text(path: Path, text: str, dialect: Dialect) -> Source:
    """Read the columns of a text with line feeds; unclear ones are a `TableError` without the file's name."""
    lines = [_Line(n, line) for n, line in enumerate(text.split("\n"), 1) if line.strip(" \t")]
    if not lines:
        raise TableError("is empty")
    titles = [line for line in lines if line.number > (dialect.skip or 0)]
    first, layout = _first_row(titles, dialect)
    rows = dict(_rows(titles[first:], layout))
    for number, fields in rows.items():
        if not any(map(_DIGIT.match, fields)):
            raise TableError(f"line {number} is text: save one block per file, or {remedy('skip')}")
    size = [str(len(rows)), str(len(layout.row))]  # a line of these numbers alone is a title
    head = [line for line in titles[:first] if line.text.split() != size]
    heading, notes = _heading(head, layout, dialect)
    if not heading and dialect.skip is None and dialect.names is None and dialect.separator is None:
        _check_nameless(titles[first], layout, len(rows), alone=not first)
    decimal = _decimal_sign(rows.values(), layout.separator, dialect)
    columns: list[Column] = []
    for n, (name, unit) in enumerate(heading or [("", None)] * len(layout.row)):
        if unit and " " in unit and parse_unit(unit) is None and name not in channels():
            notes.append(f"{unit!r} beside {name} is not a unit")
            unit = None
        entries = pd.Series([fields[n] for fields in rows.values()], dtype=object)
        column = read_column(name or position(len(columns)), unit, entries, decimal, [*rows])
        counts = (np.arange(column.numbers.size) + begin for begin in (0, 1))
        is_index = n == 0 and bool(heading) and any(np.array_equal(column.numbers, c) for c in counts)
        if name or (any(entries) and not is_index):
            columns.append(column)
    return Source(path, columns, notes=notes)


def read_column(
    name: str,
    unit: str | None,
    entries: pd.Series,
    decimal: str = ".",
    lines: Sequence[int] = (),
) -> Column:
    """Return a column as numbers; text has this decimal sign and comes from these lines."""
    if entries.dtype.kind in "fiu":
        return Column(name, unit, entries.to_numpy(dtype=np.float64, na_value=np.nan))
    pairs = zip(entries, entries.notna(), strict=True)
    texts = [str(entry).strip() if is_known else "" for entry, is_known in pairs]
    swap = str.maketrans(",.", ".,")
    literals = [text.translate(swap) for text in texts] if decimal == "," else texts
    numbers = np.array([_value(text) for text in literals])
    for n in np.flatnonzero(np.isnan(numbers)).tolist():
        if texts[n].lstrip("+-").lower() not in ("", "nan"):
            place = f"line {lines[n]}" if lines else f"data row {n + 1}"
            return Column(name, unit, numbers, (place, texts[n]))
    return Column(name, unit, numbers)


def _value(text: str) -> float:
    """Return the number that a text with a decimal point denotes; nan if it denotes none."""
    if "_" in text or not text.isascii():  # Python would read these as numbers
        return np.nan
    try:
        return float(text)
    except ValueError:
        match = _FORTRAN.fullmatch(text)
        return float(f"{match[1] or match[3]}e{match[2] or match[4]}") if match else np.nan


# ---- where the numbers begin


def _first_row(lines: Sequence[_Line], dialect: Dialect) -> tuple[int, _Layout]:
    """Return the place of the first row of numbers among lines, and the layout of the lines.

    Either all its fields are numbers, and the next row has as many; or both rows have a number below the name
    of the time.
    """
    separator = _SPACES if dialect.separator == " " else dialect.separator
    comments = _COMMENTS if dialect.comment is None else (dialect.comment,) * bool(dialect.comment)
    separators = _SEPARATORS if separator is None else (separator,)
    options = [_Layout(each, comments, dialect.thousands or "") for each in separators]
    rows = [n for n, line in enumerate(lines) if not options[0].is_comment(line.text)]
    for n, below in zip(rows, [*rows[1:], *rows[-1:]], strict=True):
        layouts = [way._replace(row=way.fields(lines[n].text)) for way in options]
        for layout in sorted(layouts, key=lambda layout: not _are_numbers(layout.row)):
            titles = (layout.words(line.text) for line in lines[max(n - 3, 0) : n])  # names, units, a remark
            names = [layout.fit(dialect.names)] if dialect.names else [*titles]
            if len(layout.row) < 2 or (dialect.names and not any(names)):
                continue
            numeric, following = _are_numbers(layout.row), layout.fields(lines[below].text)
            alike = len(following) == len(layout.row) and any(map(NUMBER.fullmatch, following))
            times = [place for place in map(time_place, names) if place is not None]
            at_time = [place for place in times if NUMBER.fullmatch(layout.row[place])]
            below_time = numeric or (alike and any(NUMBER.fullmatch(following[place]) for place in at_time))
            if (at_time and below_time) or (numeric and alike):
                return n, layout
    keys = remedy("separator, decimal, thousands, skip, names")
    raise TableError(f"contains no row of two or more numbers: {keys}")


def _are_numbers(fields: Sequence[str]) -> bool:
    """Return whether all fields that are not empty, one at least, are numbers."""
    entries = [*filter(None, fields)]
    return bool(entries) and all(map(NUMBER.fullmatch, entries))


def _rows(lines: Iterable[_Line], layout: _Layout) -> Iterator[tuple[int, list[str]]]:
    """Yield number and fields of each row; skip rows of separators alone, which spreadsheets write."""
    for line in lines:
        if layout.is_comment(line.text):
            layout.check_comment(line)
        elif any(fields := layout.fields(line.text)):
            if len(fields) != len(layout.row) or line.text.count('"') % 2:
                rule = f"must hold {len(layout.row)} fields, as the first row, and close quotation marks"
                raise TableError(f"line {line.number} {rule}: {remedy('separator')}")
            yield line.number, fields


def _check_nameless(line: _Line, layout: _Layout, rows: int, *, alone: bool) -> None:
    """Reject a first row that may be names or a size, or whose columns are not clear without names."""
    entries = [field for field in layout.row if field]
    counts = [[str(n + begin) for n in range(len(entries))] for begin in (0, 1)]
    if (alone and entries in counts) or entries == [str(rows - 1), "2"]:
        may_be = f"line {line.number} holds {', '.join(entries)}, which may be names or numbers, or a size"
        keys = remedy(f"skip = 0 (names), names = [] (numbers) or both, with skip = {line.number} (size)")
        raise TableError(f"{may_be}: {keys}")
    if layout.separator == _SPACES and "\t" in line.text.strip():
        raise TableError(f"line {line.number} has tabs and spaces between its numbers: {remedy('separator')}")


def _decimal_sign(rows: Iterable[Sequence[str]], separator: str, dialect: Dialect) -> str:
    """Return the decimal sign of all numbers: the stated one, else the one that makes all readable."""
    if decimal := dialect.decimal or {".": ",", ",": "."}.get(dialect.thousands or ""):
        return decimal
    fields = [field for row in rows for field in row if "," in field or "." in field]
    examples = {sign: next((f for f in fields if sign in f and NUMBER.fullmatch(f)), "") for sign in ".,"}
    if not any(examples.values()) or (separator == "," and not examples[","]):
        return "."
    sign = max(examples, key=lambda each: len(examples[each]))
    pattern = re.compile(
        rf"(?![+-]?[1-9]\d{{0,2}}[{sign}]\d{{3}}$)[+-]?(\d+[{sign}]\d*|[{sign}]\d+){_EXPONENT}"
    )
    if all(examples.values()) or not any(map(pattern.fullmatch, fields)):
        numbers = " and ".join(map(repr, dict.fromkeys(filter(None, examples.values()))))
        problem = f"whether a point or a comma is the decimal sign is not clear from {numbers}"
        raise TableError(f"{problem}: {remedy('decimal (and thousands)')}")
    return sign


# ---- names of the columns


def _heading(head: Sequence[_Line], layout: _Layout, dialect: Dialect) -> tuple[Heading, list[str]]:
    """Return names and units from the lines above the first row, none if they name no columns; and notes.

    The names are in the last line that names the time, which may be a comment, else in the line above the
    rows if its separators part single words; where a mapping skips lines, in the next one. Without names, or
    where a mapping states them, all lines are comments.
    """
    names_in = [layout.words(line.text) for line in head]
    candidates = [n for n, names in enumerate(names_in) if time_place(names) is not None]
    if not candidates and head and layout.separator != _SPACES and not layout.is_comment(head[-1].text):
        words = all(name[:1].isalpha() and " " not in name for name in names_in[-1])
        candidates = [len(head) - 1] if names_in[-1] and words else []
    if dialect.skip is not None:
        candidates = [n for n, names in enumerate(names_in) if names][:1]
    if dialect.names is not None or not candidates:
        for line in head:
            # A comment that begins with the time names the columns, but not all.
            is_title = not layout.is_comment(line.text) or re.match(r"(?i)\W*time\b", line.text)
            if NUMBER.fullmatch(layout.fields(line.text)[0]) or (dialect.names is None and is_title):
                may_be = "may be a row, name the columns or be a title"
                keys = remedy("decimal, thousands, names or skip (lines above the names, or the numbers)")
                raise TableError(f"line {line.number} {may_be}: {keys}")
        if head and dialect.names is None:
            layout.check_comment(head[-1])
        return _parse_names(layout.fit(dialect.names or []), []), []
    place, names = candidates[-1], names_in[candidates[-1]]
    time, units = time_place(names) or 0, list[str]()
    for line in head[place + 1 :]:
        fields = layout.units(line.text, time)
        if fields and not units:
            units = fields
        elif layout.is_comment(line.text):
            layout.check_comment(line)
        else:
            problem = "is not one line of units, nor a row of numbers"
            raise TableError(f"line {line.number}, below the names, {problem}: {remedy('names')}")
    return _parse_names(names, units), list(_titles(head[:place], layout, time))


def _titles(lines: Sequence[_Line], layout: _Layout, time: int) -> Iterator[str]:
    """Yield remarks on lines above the names that may be names too; reject a line that probably is."""
    for line in lines:
        fields = [] if layout.is_comment(line.text) else layout.words(line.text)
        belongs = layout.separator != _SPACES and len(fields) > 2 and all(fields[1:])
        if belongs or layout.units(line.text, time):
            may_be = f"line {line.number}, above the names, may be names or units of the columns as well"
            raise TableError(f"{may_be}: {remedy(f'skip = {line.number} (a title) or names')}")
        if sum(map(bool, fields)) > 1 or re.search(r"(?i)\bunits?\b|degrees|radians", line.text):
            yield f"line {line.number} is taken for a title: {line.text.strip()[:60]!r}"


def time_place(fields: Sequence[str]) -> int | None:
    """Return the place of the time: ``time`` in any case, else ``t``, else Simulink's ``tout``; else None."""
    stems = [name_and_unit(field)[0] for field in fields]
    names = [TIME if name.casefold() == TIME else name for name in stems]
    return next((names.index(name) for name in (TIME, "t", "tout") if name in names), None)


def _parse_names(names: Sequence[str], units: Sequence[str]) -> Heading:
    parts = [name_and_unit(field) for field in names]
    stems = [name for name, _ in parts]
    if duplicate := next((name for name in stems if name and stems.count(name) > 1), None):
        raise TableError(f"column {duplicate!r} occurs twice, which is ambiguous: {remedy('names')}")
    heading: Heading = []
    for (name, beside), entry in zip(parts, units or [""] * len(parts), strict=True):
        below = _strip_brackets(entry)
        if beside and below and beside != below and parse_unit(beside) != parse_unit(below):
            both = f"column {name!r} states {beside!r} beside its name and {below!r} below it"
            raise TableError(f"{both}: {remedy('names')}")
        heading.append((name, beside or below))
    return heading


def _strip_brackets(field: str) -> str | None:
    """Return a unit without its brackets; None for an empty field."""
    inside = re.fullmatch(r"\[(.*)\]|\((.*)\)", field)
    return (inside[1] or inside[2] or "" if inside else field).strip() or None


def name_and_unit(field: str) -> tuple[str, str | None]:
    """Return name and unit of ``x [mm]``, ``x(mm)`` or ``x``; ``r[1]`` and ``der(x)`` are names."""
    parts = _WITH_BRACKETS.fullmatch(field)
    unit = (parts["square"] or parts["round"] or "").strip() if parts else ""
    if parts is None:
        return field, None
    is_name = parse_unit(unit) is None or unit.isdigit() or parts["name"].endswith("der")
    if is_name and not parts["space"]:
        return field, None
    return parts["name"].strip('"'), unit or None
