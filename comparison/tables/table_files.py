"""Reading and writing of result tables; of a table all files are written, or none.

Beside ``run.csv`` or ``run.parquet`` may be ``run.events.csv`` (a row for each contact), ``run.pulses.csv``
(their forces), ``run.extrema.csv`` (a row for each crank cycle), ``run.json`` (provenance and extrema).
"""

from __future__ import annotations

import csv as csv_text
import json
import warnings
from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray
from pyarrow import csv

from comparison.files import check_size, contents, reading, replacing_in, write_json
from comparison.tables.table import Table, TableError, record_faults

if TYPE_CHECKING:
    import pandas as pd

LARGEST = 2_000_000_000
"""Largest size of a table, bytes, as a file and as numbers in memory."""
FORMATS = (".csv", ".parquet")
"""Endings of the tables of this project."""
_ENDS = {"events": "events.csv", "pulses": "pulses.csv", "record": "json", "cycle_extrema": "extrema.csv"}
"""Attribute of a table -> ending of its file."""
_NEEDS = {"pulses": "events", "cycle_extrema": "provenance"}  # companion -> another one that it needs
_CONTACT = {"corner", "start", "end"}  # columns that contacts have
readable = partial(reading, refusal=TableError)
"""Context in which errors of reading a file become a `TableError` of one line."""


def read(path: str | Path) -> Table:
    """Read a table with its companions, or raise a `TableError`; its contents are not yet checked."""
    path = Path(path)
    check_format(path)
    with readable(path):
        check_size(path, LARGEST)
        frame = read_parquet(path) if path.suffix.lower() == ".parquet" else _read_csv(path)
    if "time" not in frame:
        raise TableError(f"{path}: channel time is missing")
    frame.insert(0, "time", frame.pop("time"))
    return replace(read_companions(path), frame=frame)


def _read_csv(path: Path) -> pd.DataFrame:
    import pandas as pd

    with warnings.catch_warnings():
        # Rows longer than the header: pandas would drop the excess, with a warning.
        warnings.simplefilter("error", pd.errors.ParserWarning)
        try:
            return pd.read_csv(path, skipinitialspace=True, index_col=False, encoding="utf-8-sig")
        except pd.errors.ParserWarning as warning:
            raise ValueError("its rows have more values than its header") from warning


def read_parquet(path: Path) -> pd.DataFrame:
    """Read a Parquet file; any other or damaged file is a `ValueError`."""
    import pandas as pd

    try:
        frame: pd.DataFrame = pd.read_parquet(path, engine="pyarrow")
    except OSError:
        raise
    except Exception as error:  # pandas and pyarrow trust the sizes and types stated in a file
        raise ValueError(f"is no readable Parquet file: {error}") from error
    if not frame.columns.is_unique:
        raise ValueError("has two columns of one name")
    return frame


def read_companions(path: Path, names: Iterable[str] = tuple(_ENDS), notes: list[str] | None = None) -> Table:
    """Read companions of a table, as a table without rows; none without the companion that it needs.

    Cycle extrema are real numbers, pulses too, with integer rows; `comparison.tables.table.check` refuses
    columns of anything else. A companion that cannot be read is a `TableError`; with ``notes`` a line of
    these, since it may be another program's.
    """
    parts: dict[str, Any] = {}
    for name in names:
        try:
            if name not in _NEEDS or _NEEDS[name] in parts:
                parts |= _read_companion(_companion(path, name), name)
        except TableError as error:
            if notes is None:
                raise
            notes.append(f"not read, since it is damaged or another program's: {error}")
    import pandas as pd

    return Table(pd.DataFrame(), **parts)


def _read_companion(path: Path, name: str) -> dict[str, Any]:
    """Return the attributes of a table that a companion holds; none if there is no such file."""
    with readable(path):
        if not path.is_file():
            return {}
        if name == "record":
            record = json.loads(contents(path))
            if fault := next(record_faults(record), ""):
                raise ValueError(fault)
            return {"extrema": record.pop("extrema", None) or {}, "provenance": record}
        check_size(path, LARGEST)
        frame = _read_csv(path)
        if name == "events" and not _CONTACT.issubset(frame):
            raise ValueError(f"has no columns {', '.join(sorted(_CONTACT))}")
    if name == "events":
        return {name: frame}
    types = {key: float for key, column in frame.items() if key != "row" and column.dtype.kind in "iu"}
    return {name: {str(key): column.to_numpy() for key, column in frame.astype(types).items()}}


def write(table: Table, path: str | Path) -> Path:
    """Write a table and its companions; a `TableError` if that fails, and then none is written.

    Reading it back gives the same bits, except for the sign of zeros in a column of integers. Companions of
    an earlier table of this name that the new one lacks are deleted.
    """
    path = Path(path)
    check_format(path)
    try:
        with replacing_in(path.parent) as part:
            for name, columns in _parts(table).items():
                if columns is not None:
                    _write_csv(columns, part / _companion(path, name).name, exact=name == "events")
            write_json({**table.provenance, "extrema": table.extrema}, part / _companion(path, "record").name)
            if path.suffix.lower() == ".csv":
                _write_csv(table.columns, part / path.name)
            else:
                table.frame.to_parquet(part / path.name, index=False)
        for file in {_companion(path, name) for name in _ENDS} - {*companions(table, path)}:
            file.unlink(missing_ok=True)
    except OSError as error:
        raise TableError(f"{path}: cannot be written: {error.strerror or error}") from error
    return path


def tables_in(folder: Path) -> tuple[dict[str, Path], list[str]]:
    """Return the files of a folder that may be tables, by name without ending, and the names of all else.

    A companion is left out only beside its table: alone it may be a table itself, unless it is JSON. Hidden
    files do not count.
    """
    with readable(folder):
        paths = [path for path in sorted(folder.iterdir()) if not path.name.startswith(".")]
    others = [f"{path.name}/" if path.is_dir() else path.name for path in paths if not path.is_file()]
    files = {path.name: path for path in paths if path.is_file()}
    stems = {path.stem for path in files.values() if path.suffix != ".json"}
    # `write` makes pulses and extrema beside a record alone.
    recorded = {stem for stem in stems if f"{stem}.json" in files}
    companion_names = {f"{stem}.{_ENDS['events']}" for stem in stems}
    companion_names |= {f"{stem}.{end}" for stem in recorded for end in _ENDS.values()}
    tables: dict[str, Path] = {}
    for path in [path for name, path in files.items() if name not in companion_names]:
        if path.suffix == ".json":
            others.append(path.name)
        elif other := tables.get(path.stem):
            raise TableError(f"{folder}: {other.name} and {path.name} have one name: which is meant?")
        else:
            tables[path.stem] = path
    return tables, others


def companions(table: Table, path: Path) -> list[Path]:
    """Return the paths of the files that `write` puts beside a table; a record always."""
    names = [name for name, columns in _parts(table).items() if columns is not None]
    return [_companion(path, name) for name in (*names, "record")]


def _parts(table: Table) -> dict[str, Mapping[Any, Any] | None]:
    return {"events": table.contacts, "pulses": table.pulses, "cycle_extrema": table.cycle_extrema}


def check_format(path: Path) -> None:
    """Reject, by a `TableError`, a file name that ends neither in ``.csv`` nor in ``.parquet``."""
    if path.suffix.lower() not in FORMATS:
        raise TableError(f"{path}: the name must end in {' or '.join(FORMATS)}")


def _companion(path: Path, name: str) -> Path:
    return path.with_name(f"{path.stem}.{_ENDS[name]}")


def _write_csv(columns: Mapping[Any, Any], path: Path, *, exact: bool = False) -> None:
    """Write columns by pyarrow, since other writers take longer than a run, below a header without quotes.

    ``exact`` columns, of few rows, have numbers as Python writes them: 1e-05, not pyarrow's 0.00001.
    """
    arrays = {name: np.asarray(columns[name]) for name in columns}
    with path.open("w", encoding="utf-8", newline="") as text:
        writer = csv_text.writer(text, lineterminator="\n")
        writer.writerow(arrays)
        if exact:
            lists = (array.tolist() for array in arrays.values())
            writer.writerows([["" if x != x else x for x in row] for row in zip(*lists, strict=True)])
    if not exact:
        rows = pa.table([_arrow(array) for array in arrays.values()], [*map(str, arrays)])
        with path.open("ab") as file:
            csv.write_csv(rows, file, csv.WriteOptions(include_header=False))


def _arrow(values: NDArray[Any]) -> Any:
    """Return an array of pyarrow with null for nan; pyarrow's own function would import pandas."""
    if values.dtype.kind not in "fiu":
        return pa.array(values, from_pandas=True)
    valid = np.packbits(~np.isnan(values), bitorder="little")
    buffers = [pa.py_buffer(valid), pa.py_buffer(np.ascontiguousarray(values))]
    return pa.Array.from_buffers(pa.from_numpy_dtype(values.dtype), values.size, buffers)
