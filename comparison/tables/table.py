"""Reading and writing of result tables with events, extrema and provenance.

``run.csv`` (or ``run.parquet``) holds the channels, ``run.events.csv`` one row per contact, ``run.json`` the
provenance and the extrema over integration steps. A comparison requires only the first.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from copy import copy
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import NDArray

from comparison.files import check_size, replacing_in, write_json
from comparison.tables.channels import Channel, channels, is_uncertainty
from comparison.tables.columns import Columns, are_plain, framed, write_events, write_numbers
from comparison.tables.record import read_record
from comparison.tables.result import Result, check_result

# Pandas is imported only where it is used: with pyarrow it takes longer than a short run.
if TYPE_CHECKING:
    import pandas as pd

FORMATS = (".csv", ".parquet")


class TableError(ValueError):
    """Unusable table; the message is one line with file, channel and row."""


@dataclass(frozen=True)
class Table:
    """Results of a run.

    Attributes
    ----------
    frame
        ``time`` (s) first, then one column per channel.
    events
        One row per contact, or None where the source has no events.
    extrema
        Channel -> min, time_of_min, max, time_of_max over integration steps.
    provenance
        Model, settings and versions that produced the results.
    own
        Definitions of the channels that are not the press's, or have a scale of their own.
    """

    frame: pd.DataFrame
    events: pd.DataFrame | None = field(default_factory=lambda: None)
    extrema: dict[str, dict[str, float]] = field(default_factory=dict)
    provenance: dict[str, Any] = field(default_factory=dict)
    own: dict[str, Channel] = field(default_factory=dict)

    @classmethod
    def from_result(cls, result: Result) -> Self:
        """Convert the result of a model's ``simulate``, whatever its status.

        Raises
        ------
        TableError
            If it lacks attributes of a `Result`, or its columns differ in length.
        """
        table = cls.__new__(cls)
        try:
            check_result(result)
            vars(table).update(_held("frame", result.columns))
            vars(table).update(_held("events", result.events) if result.events else {"events": None})
        except (TypeError, ValueError) as error:
            raise TableError(f"the model's {error}") from error
        provenance = {**result.provenance, "status": result.status, "remedy": result.remedy}
        vars(table).update(extrema=result.extrema, provenance=provenance, own={})
        return table

    if not TYPE_CHECKING:  # else any name would be an attribute

        def __getattr__(self, name: str) -> Any:
            """Make a frame of the model's columns where it is first asked for."""
            columns = vars(self).get(_HELD.get(name, ""))
            if columns is None:
                raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
            vars(self)[name] = framed(columns)
            return vars(self)[name]

    def with_provenance(self, provenance: dict[str, Any]) -> Self:
        """Return this table with another provenance; no frame is made for that."""
        changed = copy(self)
        vars(changed)["provenance"] = provenance
        return changed

    @property
    def known(self) -> dict[str, Channel]:
        """Definitions of all channels that the table may hold, by name."""
        return channels() | self.own

    @property
    def time(self) -> NDArray[np.float64]:
        """Time, s, shape (n,)."""
        return self.values("time")

    @property
    def channels(self) -> list[str]:
        """Column names without ``time`` and without the estimated errors of channels."""
        return [name for name in self.names if name != "time" and not is_uncertainty(name)]

    @property
    def names(self) -> list[str]:
        """Names of all columns."""
        return [str(name) for name in self.columns]

    @property
    def columns(self) -> pd.DataFrame | Columns:
        """The frame if it is there, else the columns that it would be made of."""
        held: pd.DataFrame | Columns = vars(self)["frame" if "frame" in vars(self) else _HELD["frame"]]
        return held

    @property
    def contacts(self) -> dict[str, NDArray[Any]] | None:
        """Columns of the events, shape (m,) each, or None where the source has no events."""
        if "events" not in vars(self):
            held: dict[str, NDArray[Any]] = vars(self)[_HELD["events"]]
            return held
        return (
            None if self.events is None else {str(name): self.events[name].to_numpy() for name in self.events}
        )

    def only(self, names: Sequence[str]) -> Self:
        """Return the time and these channels alone; those that it lacks are left out, and so are events."""
        wanted = ("time", *dict.fromkeys(names))
        return replace(self, frame=self.frame[[name for name in wanted if name in self.frame]], events=None)

    def values(self, channel: str) -> NDArray[np.float64]:
        """Return one column, shape (n,)."""
        return np.asarray(self.columns[channel], dtype=np.float64)


_HELD = {"frame": "_frame_columns", "events": "_event_columns"}
"""Attributes that are made of columns when they are first asked for, and the names of these columns."""


def _held(name: str, columns: Columns) -> dict[str, Any]:
    return {_HELD[name]: dict(columns)} if are_plain(columns) else {name: framed(columns)}


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
    _, record_path = _beside(path)
    with _readable(record_path):
        record = read_record(record_path)
    if "time" not in frame:
        raise TableError(f"{path}: channel time is missing")
    frame.insert(0, "time", frame.pop("time"))
    return Table(frame, read_events(path), record.pop("extrema", None) or {}, record)


def read_frame(path: Path, *, parquet: bool | None = None, **layout: Any) -> pd.DataFrame:
    """Read the columns of one file: Parquet or text.

    Parameters
    ----------
    path
        The file.
    parquet
        Whether it is one of Parquet; None: by its extension.
    layout
        Text format, as arguments of `pandas.read_csv`; default: commas and one header line.

    Raises
    ------
    TableError
        If it cannot be read.
    """
    import pandas as pd

    from comparison.tables.frames import LARGEST, named, read_parquet

    frame: pd.DataFrame
    with _readable(path), warnings.catch_warnings():
        check_size(path, LARGEST)
        if path.suffix.lower() == ".parquet" if parquet is None else parquet:
            return read_parquet(path)
        # Rows longer than the header: pandas would drop the excess, with a warning.
        warnings.simplefilter("error", pd.errors.ParserWarning)
        options: dict[str, Any] = {"skipinitialspace": True, "index_col": False, "encoding": "utf-8-sig"}
        try:
            frame = pd.read_csv(path, **(options | layout))
        except pd.errors.ParserWarning as warning:
            raise ValueError("its rows have more values than its header") from warning
        return frame if "names" in layout else named(frame)


def read_events(path: Path) -> pd.DataFrame | None:
    """Read the contacts beside a table; None where there are none.

    Raises
    ------
    TableError
        If they cannot be read.
    """
    events_path, _ = _beside(path)
    return read_frame(events_path) if events_path.is_file() else None


def write(table: Table, path: str | Path) -> Path:
    """Write a table with its events and provenance: all of them or, if one cannot be written, none.

    Doubles are written with full precision: reading them back gives the same bits, but for the sign of zeros
    in a column of integers. Missing folders are created. Events of an earlier table of this name are deleted
    where the new one has none.

    Raises
    ------
    TableError
        If it cannot be written.
    """
    path = Path(path)
    check_format(path)
    events_path, record_path = _beside(path)
    try:
        with replacing_in(path.parent) as part:
            if table.contacts is not None:
                write_events(table.contacts, part / events_path.name)
            write_json({**table.provenance, "extrema": table.extrema}, part / record_path.name)
            if path.suffix.lower() == ".csv":
                write_numbers(table.columns, part / path.name)
            else:
                table.frame.to_parquet(part / path.name, index=False)
        if table.contacts is None:
            events_path.unlink(missing_ok=True)
    except OSError as error:
        raise TableError(f"{path}: cannot be written: {error.strerror or error}") from error
    return path


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


def _beside(path: Path) -> tuple[Path, Path]:
    return path.with_name(f"{path.stem}.events.csv"), path.with_name(f"{path.stem}.json")
