"""The figures that the paper prints, from ``paper/published_results.csv``."""

from __future__ import annotations

from dataclasses import dataclass
from decimal import Decimal
from functools import cache
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
    angle: float
    """Crank angle, deg; nan where none is printed."""
    rounding: float
    """Half a unit of the last printed digit, in ``unit``."""


def published(identifier: str) -> Published:
    """Return the figure of one row, such as ``F7-R-d``.

    Raises
    ------
    KeyError
        If there is no such row.
    """
    row = {str(key): str(text) for key, text in printed_rows().loc[identifier].items()}
    last_digit = Decimal(row["value"]).as_tuple().exponent
    return Published(
        value=float(row["value"]),
        unit=row["unit"],
        time=float(row["time_s"] or "nan"),
        angle=float(row["crank_angle_deg"] or "nan"),
        rounding=0.5 * 10.0 ** int(last_digit),
    )


@cache
def printed_rows() -> pd.DataFrame:
    """Return every row as text by its ``id``, "" where the paper prints nothing."""
    with files("comparison.studies.shared").joinpath("published_results.csv").open(encoding="utf-8") as file:
        return pd.read_csv(file, index_col="id", dtype=str, keep_default_na=False)
