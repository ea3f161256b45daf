"""Rows of one time: programs that locate events write the values before and after at the same time."""

from __future__ import annotations

import numpy as np
import pandas as pd

from comparison.tables.table import TableError

AT_EVENTS = ("left", "right", "both")


def resolved(frame: pd.DataFrame, at_events: str | None, name: str) -> pd.DataFrame:
    """Return the rows to compare.

    Parameters
    ----------
    frame
        With ``time`` in s.
    at_events
        Of the rows of one time "left" keeps the first, "right" the last, "both" these two: the last one at
        the next larger number. None: there must be none.
    name
        Of the table, in messages.

    Raises
    ------
    TableError
        If times are repeated and ``at_events`` is None.
    """
    # What is not a number is refused where the values are checked.
    time = pd.to_numeric(frame["time"], errors="coerce").to_numpy(dtype=np.float64)
    again = np.append(False, np.diff(time) == 0)
    if not again.any():
        return frame
    if at_events is None:
        row = int(again.argmax())
        count = int(again.sum())
        raise TableError(
            f"{name}: time {time[row]:.9g} s is repeated in data row {row + 1} ({count} such "
            f"{'row' if count == 1 else 'rows'}): if these are events, say by --at-events which rows count: "
            f"{', '.join(AT_EVENTS)}"
        )
    first = ~again
    last = np.append(~again[1:], True)
    kept = {"left": first, "right": last, "both": first | last}[at_events]
    rows: pd.DataFrame = frame[kept].reset_index(drop=True)
    if at_events == "both":
        times = pd.to_numeric(rows["time"], errors="coerce").to_numpy(dtype=np.float64).copy()
        after = np.append(False, np.diff(times) == 0)
        times[after] = np.nextafter(times[after], np.inf)
        rows["time"] = times
    return rows
