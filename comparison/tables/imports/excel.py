"""Excel workbooks (.xlsx): the one sheet that holds a table, by openpyxl, an optional dependency."""

from __future__ import annotations

import csv
import io
import warnings
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any
from zipfile import BadZipFile, ZipFile

from comparison.tables.frames import LARGEST
from comparison.tables.imports.heading import NUMBER
from comparison.tables.imports.text import Source, parse
from comparison.tables.table import TableError

_Row = Sequence[Any]
_EXPORT = "save its sheet as CSV"


def read_workbook(path: Path) -> Source:
    """Read the columns of a workbook as those of a text: of a formula its stored value counts.

    Raises
    ------
    TableError
        If openpyxl is missing, or the workbook does not hold exactly one table: with what to do instead.
    """
    sheets = _sheets(path)
    # A table may have columns of text; a sheet of notes has numbers beside text.
    holding = [name for name in sheets if any(map(_are_numbers, sheets[name]))] or [
        name for name in sheets if any(sum(map(_is_number, row)) > 1 for row in sheets[name])
    ]
    if not holding:
        raise TableError(f"{path}: no sheet contains a row of two or more numbers")
    if len(holding) > 1:
        raise TableError(f"{path}: sheets {' and '.join(map(repr, holding))} hold numbers: save one per file")
    text = io.StringIO()
    csv.writer(text, delimiter="\t", lineterminator="\n").writerows(
        [_written(cell) for cell in row] for row in sheets[holding[0]]
    )
    return parse(path, text.getvalue(), ("\t",), ".")


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


def _are_numbers(row: Iterable[Any]) -> bool:
    cells = [cell for cell in row if cell is not None]
    return len(cells) > 1 and all(map(_is_number, cells))


def _is_number(cell: object) -> bool:
    return isinstance(cell, int | float) and not isinstance(cell, bool)


def _written(cell: object) -> str:
    """Return a cell as it is read again; text that looks like a number is marked as such, as Excel does."""
    if isinstance(cell, str) and NUMBER.fullmatch(cell.strip()):
        return f"'{cell}"
    return "" if cell is None else str(cell).replace("\r", " ").replace("\0", " ")
