"""The figures that the paper prints, from ``published_results.csv``, and the use of each.

Column ``use``: "prediction" where nothing in the scenes was taken from the figure; "geometry" and "reference
line" where the part identification fits these to it, or corrects its fit by it; "reliability limit"
where the study paper fits the limit of the permitted error to it; "cap" where it is the reliability of a
mechanism without error, to its last printed digit; "misprint" where it cannot be what the authors computed.
Column ``sight``: choices that were made with the figure in sight, though no number was fitted to it.
"""

from functools import cache
from importlib.resources import files
from typing import NamedTuple

import pandas as pd

CONDITION = ["pair", "speed_rpm", "clearance_mm", "youngs_modulus_GPa", "poisson"]
"""Columns that name a condition: pair with clearance, speed, clearance, elastic modulus, Poisson's ratio."""


class Published(NamedTuple):
    """One printed figure."""

    value: float  # in ``unit``, signed as printed
    unit: str
    time: float  # s; nan where none is printed
    angle: float  # crank angle, deg; nan where none is printed
    rounding: float  # half a unit of the last printed digit, in ``unit``


def published(identifier: str) -> Published:
    """Return the figure of one row, such as ``F7-R-d``; KeyError if there is none."""
    row = {str(key): str(text) for key, text in printed_rows().loc[identifier].items()}
    digits, _, power = row["value"].partition("e")
    last = int(power or 0) - len(digits.partition(".")[2])
    time, angle = (float(row[column] or "nan") for column in ("time_s", "crank_angle_deg"))
    return Published(float(row["value"]), row["unit"], time, angle, 0.5 * 10.0**last)


@cache
def printed_rows() -> pd.DataFrame:
    """Return every row as text by its ``id``, "" where the paper prints nothing."""
    with files("comparison.studies.shared").joinpath("published_results.csv").open(encoding="utf-8") as file:
        return pd.read_csv(file, index_col="id", dtype=str, keep_default_na=False)
