"""Text tables as exported by other programs: layout detection and reading of columns.

The layout is detected from the first rows: the separator, the decimal sign, and the lines of names and units
above the numbers. Titles above those are skipped.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from comparison.tables.imports.titles import names_and_units, numbered
from comparison.tables.table import TableError
from comparison.tables.table_files import read_frame

_HEAD = 1 << 18  # bytes that must contain the first row of numbers
_LONGEST_LINE, _LONGEST_NAME = 100_000, 1_000
"""Characters: the time to find names in a line grows as the square of its length."""
_SPACES = r"\s+"
_SEPARATORS = (";", "\t", ",", _SPACES)
# Names separated by spaces: quoted or a single word, either with a unit in brackets.
# Of a line of units each is in brackets of its own.
_WORD = re.compile(r'(?:"[^"]*"|[^\s"\[(]+)(?:\s*(?:\[[^\]]*\]|\([^)]*\)))?|\[[^\]]*\]|\([^)]*\)')
_COMMENT = "#%!"


@dataclass(frozen=True)
class Column:
    """Unconverted column of another program's table.

    Attributes
    ----------
    name, unit
        Without quotes and brackets; None where the table has no unit.
    numbers
        Shape (n,).
    """

    name: str
    unit: str | None
    numbers: NDArray[np.float64]


@dataclass(frozen=True)
class Layout:
    """Layout of a text table.

    Attributes
    ----------
    names, units
        Of the columns, shape (columns,).
    above
        Lines above the numbers.
    separator, decimal, encoding
        As arguments of `pandas.read_csv`.
    """

    names: list[str]
    units: list[str | None]
    above: int
    separator: str
    decimal: str
    encoding: str
    header: str = ""
    """All lines above the numbers."""
    nameless: bool = False
    """Whether the columns are numbered (``#1``) for want of names."""

    @property
    def plain(self) -> bool:
        """Whether it is the layout of this package's tables: commas, one header line, no units."""
        named = not self.nameless and not any(self.units)
        return self.separator == "," and self.above == 1 and named


def layout(path: Path) -> Layout | None:
    """Detect the layout of a text table; None without a row of numbers.

    Raises
    ------
    TableError
        If it cannot be opened, or the line above the numbers lacks names of columns.
    """
    lines, encoding = _head(path)
    if any(len(line) > _LONGEST_LINE for line in lines):
        raise TableError(f"{path}: has a line of more than {_LONGEST_LINE} characters")
    found = next(((n, s) for n, line in enumerate(lines) for s in _SEPARATORS if _is_row(line, s)), None)
    if found is None:
        return None
    first, separator = found
    size = _is_size(path, lines, first, separator)
    first += size
    rows = [_fields(line, separator) for line in lines[first : first + 100]]
    written = [n for n in range(first - size) if lines[n].strip()]
    titles = [(n, _fields(lines[n].lstrip(" " + _COMMENT), separator, names=True)) for n in written[-2:]]
    if any(len(field) > _LONGEST_NAME for _, fields in titles for field in fields):
        raise TableError(f"{path}: has a name of more than {_LONGEST_NAME} characters")
    count = len(rows[0])
    nameless = not titles or len(titles[-1][1]) != count
    if nameless and titles and lines[titles[-1][0]].lstrip()[0] not in _COMMENT:
        raise TableError(
            f"{path}: line {first + 1} holds {count} numbers, but line {titles[-1][0] + 1} names "
            f"{len(titles[-1][1])}: each column needs a name, or none does"
        )
    if nameless:
        names, units = numbered(count)
    else:
        names, units = names_and_units([fields for _, fields in titles if len(fields) == count])
    comma = separator != "," and any("," in field for row in rows for field in row)
    return Layout(
        names=names,
        units=units,
        above=first,
        separator=separator,
        decimal="," if comma else ".",
        encoding=encoding,
        header="\n".join(lines[:first]),
        nameless=nameless,
    )


def read_columns(path: Path, how: Layout) -> list[Column]:
    """Read a text table.

    Raises
    ------
    TableError
        With column and row, if a value is not a number or two columns have the same name.
    """
    for name in how.names:
        if how.names.count(name) > 1:
            raise TableError(f"{path}: column {name!r} occurs twice: which one is meant is ambiguous")
    frame = read_frame(
        path,
        sep=how.separator,
        decimal=how.decimal,
        encoding=how.encoding,
        header=None,
        names=range(len(how.names)),
        skiprows=how.above,
        comment="#",
    )
    columns = []
    for n, (name, unit) in enumerate(zip(how.names, how.units, strict=True)):
        if not name and frame[n].isna().all():
            continue  # the separator at the end of every line
        columns.append(Column(name, unit, _numbers(path, frame, n, name, how.decimal)))
    return columns


def _is_size(path: Path, lines: Sequence[str], first: int, separator: str) -> int:
    """Return 1 if the first row of numbers is the number of rows and columns of those below it, else 0."""
    sizes = [_fields(line, separator) for line in lines[first : first + 2]]
    if (
        len(sizes) < 2
        or len(sizes[0]) != 2
        or not all(field.isdigit() for field in sizes[0])
        or (int(sizes[0][1]) != len(sizes[1]))
    ):
        return 0
    with path.open("rb") as file:
        rows = sum(1 for line in file if line.strip()) - sum(1 for line in lines[: first + 1] if line.strip())
    return int(rows == int(sizes[0][0]))


def _head(path: Path) -> tuple[list[str], str]:
    """Return the first complete lines and their encoding: UTF-8, or that of older Windows programs."""
    try:
        with path.open("rb") as file:
            start = file.read(_HEAD)
            whole = not file.read(1)
    except OSError as error:
        raise TableError(f"{path}: {error.strerror or error}") from error
    if not whole:
        start = start[: start.rfind(b"\n") + 1]
    try:
        return start.decode("utf-8-sig").splitlines(), "utf-8-sig"
    except UnicodeDecodeError:
        return start.decode("cp1252", errors="replace").splitlines(), "cp1252"


def _fields(line: str, separator: str, *, names: bool = False) -> list[str]:
    if separator == _SPACES:
        return [field.strip('"') for field in (_WORD.findall(line) if names else line.split())]
    return [
        field.strip() for field in next(csv.reader([line], delimiter=separator, skipinitialspace=True), [])
    ]


def _is_row(line: str, separator: str) -> bool:
    """Whether a line consists of two or more numbers or empty fields."""
    fields = _fields(line if separator == "," else line.replace(",", "."), separator)
    return len(fields) > 1 and any(fields) and all(not field or _is_number(field) for field in fields)


def _is_number(field: str) -> bool:
    try:
        float(field)
    except ValueError:
        return False
    return True


def _numbers(path: Path, frame: pd.DataFrame, n: int, name: str, decimal: str) -> NDArray[np.float64]:
    if frame[n].dtype.kind in "fiu":
        return frame[n].to_numpy(dtype=np.float64)
    # A single text in a column turns all its numbers into texts.
    plain = frame[n].map(lambda field: field.replace(decimal, ".") if isinstance(field, str) else field)
    numbers = pd.to_numeric(plain, errors="coerce")
    bad = np.flatnonzero(numbers.isna() & frame[n].notna())
    if not bad.size:
        return numbers.to_numpy(dtype=np.float64)
    row = int(bad[0])
    message = f"{path}: column {name!r} is not a number in data row {row + 1}: {frame[n].iloc[row]!r}"
    if pd.to_numeric(frame.iloc[row], errors="coerce").isna().all():
        message = f"{path}: text after data row {row}: save one block of columns per file"
    raise TableError(message)
