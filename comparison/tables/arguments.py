"""Arguments of the interfaces, checked in one place: options, tables, mappings."""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd
from pydantic import ValidationError
from pydantic_core import PydanticCustomError

from comparison.scene.keys import explain, short, unboxed
from comparison.scene.schema import Section
from comparison.tables import mapping as rules
from comparison.tables.dialect import Source, read_column
from comparison.tables.mapping import TIME, load_mapping, parse_unit
from comparison.tables.table import Table, TableError

Results = Table | pd.DataFrame | str | Path
"""Table as a caller gives it."""
_WITH_UNIT = re.compile(r"(?P<name>.*\S)\s*[\[(](?P<unit>[^\[\]()]+)[\])]")


class Options(Section):
    """Options of a function; None counts as not given, what is wrong is a `TableError` of one line."""

    def __init__(self, **options: Any) -> None:
        given: dict[str, Any] = {name: unboxed(value) for name, value in options.items() if value is not None}
        try:
            super().__init__(**given)
        except ValidationError as error:
            raise TableError(" ".join(explain(error, type(self)).split())) from None


def by_name(value: object) -> object:
    """Reject what assigns nothing to names; of pydantic's own error `explain` names a section of a file."""
    if not isinstance(value, Mapping):
        raise PydanticCustomError("rule", "", {"text": "must be a dict, from names to values"})
    return value


def as_source(results: Results, label: str) -> Path | Source:
    """Return what `comparison.tables.foreign.read_tables` takes: a path, or the columns of a table or frame.

    A data frame has the names and units of a table's header, its time in a column or as its index. Anything
    else, and a frame with several columns of one name or levels of names, is a `TableError`.
    """
    if isinstance(results, str | Path):
        return Path(results)
    if isinstance(results, pd.DataFrame):
        table = Table(_with_time(results, label))
    elif isinstance(results, Table):
        table = results
    else:
        kind = f"{type(results).__module__}.{type(results).__qualname__}".removeprefix("builtins.")
        raise TableError(f"{label}: must be a path, a table or a pandas data frame, not a {kind}")
    units = {name: channel.unit or None for name, channel in table.own.items()}
    names = [_name_and_unit(name) if name not in units else (name, units[name]) for name in table.names]
    if twice := _repeated([name for name, _ in names]):
        raise TableError(f"{label}: column {twice!r} occurs twice")
    columns = [_seconds(table.frame.iloc[:, n]) for n in range(len(names))]
    return Source(
        Path(label),
        [read_column(*name, column) for name, column in zip(names, columns, strict=True)],
        events=table.events,
        extrema=table.extrema,
        cycle_extrema=table.cycle_extrema,
        record=table.provenance,
    )


def as_mapping(mapping: rules.Mapping | str | Path | None) -> rules.Mapping | None:
    """Return a mapping, read where a path is given; a `TableError` if it is neither."""
    if isinstance(mapping, str | Path):
        return load_mapping(Path(mapping))
    if mapping is None or isinstance(mapping, rules.Mapping):
        return mapping
    raise TableError(f"mapping = {short(mapping)} must be a mapping or the path of a mapping file")


def _with_time(frame: pd.DataFrame, label: str) -> pd.DataFrame:
    """Return a frame whose index, if it is the time and no column is, is its first column."""
    if frame.columns.nlevels > 1:
        raise TableError(f"{label}: its columns have {frame.columns.nlevels} levels of names; one is read")
    index = frame.index
    if any(_is_time(name) for name in frame):
        return frame
    if isinstance(index, pd.DatetimeIndex):
        raise TableError(f"{label}: its index holds dates; the time is a number of seconds or a timedelta")
    if isinstance(index, pd.TimedeltaIndex) or _is_time(index.name):
        name = TIME if isinstance(index, pd.TimedeltaIndex) else str(index.name)
        frame = frame.reset_index(drop=True)
        frame.insert(0, name, index.to_numpy())
    return frame


def _seconds(column: pd.Series) -> pd.Series:
    """Return a duration in s, other columns as they are."""
    return column.dt.total_seconds() if column.dtype.kind == "m" else column


def _is_time(name: object) -> bool:
    own, _ = _name_and_unit(str(name))
    return own.casefold() == TIME or own == "t"


def _name_and_unit(name: str) -> tuple[str, str | None]:
    """Return name and unit of ``x [mm]``, as a header of a file has them; ``x[0]`` is a name."""
    parts = _WITH_UNIT.fullmatch(name)
    if parts is None or parts["unit"].isdigit() or parse_unit(parts["unit"]) is None:
        return name, None
    return parts["name"], parts["unit"].strip()


def _repeated(names: Sequence[str]) -> str:
    """Return the first name that occurs twice, else nothing."""
    return next((name for n, name in enumerate(names) if name in names[:n]), "")
