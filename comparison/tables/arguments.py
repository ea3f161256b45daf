"""Arguments of the interfaces, checked in one place: options, tables, mappings."""

from pathlib import Path
from typing import Any

import pandas as pd
from pydantic import ValidationError

from comparison.scene.keys import explain, short, unbox
from comparison.scene.schema import Section
from comparison.tables import mapping as rules
from comparison.tables.dialect import Column, Source, name_and_unit, read_column, time_place
from comparison.tables.mapping import TIME, load_mapping
from comparison.tables.table import Table, TableError

Results = Table | pd.DataFrame | str | Path
"""Table as a caller gives it."""


class Options(Section):
    """Options of a function; None counts as not given; an error is a `TableError` of one line."""

    def __init__(self, **options: Any) -> None:
        values: dict[str, Any] = {name: unbox(value) for name, value in options.items() if value is not None}
        try:
            super().__init__(**values)
        except ValidationError as error:
            raise TableError(" ".join(explain(error, type(self)).split())) from None


def as_source(results: Results, label: str) -> Path | Source:
    """Return a path, or the columns of a table or frame, for `comparison.tables.foreign.read_tables`.

    A data frame has the names and units of a table's header, its time in a column or as its index. Anything
    else, and a frame with several columns of one name or levels of names, is a `TableError`.
    """
    if isinstance(results, str | Path):
        return Path(results)
    table = Table(_with_time(results, label)) if isinstance(results, pd.DataFrame) else results
    if not isinstance(table, Table):
        kind = type(results).__name__
        raise TableError(f"{label}: must be a path, a table or a pandas data frame, not of type {kind}")
    columns: list[Column] = []
    for n, name in enumerate(table.names):
        definition = table.overrides.get(name)
        plain_name, unit = (name, definition.unit or None) if definition else name_and_unit(name)
        entries = table.frame.iloc[:, n]
        seconds = entries.dt.total_seconds() if entries.dtype.kind == "m" else entries
        columns.append(read_column(plain_name, unit, seconds))
    return Source(Path(label), columns, companions=table)


def as_mapping(mapping: rules.Mapping | str | Path | None) -> rules.Mapping | None:
    """Return a mapping, read where a path is given; a `TableError` if it is neither."""
    if isinstance(mapping, str | Path):
        return load_mapping(Path(mapping))
    if mapping is None or isinstance(mapping, rules.Mapping):
        return mapping
    raise TableError(f"mapping = {short(mapping)} must be a mapping or the path of a mapping file")


def _with_time(frame: pd.DataFrame, label: str) -> pd.DataFrame:
    """Return a frame with its index as first column where the index is the time and no column is."""
    if frame.columns.nlevels > 1:
        raise TableError(f"{label}: its columns have {frame.columns.nlevels} levels of names; one is read")
    index = frame.index.rename(TIME) if isinstance(frame.index, pd.TimedeltaIndex) else frame.index
    is_time = time_place([*map(str, frame)]) is None and time_place([str(index.name)]) is not None
    return frame.set_axis(index).reset_index() if is_time else frame
