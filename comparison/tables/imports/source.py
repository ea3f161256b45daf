"""Columns of a file of any kind, as they stand there; what a file is, its first bytes say, not its ending."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pandas as pd

from comparison.files import check_size
from comparison.tables.frames import LARGEST
from comparison.tables.imports.excel import read_workbook
from comparison.tables.imports.matlab import read_mat
from comparison.tables.imports.text import Column, TextTable, column, decoded, parse
from comparison.tables.table import TableError
from comparison.tables.table_files import read_events, read_frame, read_provenance

_MATLAB = (b"MATLAB 5.0 MAT-file", b"MATLAB 7.3 MAT-file")
_BINARY = 1024  # bytes in which text has no zero byte
_UTF_16 = (b"\xff\xfe", b"\xfe\xff")
_DEGREES = re.compile(r"^\s*inDegrees\s*=\s*(yes|no)\s*$", re.IGNORECASE | re.MULTILINE)


@dataclass(frozen=True)
class Source:
    """Unconverted table of any program.

    Attributes
    ----------
    path
        Its file.
    columns
        In the order of the file.
    others
        Other contents of the file, which cannot be compared.
    events, extrema, record
        Companions of a table of this project; None: there is no record of its origin.
    nameless
        Whether the first column has no name and must be the time.
    degrees
        "yes" or "no" where the file says whether its angles are in degrees; else empty.
    """

    path: Path
    columns: list[Column]
    others: list[str] = field(default_factory=list)
    events: pd.DataFrame | None = None
    extrema: dict[str, Any] = field(default_factory=dict)
    record: dict[str, Any] | None = None
    nameless: bool = False
    degrees: str = ""

    @property
    def names(self) -> list[str]:
        """Names of the columns."""
        return [column.name for column in self.columns]


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
        return Source(path, columns, others, read_events(path))
    if what == "parquet":
        frame = read_frame(path, parquet=True)
        table = TextTable([column(str(name), None, frame[name]) for name in frame], plain="time" in frame)
    elif what == "excel":
        table = read_workbook(path)
    else:
        table = parse(path, decoded(path))
    degrees = _DEGREES.search(table.above)
    ours = table.plain and path.suffix.lower() == (".parquet" if what == "parquet" else ".csv")
    extrema, record = read_provenance(path) if ours else ({}, None)
    return Source(
        path,
        table.columns,
        events=read_events(path),
        extrema=extrema,
        record=record,
        nameless=table.nameless,
        degrees=degrees[1].lower() if degrees else "",
    )


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
