"""Data frames and lines as tables of a page."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import pandas as pd

from comparison.formatting import table


def markdown(frame: pd.DataFrame, formats: Mapping[str, Callable[[Any], str]]) -> str:
    """Return some columns of a frame as a Markdown table.

    Parameters
    ----------
    frame
        With a row for each of the table's.
    formats
        Column, which is its heading too -> what makes text of each of its values.
    """
    rows = zip(*(map(form, frame[column]) for column, form in formats.items()), strict=True)
    return table(list(formats), rows)


def of_lines(lines: Sequence[Mapping[str, str]]) -> str:
    """Return a Markdown table of lines that all have the same keys: the headings."""
    return table(list(lines[0]), [list(line.values()) for line in lines])
