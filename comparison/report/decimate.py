"""Decimation of curves for plotting, preserving their envelopes.

A run of 100 cycles has 100,000 samples, a figure some 400 columns. Plain decimation would drop contact forces
that last for a single sample; keeping the smallest and the largest sample of every column preserves them.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from comparison.tables.arrays import Array, BoolArray

COLUMNS = 400
"""Columns of a figure: about its width in points."""


def envelope(values: Array, columns: int = COLUMNS) -> NDArray[np.intp]:
    """Return the indices of the samples of the lower and upper envelope.

    Parameters
    ----------
    values
        Samples in order of time, shape (n,).
    columns
        Number of columns, with equal numbers of samples.

    Returns
    -------
    indices
        Strictly increasing; the first smallest and the first largest sample of each column, and the first and
        the last sample of all. All samples if there are at most two per column.
    """
    n = len(values)
    if n <= 2 * columns:
        return np.arange(n)
    kept = {0, n - 1}
    for start, block in _blocks(values, columns):
        kept.update((start + int(np.argmin(block)), start + int(np.argmax(block))))
    return np.array(sorted(kept))


def upper_envelope(values: Array, columns: int = COLUMNS) -> NDArray[np.intp]:
    """Return the index of the largest sample of each column, increasing; for magnitudes on a log axis."""
    if len(values) <= columns:
        return np.arange(len(values))
    return np.array([start + int(np.argmax(block)) for start, block in _blocks(values, columns)])


def _blocks(values: Array, columns: int) -> Iterator[tuple[int, Array]]:
    """Yield (index of the first sample, samples) of each column."""
    edges = (np.arange(columns + 1) * len(values)) // columns
    for start, stop in pairwise(edges.tolist()):
        yield start, values[start:stop]


def spans(mask: BoolArray, time: Array, columns: int = COLUMNS) -> list[tuple[float, float]]:
    """Return the time intervals in which the mask holds, for shading.

    Each sample represents the time half-way to its neighbours. An interval narrower than a column is widened
    to one to remain visible; intervals that then touch are merged.

    Parameters
    ----------
    mask, time
        Shape (n,), time increasing.
    columns
        Columns of the figure, which spans the time.

    Returns
    -------
    stretches
        (start, end) in the unit of time, increasing, disjoint and inside the span.
    """
    if not mask.any():
        return []
    middle = (time[1:] + time[:-1]) / 2
    left, right = np.append(time[0], middle), np.append(middle, time[-1])
    change = np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8))
    first, last = np.flatnonzero(change == 1), np.flatnonzero(change == -1) - 1
    least = (time[-1] - time[0]) / columns
    joined: list[tuple[float, float]] = []
    for start, end in zip(left[first], right[last], strict=True):
        missing = max(0.0, least - (end - start)) / 2
        low, high = max(time[0], start - missing), min(time[-1], end + missing)
        if joined and low <= joined[-1][1]:
            joined[-1] = (joined[-1][0], high)
        else:
            joined.append((float(low), float(high)))
    return joined
