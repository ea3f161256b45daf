"""What a faulty recorder or a careless hand does to a table: the faults that are in no model."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd

from comparison.tables.channels import CORNERS
from comparison.tables.table import Table
from comparison.verdict.compare import Runs

Spoil = Callable[[Runs, Runs], tuple[Runs, Runs]]

LATE = 1e-4
"""s, a quarter of the usual sample."""


def spoiled(runs: Runs, change: Callable[[pd.DataFrame], pd.DataFrame]) -> Runs:
    """Change all of a model's tables alike, as a fault of its recorder would."""
    tables = {name: table for name, table in vars(runs).items() if isinstance(table, Table)}
    changed: dict[str, Any] = {
        name: replace(table, frame=change(table.frame.copy())) for name, table in tables.items()
    }
    return replace(runs, **changed)


def _of_second(change: Callable[[pd.DataFrame], pd.DataFrame]) -> Spoil:
    return lambda a, b: (a, spoiled(b, change))


def not_a_number(frame: pd.DataFrame) -> pd.DataFrame:
    """Put one nan into one channel."""
    frame.loc[len(frame) // 2, "slider_vy"] = np.nan
    return frame


def zero_force(frame: pd.DataFrame) -> pd.DataFrame:
    """Lose the forces of all corners."""
    return frame.assign(
        **{f"corner_{corner}_{what}": 0.0 for corner in CORNERS for what in ("normal", "friction")}
    )


def late_values(frame: pd.DataFrame) -> pd.DataFrame:
    """Record every value 0.1 ms late, under the right times."""
    time = frame["time"].to_numpy()
    at = np.maximum(time - LATE, time[0])
    return frame.assign(
        **{name: np.interp(at, time, frame[name].to_numpy()) for name in frame.columns if name != "time"}
    )


def repeated_row(frame: pd.DataFrame) -> pd.DataFrame:
    """Write one row twice."""
    middle = len(frame) // 2
    return pd.concat([frame.iloc[: middle + 1], frame.iloc[middle:]], ignore_index=True)


def held_value(frame: pd.DataFrame) -> pd.DataFrame:
    """Hold all values of one row over into the next."""
    middle = len(frame) // 2
    values = [name for name in frame.columns if name != "time"]
    frame.loc[middle + 1, values] = frame.loc[middle, values]
    return frame


def swapped_corners(frame: pd.DataFrame) -> pd.DataFrame:
    """Write the lower left corner's channels under the lower right's names and the other way round."""
    exchange = {"corner_ll_": "corner_lr_", "corner_lr_": "corner_ll_"}
    return frame.rename(columns=lambda name: exchange.get(name[:10], name[:10]) + name[10:])


def constant(frame: pd.DataFrame) -> pd.DataFrame:
    """Leave slider y at its first value."""
    return frame.assign(slider_y=frame["slider_y"].iloc[0])


SPOILS: dict[str, Spoil] = {
    "nan": _of_second(not_a_number),
    "no channel": _of_second(lambda frame: frame.drop(columns="corner_ur_friction")),
    "truncated": _of_second(lambda frame: frame.iloc[:-2]),
    "zero force": _of_second(zero_force),
    "late times": _of_second(lambda frame: frame.assign(time=frame["time"] + LATE)),
    "late values": _of_second(late_values),
    "row twice": _of_second(repeated_row),
    "held value": _of_second(held_value),
    "millimetres": _of_second(lambda frame: frame.assign(slider_x=1e3 * frame["slider_x"])),
    "swapped corners": _of_second(swapped_corners),
    "sign": _of_second(lambda frame: frame.assign(slider_omega=-frame["slider_omega"])),
    "constant": _of_second(constant),
    "both constant": lambda a, b: (spoiled(a, constant), spoiled(b, constant)),
}
"""By the name that the catalogue gives them."""
