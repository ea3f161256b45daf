"""Markdown tables from rows that name their columns."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from comparison.formatting import table


def rows_table(rows: Iterable[Mapping[str, str]]) -> str:
    """Return a table of rows with the same columns, heading -> cell; nothing where there is no row."""
    lines = list(rows)
    return table(list(lines[0]), [list(row.values()) for row in lines]) if lines else ""
