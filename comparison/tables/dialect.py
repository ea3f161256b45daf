"""Text tables of any program: where the numbers begin, what the columns are called, which sign is decimal.

Guessed are the separator, the line of names, and a sign of numbers that has one reading. All else is refused
with the key of a mapping's ``[dialect]`` that settles it. Lines end as in `csv` and pandas: not with a form
feed or U+2028, at which Python splits too.
"""

import csv
import re
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from comparison.tables.channels import Array, channels
from comparison.tables.mapping import Dialect, parse_unit, same_dimension
from comparison.tables.table import Columns, TableError

_HEAD = 1 << 18  # characters that must contain the first row of numbers
_LONGEST_LINE = 100_000
_LONGEST_NAME = 1_000

_SPACES = r"\s+"  # the separator: any number of spaces and tabs
_SEPARATORS = (";", "\t", ",", _SPACES)
_COMMENTS = ("#", "%", "!")
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
_ANGLES = re.compile(r"(?i)\bin_?degrees\s*[=:]\s*(yes|true|1|no|false|0)\b")

Heading = list[tuple[str, str | None]]  # name and unit of each column


class Column(NamedTuple):
    """Unconverted column of another program's table."""

    name: str  # without quotes and brackets; of one without a name that of its place, ``#2``
    unit: str | None
    numbers: Array  # nan where there is none
    text: tuple[str, str] | None = None  # place, such as "line 7", and text of the first that is no number


@dataclass(frozen=True)
class Source:
    """Unconverted table of any program."""

    path: Path
    columns: list[Column]  # without empty ones, and one that counts the rows, that have no name
    others: list[str] = field(default_factory=list)  # other contents of the file, which cannot be compared
    notes: list[str] = field(default_factory=list)  # warnings
    angles: str | None = None  # unit that the file states for all its angles: "deg" or "rad"
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


class _Line(NamedTuple):
    number: int  # in the file, from 1
    text: str


class _Layout(NamedTuple):
    """How the lines of a table are split, and its first row."""

    separator: str
    comments: tuple[str, ...]  # the signs with which they begin
    row: list[str]

    def is_comment(self, line: str) -> bool:
        return line.lstrip(" \t").startswith(self.comments)

    def words(self, line: str, separator: str = "") -> list[str]:
        """Return the fields of a line of names or units, which may be a comment."""
        signs = "|".join(map(re.escape, self.comments)) or " "
        line, separator = re.sub(rf"^(?: |{signs})*", "", line).rstrip(" "), separator or self.separator
        if separator == _SPACES:
            return [word.strip('"') for word in _WORD.findall(line)]
        return _split(line, separator)

    def fitted(self, fields: list[str]) -> list[str]:
        """Return fields, one for each of the row but for a separator at the end of either; else none."""
        if len(fields) == len(self.row) + 1 and not fields[-1]:
            fields = fields[:-1]
        if len(fields) == len(self.row) - 1 and not self.row[-1]:
            fields = [*fields, ""]
        if len(fields) != len(self.row):
            return []
        if any(len(field) > _LONGEST_NAME for field in fields):
            raise TableError(f"has a name of more than {_LONGEST_NAME} characters")
        return fields

    def names(self, line: str) -> list[str]:
        """Return the names of all columns in a line, separated as the numbers, or otherwise with the time."""
        # A comma in the row that separates the names may do so in the row as well.
        used = {self.separator, _SPACES, *"".join(self.row)}
        ways = (self.fitted(self.words(line, other)) for other in _SEPARATORS if other not in used)
        return next((way for way in ways if _time(way) is not None), self.fitted(self.words(line)))

    def is_heading(self, line: str) -> bool:
        """Whether a comment holds the names, with the time, or the units of all columns."""
        names = self.names(line)
        return _time(names) is not None or _are_units(names)

    def units(self, line: str, time: int | None) -> list[str]:
        """Return the fields of a line that holds units; empty if it does not.

        They are known units, or in brackets; all others must stand beside one of time in its column.
        """
        fields = self.fitted(self.words(line))
        at_time = None if time is None or not fields else parse_unit(_bare(fields[time]) or "")
        return fields if _are_units(fields) or same_dimension(at_time, parse_unit("s")) else []

    def check_comment(self, line: _Line) -> None:
        """Reject a comment that may be a row whose first field is no number, unless its sign is stated."""
        fields = _fields(line.text.strip(" "), self.separator, self.comments)
        number = rf"(?i)[#%!].*|[^a-z]*\d[^a-z]*|{NUMBER.pattern}"
        alike = self.separator != _SPACES or all(re.fullmatch(number, field) for field in fields)
        fits = len(fields) == len(self.row) and self.comments == _COMMENTS
        if fits and alike and not self.units(line.text, None):
            raise TableError(f"line {line.number} may be a comment or a row: {settled('comment')}")


def position(n: int) -> str:
    """Return the name of a column by its place, counted from 0: ``#1`` for the first."""
    return f"#{n + 1}"


def settled(keys: str) -> str:
    """Return what a message says of the keys that settle how a table is to be read."""
    return f"state {keys} in [dialect] of a mapping (--mapping)"


def decoded(content: bytes) -> str:
    """Return a text with line feeds, of UTF-8, UTF-16 with its mark, or the code of old Windows programs."""
    try:
        text = content.decode("utf-16" if content[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig")
    except UnicodeDecodeError:
        text = content.decode("cp1252", errors="replace")
    if "\0" in text:
        raise TableError("has a zero byte: it is not text, or not in UTF-8")
    text = text.lstrip("\ufeff").replace("\r\n", "\n").replace("\r", "\n")
    end = text[-100:].rstrip()
    return text[:-100] + end.rstrip("\x1a") if end.endswith("\x1a") else text  # of DOS: the end of a file


def parse_text(path: Path, text: str, dialect: Dialect | None = None) -> Source:
    """Read the columns of a text with line feeds; a `TableError`, without the file, if they are not clear."""
    dialect = dialect or Dialect()
    comments = _COMMENTS if dialect.comment is None else (dialect.comment,) * bool(dialect.comment)
    if dialect.thousands not in (None, ","):
        text = _ungrouped(text, dialect.thousands)
    lines = text[:_HEAD].split("\n")[: None if len(text) <= _HEAD else -1]
    if any(len(line) > _LONGEST_LINE for line in lines):
        raise TableError(f"has a line of more than {_LONGEST_LINE} characters")
    start = dialect.skip or 0
    first, layout = _first_row(lines, start, dialect, comments)
    offset = sum(len(line) + 1 for line in lines[:first])
    body = _rows(text[offset:], layout)
    if dialect.thousands == ",":
        body = _ungrouped(body, ",", quoted=layout.separator == ",")
    numbers = [n for n, line in enumerate(body.split("\n"), first + 1) if line.strip(" \t")]
    size = [str(len(numbers)), str(len(layout.row))]  # a line of these numbers alone is a title
    above = [_Line(n, line) for n, line in enumerate(lines[:first], 1) if n > start and line.split() != size]
    heading, notes = _heading(above, layout, dialect)
    if heading is None and dialect.skip is None and dialect.names is None and dialect.separator is None:
        _check_nameless(
            _Line(first + 1, lines[first]), layout, len(numbers), alone=not "".join(lines[:first]).strip()
        )
    if dialect.comment is None:
        _check_comments(text, offset, layout)
    decimal = _decimal_sign(body, layout.separator, dialect)
    frame = _frame(body, numbers, layout.separator, decimal, len(layout.row))
    stated = [match[1].casefold() for line in above if (match := _ANGLES.search(line.text))][-1:]
    angles = None if not stated else "deg" if stated[0] in ("yes", "true", "1") else "rad"
    columns: list[Column] = []
    for n, (name, unit) in enumerate(heading or [("", None)] * len(layout.row)):
        if angles and not unit and name in channels() and "rad" in channels()[name].unit:
            unit = channels()[name].unit.replace("rad", angles)
        column = read_column(name or position(len(columns)), unit, frame[n], decimal, numbers)
        counted = (np.arange(column.numbers.size) + begin for begin in (0, 1))
        is_index = n == 0 and heading is not None and any(np.array_equal(column.numbers, c) for c in counted)
        if name or not (is_index or frame[n].isna().all()):
            columns.append(column)
    names = [name for name, _ in heading or ()]
    return Source(
        path,
        columns,
        notes=notes,
        angles=angles,
        nameless=[column.name for column in columns[:1]] == [position(0)] and _time(names) is None,
        plain="time" in names and [line.text for line in above] == [",".join(names)],
    )


def read_column(
    name: str, unit: str | None, entries: pd.Series, decimal: str = ".", lines: Sequence[int] = ()
) -> Column:
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
    for n in np.flatnonzero(np.isnan(numbers) & ~absent.to_numpy(dtype=bool))[:1]:
        place = f"line {lines[n]}" if lines else f"data row {n + 1}"
        return Column(name, unit, numbers, (place, str(text.iloc[n])))
    return Column(name, unit, numbers)


# ---- where the numbers begin


def _split(line: str, separator: str) -> list[str]:
    """Return the fields of a line without quotation marks and spaces around them."""
    if separator == _SPACES:
        return [field.strip('"') for field in re.split(r"[ \t]+", line.strip(" \t"))]
    rows = csv.reader([line], delimiter=separator, skipinitialspace=True)
    return [field.strip() for field in next(rows, [])]


def _fields(line: str, separator: str, comments: tuple[str, ...]) -> list[str]:
    return _split(_without_comments(line, separator, comments), separator)


def _without_comments(text: str, separator: str, comments: tuple[str, ...]) -> str:
    """Return text without the comments after a space at the ends of lines: of those guessed only ``#``."""
    if not comments or comments[0] not in text:
        return text
    space, last = ("[ \t]", "") if separator == _SPACES else (" ", separator)  # "; #N/A ;" is none
    return re.sub(rf'(?m){space}{re.escape(comments[0])}[^"\n{re.escape(last)}]*$', "", text)


def _ungrouped(text: str, group: str, *, quoted: bool = False) -> str:
    """Return text without the signs that separate thousands: between commas only those of quoted numbers."""
    sign, other = re.escape(group), r"\w.," if group in ".," else r"\w"
    before = '(?<=")' if quoted else rf"(?<![{other}])"
    grouped = rf"{before}[+-]?[1-9]\d{{0,2}}(?:{sign}\d{{3}})+(?!\d|{sign})"
    return re.sub(grouped, lambda match: match[0].replace(group, ""), text)


def _first_row(
    lines: Sequence[str], start: int, dialect: Dialect, comments: tuple[str, ...]
) -> tuple[int, _Layout]:
    """Return the place of the first row of numbers among lines, and how it is split.

    All its fields are numbers, and the next row has as many; or it has a number below the name of the time,
    as the next row has. Below names that a mapping states a row may hold any text beside that number.
    """
    stated = _SPACES if dialect.separator == " " else dialect.separator
    separators = _SEPARATORS if stated is None else (stated,)
    known = bool(dialect.names) or (dialect.skip is not None and dialect.names is None)
    rows = [
        n
        for n in range(start, len(lines))
        if lines[n].strip() and not lines[n].lstrip(" \t").startswith(comments)
    ]
    for n, below in zip(rows, [*rows[1:], None], strict=True):
        above = [line for line in lines[max(start, n - 9) : n] if line.strip()][-3:]  # names, units, a remark
        layouts = [_Layout(each, comments, _fields(lines[n], each, comments)) for each in separators]
        layouts.sort(key=lambda layout: not all(map(NUMBER.fullmatch, filter(None, layout.row))))
        for layout in layouts:
            after = None if below is None else _fields(lines[below], layout.separator, comments)
            headings = [dialect.names] if dialect.names else map(layout.words, above)
            names = [*filter(None, map(layout.fitted, headings))]
            if _begins(layout.row, after, names, known=known):
                return n, layout
    raise TableError(
        f"contains no row of two or more numbers: {settled('separator, decimal, thousands, skip, names')}"
    )


def _begins(row: list[str], after: list[str] | None, headings: list[list[str]], *, known: bool) -> bool:
    """Whether the numbers of a table begin in a row, below what may be the names of its columns."""
    numbers = [bool(NUMBER.fullmatch(field)) for field in row]
    again = [bool(NUMBER.fullmatch(field)) for field in after or row]
    whole = any(numbers) and all(number or not field for number, field in zip(numbers, row, strict=True))
    alike = len(again) == len(row) and any(again)
    places = [n for n in map(_time, headings) if n is not None]
    below_time = any(numbers[n] and (whole or (alike and again[n])) for n in places)
    if len(row) < 2 or (known and not headings):
        return False
    return below_time or (whole and (known or alike))


def _check_nameless(line: _Line, layout: _Layout, rows: int, *, alone: bool) -> None:
    """Reject a first row that need not be one of numbers, or whose columns are not clear without names."""
    written = [field for field in layout.row if field]
    may_be = f"line {line.number} holds {', '.join(written)}, which may be"
    if alone and any(written == [str(n + begin) for n in range(len(written))] for begin in (0, 1)):
        raise TableError(f"{may_be} names or numbers: {settled('skip = 0 (names) or names = [] (numbers)')}")
    if written == [str(rows - 1), "2"]:
        keys = settled(f"names = [] (a row), and skip = {line.number} (its size)")
        raise TableError(f"{may_be} a row, or the size of the table: {keys}")
    if layout.separator == _SPACES and "\t" in line.text.strip():
        raise TableError(
            f"line {line.number} has tabs and spaces between its numbers: {settled('separator')}"
        )


# ---- what the columns are called


def _heading(above: Sequence[_Line], layout: _Layout, dialect: Dialect) -> tuple[Heading | None, list[str]]:
    """Return names and units from the lines above the first row, None if they name no columns; and notes.

    The names are in the last line that names the time, else in the last line, or in the one above it if the
    last one holds units. Either may be a comment. Below the lines that a mapping skips they follow at once.
    """
    lines = [line for line in above if line.text.strip(_RULE)]
    if dialect.names is not None:
        _check_above(lines, layout)
        stated = layout.fitted(dialect.names)
        return (_named(stated, []) if stated else None), []
    names_in = [layout.names(line.text) for line in lines]
    likely = [n for n, names in enumerate(names_in) if _time(names) is not None]
    if dialect.skip is not None:
        likely = [n for n, line in enumerate(lines) if names_in[n] or not layout.is_comment(line.text)][:1]
    place = likely[-1] if likely else _last_names(lines, names_in, layout)
    if place is None:
        return None, []
    if not (names := names_in[place]):
        count = f"line {lines[place].number} names {len(layout.words(lines[place].text))}"
        raise TableError(
            f"the rows hold {len(layout.row)} numbers, but {count}: {settled('names, skip or separator')}"
        )
    units = _units_below(lines[place + 1 :], layout, _time(names))
    return _named(names, units), list(_titles(lines[:place], names, layout))


def _last_names(lines: Sequence[_Line], names_in: Sequence[list[str]], layout: _Layout) -> int | None:
    """Return the place of the last line, or of the one above units; None if it is a comment without names."""
    _check_above(lines, layout)
    if not lines:
        return None
    last, names = len(lines) - 1, names_in[-1]
    if layout.is_comment(lines[last].text) and (not names or any(map(NUMBER.fullmatch, names))):
        layout.check_comment(lines[last])
        # One that begins with the time names the columns, but not all.
        return last if not names and _time(layout.words(lines[last].text)[:1]) == 0 else None
    return last - 1 if last and _are_units(names) and names_in[last - 1] else last


def _check_above(lines: Sequence[_Line], layout: _Layout) -> None:
    """Reject what begins like a row and is none: it is passed over as no title."""
    for line in lines:
        is_number = [bool(NUMBER.fullmatch(field)) for field in _split(line.text, layout.separator)]
        like_row = len(is_number) == len(layout.row) or 2 * sum(is_number) > max(len(is_number), 2)
        if is_number[:1] == [True] and like_row:
            keys = settled(f"skip = {line.number} (a title), or decimal, thousands")
            raise TableError(f"line {line.number} begins like a row of numbers, but is none: {keys}")


def _units_below(lines: Sequence[_Line], layout: _Layout, time: int | None) -> list[str]:
    """Return the units in the one line below the names that is no remark; empty without such a line."""
    units: list[str] = []
    for line in lines:
        fields = layout.units(line.text, time)
        if not fields and layout.is_comment(line.text) and not layout.is_heading(line.text):
            layout.check_comment(line)
            continue
        if units or not fields:
            problem = "holds units again" if fields else "is neither units nor a row of numbers"
            raise TableError(f"line {line.number}, below the names, {problem}: {settled('names')}")
        units = fields
    return units


def _titles(lines: Sequence[_Line], names: Sequence[str], layout: _Layout) -> Iterator[str]:
    """Yield which lines above the names could be names too; reject what is likely to belong to them."""
    stated = any(_ANGLES.search(line.text) for line in lines)
    for line in lines:
        comment = layout.is_comment(line.text)
        fields = layout.fitted(layout.words(line.text))
        written = [n for n, entry in enumerate(fields) if entry]
        whole = not comment and layout.separator != _SPACES and {*range(1, len(fields))} <= {*written}
        belongs = whole and (len(fields) > 2 or not all(names[n] for n in written))
        if fields and (belongs or layout.units(line.text, _time(names))):
            may_be = f"line {line.number}, above the names, may be names or units of the columns as well"
            raise TableError(f"{may_be}: {settled(f'skip = {line.number} (a title) or names')}")
        states_units = not stated and re.search(r"(?i)\b(units?|degrees|radians)\b", line.text)
        if states_units or (len(written) > 1 and not comment):
            yield f"line {line.number} is taken for a title: {line.text.strip()[:60]!r}"


def _time(fields: Sequence[str]) -> int | None:
    """Return the place of the name of the time, None without one."""
    names = [name_and_unit(field)[0] for field in fields]
    return next((n for n, name in enumerate(names) if name.casefold() == "time" or name == "t"), None)


def _named(names: Sequence[str], units: Sequence[str]) -> Heading:
    parts = [name_and_unit(field) for field in names]
    bare = [name for name, _ in parts]
    if twice := next((name for name in bare if name and bare.count(name) > 1), None):
        raise TableError(f"column {twice!r} occurs twice, which is ambiguous: {settled('names')}")
    heading: Heading = []
    for (name, beside), entry in zip(parts, units or [""] * len(parts), strict=True):
        below = _bare(entry)
        if beside and below and beside != below and parse_unit(beside) != parse_unit(below):
            both = f"column {name!r} states {beside!r} beside its name and {below!r} below it"
            raise TableError(f"{both}: {settled('names')}")
        heading.append((name, beside or below))
    return heading


def _bare(field: str) -> str | None:
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


def _are_units(fields: Sequence[str]) -> bool:
    """Whether all fields are units, or in brackets, and not all are numbers."""
    written = [entry for entry in fields if entry and not NUMBER.fullmatch(entry)]
    units = (parse_unit(entry) is not None or _bare(entry) != entry for entry in filter(None, fields))
    return bool(written) and all(units)


# ---- the rows of numbers


def _check_comments(text: str, offset: int, layout: _Layout) -> None:
    """Reject a comment below the first row that may be a row, or that is another heading."""
    if not any(sign in text for sign in layout.comments):
        return
    for match in re.finditer(r"(?m)^[ \t]*[#%!].*", text[offset:]):
        line = _Line(text.count("\n", 0, offset + match.start()) + 1, match[0])
        layout.check_comment(line)
        if layout.is_heading(line.text):
            problem = f"a comment or another heading: {line.text.strip()[:60]!r}"
            raise TableError(f"line {line.number} may be {problem}: {settled('comment')}")


def _rows(body: str, layout: _Layout) -> str:
    """Return the rows, as many lines, without comments.

    A comment begins at the start of a line or after a space: ``1.#QNAN`` is none.
    """
    separator = layout.separator
    if any(sign in body for sign in layout.comments):
        signs = "|".join(map(re.escape, layout.comments))
        body = re.sub(rf"(?m)^[ \t]*(?:{signs}).*", "", body)
        body = _without_comments(body, separator, layout.comments)
    if separator != _SPACES:
        if f" {separator}" in body or " \n" in body:
            body = re.sub(
                rf" +(?=[{re.escape(separator)}\n])", "", body
            )  # pandas rounds what ends with a space
        if f"\n{separator}" in body:  # a spreadsheet's empty rows
            body = re.sub(rf"(?m)^{re.escape(separator)}+$", "", body)
    return body


def _decimal_sign(body: str, separator: str, dialect: Dialect) -> str:
    """Return the decimal sign of all numbers: the one that is stated, or that has one reading."""
    decimal = dialect.decimal or {".": ",", ",": "."}.get(dialect.thousands or "")
    if decimal or (separator == "," and '"' not in body):
        return decimal or "."
    edge = r" \t\n" if separator == _SPACES else rf"{re.escape(separator)}\n"
    quote = '"' if separator == "," else '"?'
    before, end = rf"(?:\A|[{edge}])[ \t]*{quote}", rf"{quote}[ \t]*(?=[{edge}]|\Z)"
    seen = {}
    for sign in ".,":
        number = rf"{before}([+-]?(?=[.,]?\d)[\d.,]*[{sign}][\d.,]*{_EXPONENT}){end}"
        if sign in body and (match := re.search(number, body)):
            seen[sign] = match[1]
    if not seen or (separator == "," and "," not in seen):
        return "."
    sign, *others = seen
    one = rf"[+-]?(?:\d+[{sign}]\d*|[{sign}]\d+){_EXPONENT}"
    clear = rf"{before}(?![+-]?[1-9]\d{{0,2}}[{sign}]\d{{3}}{end}){one}{end}"
    if others or not re.search(clear, body):
        numbers = " and ".join(map(repr, dict.fromkeys(seen.values())))
        not_clear = f"whether a point or a comma is the decimal sign is not clear from {numbers}"
        raise TableError(f"{not_clear}: {settled('decimal (and thousands)')}")
    return sign


def _frame(body: str, lines: Sequence[int], separator: str, decimal: str, count: int) -> pd.DataFrame:
    """Return the rows, in these lines of the file, as pandas reads them; text in columns that hold any."""
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
                skipinitialspace=True,
                keep_default_na=False,
                na_values=[""],
                low_memory=False,  # the type of a column follows from all of it
            )
    except (ValueError, pd.errors.ParserWarning):
        frame = pd.DataFrame()
    if len(frame) == len(lines) and not (separator == _SPACES and frame[count - 1].isna().any()):
        return frame
    rows = (line for line in body.split("\n") if line.strip(" \t"))
    for n, line in zip(lines, rows, strict=True):
        fields = len(_split(line, separator))
        if fields > count or (separator == _SPACES and fields < count) or line.count('"') % 2:
            rule = f"line {n} must hold {count} fields, as line {lines[0]}, and close quotation marks"
            raise TableError(f"{rule}: {settled('separator')}")
    raise TableError(f"cannot be read as rows of {count} fields: {settled('separator')}")
