"""Columns of a file of any kind, as they stand there; what a file is, its first bytes say, not its ending."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from comparison.files import check_size
from comparison.tables.frames import LARGEST
from comparison.tables.imports.excel import read_workbook
from comparison.tables.imports.matlab import read_mat
from comparison.tables.imports.text import Source, column, decoded, parse
from comparison.tables.table import TableError
from comparison.tables.table_files import read_events, read_frame, read_provenance

_MATLAB = (b"MATLAB 5.0 MAT-file", b"MATLAB 7.3 MAT-file")
_BINARY = 1024  # bytes in which text has no zero byte
_UTF_16 = (b"\xff\xfe", b"\xfe\xff")


def open_source(path: Path) -> Source:
    """Read a file.

    Raises
    ------
    TableError
        One line: file and rule.
    """
    what = _kind(path)
    if what == "mat":
        columns, others = read_mat(path)
        source = Source(path, columns, others)
    elif what == "parquet":
        frame = read_frame(path, parquet=True)
        source = Source(path, [column(str(name), None, frame[name]) for name in frame], plain="time" in frame)
    elif what == "excel":
        source = read_workbook(path)
    else:
        source = parse(path, decoded(path))
    source = replace(source, events=read_events(path))
    if source.plain and path.suffix.lower() == (".parquet" if what == "parquet" else ".csv"):
        extrema, record = read_provenance(path)
        source = replace(source, extrema=extrema, record=record)
    return source


def _kind(path: Path) -> str:
    """Return "parquet", "excel", "mat" or "text".

    Raises
    ------
    TableError
        If it cannot be opened, or is of a kind that is not read: with what to do instead.
    """
    try:
        check_size(path, LARGEST)
        with path.open("rb") as file:
            head = file.read(_BINARY)
    except OSError as error:
        raise TableError(f"{path}: {error.strerror or error}") from error
    if head.startswith(b"PAR1"):
        return "parquet"
    if head.startswith(b"PK\x03\x04"):
        return "excel"
    if head.startswith(_MATLAB) or path.suffix.lower() == ".mat":
        return "mat"
    if head.startswith(b"\xd0\xcf\x11\xe0"):
        raise TableError(f"{path}: is a workbook of Excel before 2007: save its sheet as .csv or .xlsx")
    if head.startswith(b"\x89HDF"):
        raise TableError(
            f"{path}: is an HDF5 file: export its columns as CSV, with their names in the first line"
        )
    if b"\0" in head and not head.startswith(_UTF_16):
        raise TableError(
            f"{path}: is a binary file: let the program write text or CSV (of OpenFAST OutFileFmt = 1)"
        )
    return "text"
