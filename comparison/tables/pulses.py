"""Pulses: normal forces of the contacts in time.

They are columns ``row`` (in the events), ``time`` (s) and ``force`` (N), sorted by row and time.
Of a contact with many samples the envelope is kept.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from comparison.tables.arrays import Array
from comparison.tables.columns import Columns

_KINDS = {"row": "iu", "time": "f", "force": "f"}
_KEPT = 32  # samples of a contact; of one with more the envelope in half as many columns
_LONG = 400  # samples from which on a contact's first _KEPT are kept too, and six times the columns


def check_pulses(pulses: Mapping[str, object]) -> None:
    """Reject what are no columns of pulses.

    Raises
    ------
    ValueError
        What is wrong with which.
    """
    columns = {}
    for name, kinds in _KINDS.items():
        column = pulses.get(name)
        if not isinstance(column, np.ndarray) or column.ndim != 1 or column.dtype.kind not in kinds:
            what = "integers" if name == "row" else "real numbers"
            raise ValueError(f"pulses: {name} must be an array of {what}, shape (n,)")
        columns[name] = column
    if len({column.size for column in columns.values()}) > 1:
        raise ValueError("pulses: row, time and force differ in length")
    for name in ("time", "force"):
        if (bad := np.flatnonzero(~np.isfinite(columns[name]))).size:
            raise ValueError(f"pulses: {name} is {columns[name][bad[0]]} in sample {bad[0] + 1}")
    step = np.diff(columns["row"].astype(np.int64))
    if (bad := np.flatnonzero((step < 0) | ((step == 0) & (np.diff(columns["time"]) <= 0.0)))).size:
        raise ValueError(f"pulses: not sorted by row and time at sample {bad[0] + 2}")


def thinned(pulses: Mapping[str, NDArray[np.generic]]) -> Columns:
    """Return the pulses with fewer samples of each long contact; they passed `check_pulses`."""
    kept = envelope(pulses["row"].astype(np.int64), pulses["force"].astype(np.float64))
    return {name: pulses[name][kept].astype("int64" if name == "row" else "float64") for name in _KINDS}


def envelope(row: NDArray[np.int64], force: Array) -> NDArray[np.intp]:
    """Return the samples to keep, increasing: all of a short contact, else the extrema of equal parts.

    Of a long contact the first samples are kept as well: there its impact is.

    Parameters
    ----------
    row, force
        Shape (n,); the contacts are where the row stays the same.
    """
    if not row.size:
        return np.zeros(0, np.intp)
    begun = np.flatnonzero(np.diff(row, prepend=row[0] - 1))
    counts = np.diff(begun, append=row.size)
    parts = np.where(counts <= _KEPT, counts, np.where(counts < _LONG, _KEPT // 2, 3 * _KEPT))
    count = np.repeat(counts, counts)
    place = np.arange(row.size) - np.repeat(begun, counts)
    part = place * np.repeat(parts, counts) // count
    kept = (place == count - 1) | (place < np.where(count < _LONG, 1, _KEPT))
    edges = np.flatnonzero((place == 0) | (np.diff(part, prepend=-1) != 0))
    number = np.repeat(np.arange(edges.size), np.diff(edges, append=row.size))
    for extreme in (np.minimum, np.maximum):
        reached = np.flatnonzero(force == extreme.reduceat(force, edges)[number])
        kept[reached[np.flatnonzero(np.diff(number[reached], prepend=-1))]] = True
    return np.flatnonzero(kept)
