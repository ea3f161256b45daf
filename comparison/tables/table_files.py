"""Files of result tables: read, and written all or none.

``run.csv`` (or ``run.parquet``) holds the channels, ``run.events.csv`` one row per contact,
``run.pulses.csv`` the contacts' forces in time, ``run.json`` the provenance and the extrema over integration
steps. A comparison requires only the first.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from comparison.files import check_size, replacing_in, write_json
from comparison.tables.columns import write_events, write_numbers
from comparison.tables.record import read_record
from comparison.tables.table import Table, TableError

# Pandas is imported only where it is used: with pyarrow it takes longer than a short run.
if TYPE_CHECKING:
    import pandas as pd

FORMATS = (".csv", ".parquet")


def read(path: str | Path) -> Table:
    """Read a table with its companion files; `comparison.tables.check` validates the contents.

    Raises
    ------
    TableError
        If it is not a CSV or Parquet file with a column ``time``.
    """
    path = Path(path)
    check_format(path)
    frame = read_frame(path)
    _, pulses_path, _ = _beside(path)
    extrema, record = read_provenance(path)
    pulses = None
    if pulses_path.is_file():
        columns = read_frame(pulses_path)
        # A force of whole numbers is no column of integers
        whole = [name for name in columns if name != "row" and columns[name].dtype.kind in "iu"]
        pulses = {
            str(name): column.to_numpy()
            for name, column in columns.astype(dict.fromkeys(whole, float)).items()
        }
    if "time" not in frame:
        raise TableError(f"{path}: channel time is missing")
    frame.insert(0, "time", frame.pop("time"))
    return Table(frame, read_events(path), extrema, record, pulses=pulses)


def read_frame(path: Path, *, parquet: bool | None = None) -> pd.DataFrame:
    """Read the columns of one file: Parquet (None: if its extension says so), else text as we write it.

    Raises
    ------
    TableError
        If it cannot be read.
    """
    import pandas as pd

    from comparison.tables.frames import LARGEST, named, read_parquet

    with _readable(path), warnings.catch_warnings():
        check_size(path, LARGEST)
        if path.suffix.lower() == ".parquet" if parquet is None else parquet:
            return read_parquet(path)
        # Rows longer than the header: pandas would drop the excess, with a warning.
        warnings.simplefilter("error", pd.errors.ParserWarning)
        try:
            return named(pd.read_csv(path, skipinitialspace=True, index_col=False, encoding="utf-8-sig"))
        except pd.errors.ParserWarning as warning:
            raise ValueError("its rows have more values than its header") from warning


def read_events(path: Path) -> pd.DataFrame | None:
    """Read the contacts beside a table; None where there are none.

    Raises
    ------
    TableError
        If they cannot be read.
    """
    events_path, _, _ = _beside(path)
    return read_frame(events_path) if events_path.is_file() else None


def read_provenance(path: Path) -> tuple[dict[str, Any], dict[str, Any]]:
    """Read the record beside a table: the extrema, and all else.

    Raises
    ------
    TableError
        If it cannot be read.
    """
    _, _, record_path = _beside(path)
    with _readable(record_path):
        record = read_record(record_path)
    return record.pop("extrema", None) or {}, record


def write(table: Table, path: str | Path) -> Path:
    """Write a table with its events, pulses and provenance: all or, if one cannot be written, none.

    Doubles are written with full precision: reading them back gives the same bits, but for the sign of zeros
    in a column of integers. Missing folders are created. Events and pulses of an earlier table of this
    name are deleted where the new one has none.

    Raises
    ------
    TableError
        If it cannot be written.
    """
    path = Path(path)
    check_format(path)
    events_path, pulses_path, record_path = _beside(path)
    try:
        with replacing_in(path.parent) as part:
            if table.contacts is not None:
                write_events(table.contacts, part / events_path.name)
            if table.pulses is not None:
                write_numbers(table.pulses, part / pulses_path.name)
            write_json({**table.provenance, "extrema": table.extrema}, part / record_path.name)
            if path.suffix.lower() == ".csv":
                write_numbers(table.columns, part / path.name)
            else:
                table.frame.to_parquet(part / path.name, index=False)
        if table.contacts is None:
            events_path.unlink(missing_ok=True)
        if table.pulses is None:
            pulses_path.unlink(missing_ok=True)
    except OSError as error:
        raise TableError(f"{path}: cannot be written: {error.strerror or error}") from error
    return path


def companions(table: Table, path: Path) -> list[Path]:
    """Return the files that `write` makes beside that of a table."""
    events, pulses, record = _beside(path)
    held = {events: table.contacts is not None, pulses: table.pulses is not None, record: True}
    return [file for file, is_made in held.items() if is_made]


def check_format(path: Path) -> None:
    """Reject a file name with an unknown extension.

    Raises
    ------
    TableError
        If it is neither ``.csv`` nor ``.parquet``.
    """
    if path.suffix.lower() not in FORMATS:
        raise TableError(f"{path}: the name must end in {' or '.join(FORMATS)}")


@contextmanager
def _readable(path: Path) -> Iterator[None]:
    """Convert errors of reading a file to one-line messages."""
    try:
        yield
    except OSError as error:
        raise TableError(f"{path}: {error.strerror or error}") from error
    # pandas' parser errors, pyarrow's, JSON's and UnicodeDecodeError are ValueErrors
    except ValueError as error:
        raise TableError(f"{path}: cannot be read: {' '.join(str(error).split())}") from error


def _beside(path: Path) -> tuple[Path, Path, Path]:
    """Return the files of events, pulses and provenance."""
    events, pulses, record = (
        path.with_name(path.stem + end) for end in (".events.csv", ".pulses.csv", ".json")
    )
    return events, pulses, record
