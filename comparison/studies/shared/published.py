"""The figures that the paper prints, from ``published_results.csv``, and what each is used for.

Column ``use``: "prediction" where nothing in the scenes was taken from the figure; "geometry" and "reference
line" where the study identification fits these to it, or corrects by it what it fits; "reliability limit"
where the study paper fits the limit of the permitted error to it; "cap" where it is the reliability of a
mechanism without error, to its last printed digit; "misprint" where it cannot be what the authors computed.
"""

from __future__ import annotations

from dataclasses import dataclass
from decimal import Decimal
from functools import cache
from importlib.resources import files

import pandas as pd

CONDITION = ["pair", "speed_rpm", "clearance_mm", "youngs_modulus_GPa", "poisson"]
"""Columns that name a condition: pair with clearance, speed, clearance, elastic modulus, Poisson's ratio."""


@dataclass(frozen=True)
class Published:
    """One printed figure."""

    value: float  # in ``unit``, signed as printed
    unit: str
    time: float  # s; nan where none is printed
    angle: float  # crank angle, deg; nan where none is printed
    rounding: float  # half a unit of the last printed digit, in ``unit``


def published(identifier: str) -> Published:
    """Return the figure of one row, such as ``F7-R-d``; KeyError if there is none."""
    row = {str(key): str(text) for key, text in printed_rows().loc[identifier].items()}
    last_digit = Decimal(row["value"]).as_tuple().exponent
    return Published(
        value=float(row["value"]),
        unit=row["unit"],
        time=float(row["time_s"] or "nan"),
        angle=float(row["crank_angle_deg"] or "nan"),
        rounding=0.5 * 10.0 ** int(last_digit),
    )


def printed_events() -> list[list[str]]:
    """Return the ids of all rows, those that print one figure again together, in the order of the file.

    A figure is printed again where condition, quantity and size are the same. Sign and instant may differ:
    then the paper contradicts itself.
    """
    rows = printed_rows().assign(size=lambda rows: rows["value"].astype(float).abs())
    return [list(same.index) for _, same in rows.groupby([*CONDITION, "quantity", "size"], sort=False)]


@cache
def printed_rows() -> pd.DataFrame:
    """Return every row as text by its ``id``, "" where the paper prints nothing."""
    with files("comparison.studies.shared").joinpath("published_results.csv").open(encoding="utf-8") as file:
        return pd.read_csv(file, index_col="id", dtype=str, keep_default_na=False)
