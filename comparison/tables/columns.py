"""Columns as a model returns them: pandas' frame where one is needed, and their text without it.

Importing pandas takes longer than most runs.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import pandas as pd

Columns = dict[str, NDArray[Any]]


def are_plain(columns: Mapping[str, Any]) -> bool:
    """Whether a frame would hold columns just as they are: arrays of numbers or text, all of one length."""
    shapes = set()
    for column in columns.values():
        if not isinstance(column, np.ndarray) or (column.dtype != np.float64 and column.dtype.kind != "U"):
            return False
        shapes.add(column.shape)
    return len(shapes) == 1 and len(shapes.pop()) == 1


def check_cycle_extrema(columns: Columns) -> None:
    """Reject what are no columns of real numbers of one length.

    Raises
    ------
    ValueError
        What is wrong with which.
    """
    for name, column in columns.items():
        if not isinstance(column, np.ndarray) or column.ndim != 1 or column.dtype.kind != "f":
            raise ValueError(f"cycle_extrema: {name} must be an array of real numbers, shape (cycles,)")
    if len({column.size for column in columns.values()}) > 1:
        raise ValueError("cycle_extrema: columns differ in length")


def framed(columns: Mapping[str, Any]) -> pd.DataFrame:
    """Return a frame of columns.

    Raises
    ------
    ValueError
        If they differ in length.
    """
    import pandas as pd

    try:
        return pd.DataFrame(columns)
    except ValueError as error:
        raise ValueError(f"columns are inconsistent: {error}") from error


def write_numbers(columns: pd.DataFrame | Columns, path: Path) -> None:
    """Write columns of numbers by pyarrow, since all else takes longer to write than a run to compute them.

    Not the header: pyarrow would quote it.
    """
    import pyarrow as pa
    from pyarrow import csv as arrow_csv

    if isinstance(columns, dict) and all(map(_is_number, columns.values())):
        # Not by `pyarrow.array`, which imports pandas.
        parts = [
            pa.Array.from_buffers(
                pa.from_numpy_dtype(column.dtype),
                column.size,
                [None, pa.py_buffer(np.ascontiguousarray(column))],
            )
            for column in columns.values()
        ]
        rows = pa.Table.from_arrays(parts, names=list(columns))
    else:
        frame = framed(columns) if isinstance(columns, dict) else columns
        rows = pa.Table.from_pandas(frame, preserve_index=False)
    with path.open("wb") as file:
        file.write(_lines([columns]).encode())
        arrow_csv.write_csv(rows, file, arrow_csv.WriteOptions(include_header=False))


def write_events(columns: Columns, path: Path) -> None:
    """Write the contacts, as pandas does."""
    if all(column.dtype.kind == "U" or _is_finite(column) for column in columns.values()):
        rows = zip(*(column.tolist() for column in columns.values()), strict=True)
        path.write_text(_lines([columns, *rows]), "utf-8")
    else:
        framed(columns).to_csv(path, index=False)


def _is_number(column: NDArray[Any]) -> bool:
    """Whether pyarrow writes a column as pandas does."""
    return column.dtype == np.int64 or _is_finite(column)


def _is_finite(column: NDArray[Any]) -> bool:
    """Whether a column holds doubles, and no nan, which pandas writes as nothing."""
    return column.dtype == np.float64 and bool(np.isfinite(column).all())


def _lines(rows: Iterable[Iterable[Any]]) -> str:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()
