"""Data frames as tables in Markdown and as CSV."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from comparison.files import replacing
from comparison.formatting import MISSING, quantity, table

Columns = dict[Any, Callable[[Any], str]]  # a column of a frame, and what writes a value of it
Quantities = Mapping[str, str | tuple[Any, ...]]
"""Heading -> a column, as it is, or (column, unit, digits) as `comparison.formatting.quantity` takes them."""


def markdown(frame: pd.DataFrame, columns: Mapping[Any, Callable[[Any], str]] | None = None) -> str:
    """Return a frame as a table, by default all columns as text; values and whole columns may be missing."""
    shown: Columns = dict.fromkeys(frame, str) if columns is None else dict(columns)
    values = frame.reindex(columns=list(shown)).to_dict("list")
    written = [
        [MISSING if pd.isna(value) else write(value) for value in values[name]]
        for name, write in shown.items()
    ]
    return table([str(name) for name in shown], zip(*written, strict=True))


def quantities(frame: pd.DataFrame, columns: Quantities) -> str:
    """Return a table of the columns; what is missing is said."""
    shown = {}
    for heading, what in columns.items():
        name, form = (what, ()) if isinstance(what, str) else (what[0], what[1:])
        values = frame.reindex(columns=[name])[name]
        shown[heading] = [quantity(value, *form) for value in values.astype(float)] if form else list(values)
    return markdown(pd.DataFrame(shown))


def rows_table(rows: Iterable[Mapping[str, str]]) -> str:
    """Return a table of rows with the same columns, heading -> cell; nothing where there is no row."""
    frame = pd.DataFrame(list(rows))
    return "" if frame.empty else markdown(frame)


def crossed(heading: str, rows: Sequence[str], columns: Sequence[str], cells: Sequence[str]) -> str:
    """Return cells as a table over the names of their rows and columns, each in the order of the first."""
    named = pd.DataFrame({heading: rows, "column": columns, "cell": cells})
    wide = named.pivot_table("cell", heading, "column", aggfunc="first", sort=False)
    return markdown(wide.reset_index())


def write_csv(frames: Mapping[str, pd.DataFrame], folder: Path, digits: str | None = None) -> None:
    """Write frames to ``NAME.csv`` in a folder, their numbers as the format ``digits`` says."""
    for name, frame in frames.items():
        with replacing(folder / f"{name}.csv") as part:
            frame.to_csv(part, index=False, float_format=digits)
