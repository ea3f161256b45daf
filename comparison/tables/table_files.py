"""Files of result tables: read, and written all or none.

``run.csv`` (or ``run.parquet``) holds the channels, ``run.events.csv`` one row per contact,
``run.pulses.csv`` the contacts' forces in time, ``run.extrema.csv`` the extrema of each crank cycle, a row
each, ``run.json`` the provenance and the extrema of the whole run. A comparison requires only the first.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from comparison.files import check_size, replacing_in, write_json
from comparison.tables.columns import Columns, write_events, write_numbers
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
    beside = _beside(path)
    extrema, record = read_provenance(path)
    if "time" not in frame:
        raise TableError(f"{path}: channel time is missing")
    frame.insert(0, "time", frame.pop("time"))
    return Table(
        frame,
        read_events(path),
        extrema,
        record,
        pulses=_numbers(beside["pulses"], whole=("row",)),
        cycle_extrema=_numbers(beside["cycle_extrema"]),
    )


def _numbers(path: Path, whole: Sequence[str] = ()) -> Columns | None:
    """Read columns of real numbers, but for some of ``whole`` ones; None where there is no file."""
    if not path.is_file():
        return None
    frame = read_frame(path)
    # A force of whole numbers is no column of integers
    real = [name for name in frame if name not in whole and frame[name].dtype.kind in "iu"]
    return {str(name): column.to_numpy() for name, column in frame.astype(dict.fromkeys(real, float)).items()}


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
    events = _beside(path)["events"]
    return read_frame(events) if events.is_file() else None


def read_provenance(path: Path) -> tuple[dict[str, Any], dict[str, Any]]:
    """Read the record beside a table: the extrema, and all else.

    Raises
    ------
    TableError
        If it cannot be read.
    """
    with _readable(_beside(path)["record"]):
        record = read_record(_beside(path)["record"])
    return record.pop("extrema", None) or {}, record


def write(table: Table, path: str | Path) -> Path:
    """Write a table with all that belongs to it: all or, if one cannot be written, none.

    Doubles are written with full precision: reading them back gives the same bits, but for the sign of zeros
    in a column of integers. Missing folders are created. What an earlier table of this name has
    beside it is deleted where the new one has none.

    Raises
    ------
    TableError
        If it cannot be written.
    """
    path = Path(path)
    check_format(path)
    beside, held = _beside(path), _held(table)
    try:
        with replacing_in(path.parent) as part:
            for name, columns in held.items():
                if columns is not None:
                    write_beside = write_events if name == "events" else write_numbers
                    write_beside(columns, part / beside[name].name)
            write_json({**table.provenance, "extrema": table.extrema}, part / beside["record"].name)
            if path.suffix.lower() == ".csv":
                write_numbers(table.columns, part / path.name)
            else:
                table.frame.to_parquet(part / path.name, index=False)
        for name, columns in held.items():
            if columns is None:
                beside[name].unlink(missing_ok=True)
    except OSError as error:
        raise TableError(f"{path}: cannot be written: {error.strerror or error}") from error
    return path


def companions(table: Table, path: Path) -> list[Path]:
    """Return the files that `write` makes beside that of a table."""
    missing = [name for name, columns in _held(table).items() if columns is None]
    return [file for name, file in _beside(path).items() if name not in missing]


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


def _held(table: Table) -> dict[str, Columns | None]:
    """Return what stands in files of its own, by the names of `_beside`."""
    return {"events": table.contacts, "pulses": table.pulses, "cycle_extrema": table.cycle_extrema}


def _beside(path: Path) -> dict[str, Path]:
    """Return the files of events, pulses, extrema by cycle, and provenance."""
    ends = {
        "events": ".events.csv",
        "pulses": ".pulses.csv",
        "cycle_extrema": ".extrema.csv",
        "record": ".json",
    }
    return {name: path.with_name(path.stem + end) for name, end in ends.items()}
