"""The figures that the paper prints, from ``paper/published_results.csv``."""

from __future__ import annotations

from dataclasses import dataclass
from importlib.resources import files

import pandas as pd


@dataclass(frozen=True)
class Published:
    """One printed figure."""

    value: float
    """In ``unit``, signed as printed."""
    unit: str
    time: float
    """s; nan where none is printed."""


def published(identifier: str) -> Published:
    """Return the figure of one row, such as ``F7-R-d``.

    Raises
    ------
    KeyError
        If there is no such row.
    """
    with files("comparison").joinpath("paper/published_results.csv").open(encoding="utf-8") as file:
        row = pd.read_csv(file, index_col="id").loc[identifier].to_dict()
    return Published(float(row["value"]), str(row["unit"]), float(row["time_s"]))
