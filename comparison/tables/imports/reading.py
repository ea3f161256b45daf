"""Columns of a file of any known kind, as they stand there."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pandas as pd

from comparison.tables.imports.content import kind
from comparison.tables.imports.excel import read_workbook
from comparison.tables.imports.exports import Column, layout, read_columns
from comparison.tables.imports.matlab import read_mat
from comparison.tables.table import Table, TableError
from comparison.tables.table_files import read, read_events, read_frame

_DEGREES = re.compile(r"^\s*inDegrees\s*=\s*(yes|no)\s*$", re.IGNORECASE | re.MULTILINE)
_TAIL = 4096  # bytes at whose end comments may stand


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
        Whether the columns are numbered for want of names.
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
    what = kind(path)
    if what == "mat":
        columns, others = read_mat(path)
        return Source(path, columns, others, read_events(path))
    if what == "parquet":
        frame = read_frame(path, parquet=True)
        if "time" in frame and path.suffix.lower() == ".parquet":
            return _native(path, read(path))
        return Source(path, _columns(frame), events=read_events(path))
    if what == "excel":
        columns, nameless = read_workbook(path)
        return Source(path, columns, events=read_events(path), nameless=nameless)
    how = layout(path)
    native = how is None or (how.plain and "time" in how.names and not _ends_in_a_comment(path))
    if native and path.suffix.lower() == ".csv":
        return _native(path, read(path))
    if how is None:
        raise TableError(f"{path}: contains no row of two or more numbers")
    degrees = _DEGREES.search(how.header)
    return Source(
        path,
        read_columns(path, how),
        events=read_events(path),
        nameless=how.nameless,
        degrees=degrees[1].lower() if degrees else "",
    )


def _native(path: Path, table: Table) -> Source:
    return Source(path, _columns(table.frame), [], table.events, table.extrema, table.provenance)


def _columns(frame: pd.DataFrame) -> list[Column]:
    return [Column(str(name), None, frame[name].to_numpy()) for name in frame]


def _ends_in_a_comment(path: Path) -> bool:
    with path.open("rb") as file:
        file.seek(max(0, path.stat().st_size - _TAIL))
        return any(line.startswith(b"#") for line in file.read().splitlines()[1:])
