"""Excel workbooks (.xlsx): the one sheet that holds a table, by openpyxl, an optional dependency."""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any
from zipfile import BadZipFile, ZipFile

import numpy as np

from comparison.tables.frames import LARGEST
from comparison.tables.imports.exports import Column
from comparison.tables.imports.titles import names_and_units, numbered
from comparison.tables.table import TableError

_Row = Sequence[Any]
_EXPORT = "save its sheet as CSV"


def read_workbook(path: Path) -> tuple[list[Column], bool]:
    """Read the columns of a workbook.

    Of a formula its stored value counts.

    Returns
    -------
    columns
        In the order of the sheet; names, units and titles are found as in a text table.
    nameless
        Whether the columns are numbered for want of names.

    Raises
    ------
    TableError
        If openpyxl is missing, or the workbook does not hold exactly one table: with what to do instead.
    """
    sheets = {name: rows for name, rows in _sheets(path).items() if _first_numbers(rows) is not None}
    if not sheets:
        raise TableError(f"{path}: no sheet contains a row of two or more numbers")
    if len(sheets) > 1:
        raise TableError(f"{path}: sheets {' and '.join(map(repr, sheets))} hold numbers: save one per file")
    (rows,) = sheets.values()
    return _columns(path, rows)


def _sheets(path: Path) -> dict[str, list[_Row]]:
    try:
        from openpyxl import load_workbook
    except ImportError as error:
        extra = "pip install 'sixbar-crossval[excel]'"
        raise TableError(f"{path}: is an Excel workbook: {extra} to read it, or {_EXPORT}") from error
    _check_unpacked(path)
    try:
        with path.open("rb") as file, warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of styles and extensions, which do not matter here
            book = load_workbook(file, read_only=True, data_only=True)
            for sheet in book.worksheets:
                sheet.reset_dimensions()  # some programs state wrong ones
            return {sheet.title: list(sheet.iter_rows(values_only=True)) for sheet in book.worksheets}
    # Of a damaged file the parsers of ZIP, XML and cells raise errors of many kinds.
    except Exception as error:
        raise TableError(f"{path}: is not a readable .xlsx workbook: {_EXPORT}") from error


def _check_unpacked(path: Path) -> None:
    """Reject a workbook that is small only as long as it is packed."""
    try:
        with ZipFile(path) as file:
            size = sum(part.file_size for part in file.infolist())
    except (BadZipFile, OSError):
        return  # why it cannot be read is said where it is read
    if size > LARGEST:
        raise TableError(f"{path}: holds more than {LARGEST} bytes once it is unpacked")


def _first_numbers(rows: Sequence[_Row]) -> int | None:
    """Return the first row that consists of two or more numbers; None without one."""
    for n, row in enumerate(rows):
        cells = [cell for cell in row if cell is not None]
        if len(cells) > 1 and all(map(_is_number, cells)):
            return n
    return None


def _is_number(cell: object) -> bool:
    return isinstance(cell, int | float) and not isinstance(cell, bool)


def _columns(path: Path, rows: Sequence[_Row]) -> tuple[list[Column], bool]:
    first = _first_numbers(rows)
    assert first is not None
    above = [n for n in range(first) if any(cell is not None for cell in rows[n])]
    heads = [rows[first], *(rows[n] for n in above[-1:])]
    places = sorted({n for row in heads for n, cell in enumerate(row) if cell is not None})
    titles = [[str(_cell(rows[n], place) or "") for place in places] for n in above[-2:]]
    if len(titles) == 2 and not all(titles[0]):
        titles = titles[1:]
    names, units = names_and_units(titles) if titles else numbered(len(places))
    if not all(names):
        count = sum(map(bool, names))
        raise TableError(
            f"{path}: row {first + 1} holds {len(places)} columns, but row {above[-1] + 1} names {count}: "
            "each column needs a name, or none does"
        )
    if twice := next((name for name in names if names.count(name) > 1), None):
        raise TableError(f"{path}: column {twice!r} occurs twice: which one is meant is ambiguous")
    body = [n for n in range(first, len(rows)) if any(cell is not None for cell in rows[n])]
    columns = []
    for place, name, unit in zip(places, names, units, strict=True):
        cells = [_cell(rows[n], place) for n in body]
        for n, cell in zip(body, cells, strict=True):
            if cell is not None and not _is_number(cell):
                raise TableError(f"{path}: column {name!r} is not a number in row {n + 1}: {str(cell)!r}")
        numbers = np.array([math.nan if cell is None else cell for cell in cells], dtype=np.float64)
        columns.append(Column(name, unit, numbers))
    return columns, not titles


def _cell(row: _Row, place: int) -> Any:
    return row[place] if place < len(row) else None
