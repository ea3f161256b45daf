"""Tables of other programs as they stand in their files, which their first bytes tell, not their ending."""

import csv
import io
import re
import subprocess
import sys
import warnings
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import numpy as np

from comparison.files import check_size
from comparison.tables.channels import is_uncertainty
from comparison.tables.dialect import NUMBER, Column, Source, column, decoded, parse_text
from comparison.tables.table import TableError
from comparison.tables.table_files import LARGEST, read_beside, read_parquet, read_record, readable

_HEAD = 1024  # bytes in which text has no zero byte
_REFUSED = {
    b"MATLAB 7.3 MAT-file": "is of MATLAB's version 7.3 (HDF5): save it with the option -v7",
    b"\xd0\xcf\x11\xe0": "is a workbook of Excel before 2007, or one with a password: save its sheet as .csv",
    b"\x89HDF": "is an HDF5 file: export its columns as CSV, with their names in the first line",
}
_BINARY = "is a binary file: let the program write text or CSV (of OpenFAST OutFileFmt = 1)"
_EXPORT = "save its sheet as CSV"
_LONGEST = 600.0  # s to read a MATLAB file


def open_source(path: Path) -> Source:
    """Read a file; one of a kind that is not read is a `TableError` that says what to do instead."""
    with readable(path):
        check_size(path, LARGEST)
        with path.open("rb") as file:
            head = file.read(_HEAD)
        source = _source(path, head)
    columns = [each for each in source.columns if not is_uncertainty(each.name)]
    source = replace(source, columns=columns, events=read_beside(path, "events"))
    if source.plain and path.suffix.lower() == (".parquet" if head.startswith(b"PAR1") else ".csv"):
        extrema, record = read_record(path)
        source = replace(source, extrema=extrema, record=record)
    return source


def _source(path: Path, head: bytes) -> Source:
    if rule := next((rule for start, rule in _REFUSED.items() if head.startswith(start)), ""):
        raise TableError(rule)
    if head.startswith(b"PAR1"):
        frame = read_parquet(path)
        return Source(path, [column(str(name), None, frame[name]) for name in frame], plain="time" in frame)
    if head.startswith(b"PK\x03\x04"):
        return parse_text(path, _sheet(path), ("\t",), ".")
    # Of MATLAB's files version 4 has no signature, but zero bytes; Octave writes text to .mat as well.
    if head.startswith(b"MATLAB 5.0 MAT-file") or (path.suffix.lower() == ".mat" and b"\0" in head):
        return Source(path, *_vectors(path))
    if b"\0" in head and not head.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise TableError(_BINARY)
    return parse_text(path, decoded(path.read_bytes()))


def _sheet(path: Path) -> str:
    """Return the one sheet of a workbook that holds a table as text: of a formula its stored value counts."""
    sheets = _sheets(path)
    # A table may have columns of text; a sheet of notes has numbers beside text.
    holding = [name for name, rows in sheets.items() if any(map(_are_numbers, rows))] or [
        name for name, rows in sheets.items() if any(sum(map(_is_number, row)) > 1 for row in rows)
    ]
    if not holding:
        raise TableError("no sheet contains a row of two or more numbers")
    if len(holding) > 1:
        raise TableError(f"sheets {' and '.join(map(repr, holding))} hold numbers: save one per file")
    text = io.StringIO()
    lines = csv.writer(text, delimiter="\t", lineterminator="\n")
    lines.writerows(map(_written, row) for row in sheets[holding[0]])
    return text.getvalue()


def _sheets(path: Path) -> dict[str, list[tuple[Any, ...]]]:
    try:
        from openpyxl import load_workbook
    except ImportError as error:
        extra = "pip install 'sixbar-crossval[excel]'"
        raise TableError(f"is an Excel workbook: {extra} to read it, or {_EXPORT}") from error
    try:
        with ZipFile(path) as file:
            unpacked = sum(part.file_size for part in file.infolist())
        if unpacked <= LARGEST:
            with path.open("rb") as file, warnings.catch_warnings():
                warnings.simplefilter("ignore")  # of styles and extensions, which do not matter here
                book = load_workbook(file, read_only=True, data_only=True)
                for sheet in book.worksheets:
                    sheet.reset_dimensions()  # some programs state wrong ones
                return {sheet.title: list(sheet.iter_rows(values_only=True)) for sheet in book.worksheets}
    # Of a damaged file the parsers of ZIP, XML and cells raise errors of many kinds.
    except Exception as error:
        raise TableError(f"is not a readable .xlsx workbook: {_EXPORT}") from error
    raise TableError(f"holds more than {LARGEST} bytes once it is unpacked")


def _are_numbers(row: Iterable[Any]) -> bool:
    cells = [cell for cell in row if cell is not None]
    return len(cells) > 1 and all(map(_is_number, cells))


def _is_number(cell: object) -> bool:
    return isinstance(cell, int | float) and not isinstance(cell, bool)


def _written(cell: object) -> str:
    """Return a cell as it is read again; text that looks like a number is marked as such, as Excel does."""
    if isinstance(cell, str) and NUMBER.fullmatch(cell.strip()):
        return f"'{cell}"
    return "" if cell is None else re.sub(r"[\r\n\0]+", " ", str(cell))


def _vectors(path: Path) -> tuple[list[Column], list[str]]:
    """Return the real vectors of a MATLAB file, and descriptions of its other contents."""
    # -P: do not import a module of the same name from the working directory.
    reader = [sys.executable, "-P", "-m", "comparison.tables.matlab", str(path), str(4 * LARGEST)]
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
