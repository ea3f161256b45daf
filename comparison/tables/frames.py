"""Frames as pandas reads them: bounds of what is decoded, and names as they are meant."""

from __future__ import annotations

import errno
from pathlib import Path

import pandas as pd
import pyarrow as pa
from pyarrow import parquet

LARGEST = 2_000_000_000
"""Bytes of a table, as a file and as numbers in memory: more than a command can work on."""


def named(frame: pd.DataFrame) -> pd.DataFrame:
    """Return a table of text without spaces around its names, and without the column of a last separator.

    Raises
    ------
    ValueError
        If two columns have the same name then.
    """
    names = [str(name).strip() for name in frame]
    if names and names[-1].startswith("Unnamed: ") and frame.iloc[:, -1].isna().all():
        frame, names = frame.iloc[:, :-1], names[:-1]
    if len(set(names)) < len(names):
        twice = next(name for n, name in enumerate(names) if name in names[:n])
        raise ValueError(f"column {twice!r} occurs twice")
    return frame.set_axis(names, axis=1)


def read_parquet(path: Path) -> pd.DataFrame:
    """Read a Parquet file.

    Raises
    ------
    OSError
        If it cannot be read, or its numbers do not fit in memory.
    ValueError
        If it is damaged, or two columns have the same name.
    """
    try:
        frame: pd.DataFrame = pd.read_parquet(path, engine="pyarrow", read_dictionary=_texts(path))
    except OSError:
        raise
    except Exception as error:  # pandas and pyarrow trust what a file says of itself
        raise ValueError(f"is no readable Parquet file: {error}") from error
    finally:
        pa.default_memory_pool().release_unused()  # it retains the memory of decoding
    if not frame.columns.is_unique:
        raise ValueError("has two columns of one name")
    return frame


def _texts(path: Path) -> list[str]:
    """Return the columns of text, of which a small file may repeat a long one: they are read as a dictionary.

    Raises
    ------
    OSError
        If the file, which is compressed and may be small, holds too many numbers.
    """
    with parquet.ParquetFile(path) as file:
        found = file.metadata
        groups = [found.row_group(n) for n in range(found.num_row_groups)]
        parts = [group.column(n) for group in groups for n in range(group.num_columns)]
    numbers = 8 * sum(part.num_values for part in parts)
    if max(numbers, sum(part.total_uncompressed_size for part in parts)) > LARGEST:
        raise OSError(errno.EFBIG, f"holds more than {LARGEST} bytes of numbers", str(path))
    return sorted({part.path_in_schema for part in parts if part.physical_type == "BYTE_ARRAY"})
