"""Bins of the crank cycle and their samples of a run."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Bin:
    """One bin of the crank cycle, cycle by cycle.

    Attributes
    ----------
    angle
        Its upper edge, degrees from the start, by which the paper names it; the edge belongs to it, the lower
        one to the bin before.
    rows
        Samples of `comparison.reliability.errors.SliderErrors`, shape (N cycles, J): of the cycles that reach
        through the whole bin, or the part that there is of the first one.
    whole
        Whether that is the whole bin.
    """

    angle: float
    rows: NDArray[np.intp]
    whole: bool


def bins(count: int, per_cycle: int, samples: int) -> list[Bin]:
    """Divide a run; bins in which it has no sample are left out.

    Parameters
    ----------
    count
        Number of equal bins of a cycle.
    per_cycle, samples
        Samples in a cycle and in the run, the first of them one step after the start.
    """
    # Whole numbers: the edge 36 deg must be in the first bin, whichever way 36 / 360 * 1000 rounds.
    part = ((np.arange(per_cycle) + 1) * count - 1) // per_cycle
    found = []
    for k in range(count):
        first = np.flatnonzero(part == k)
        if not first.size or first[0] >= samples:
            continue
        cycles = (samples - 1 - first[-1]) // per_cycle + 1
        rows = first + per_cycle * np.arange(cycles)[:, None] if cycles else first[None, first < samples]
        found.append(Bin(360.0 * (k + 1) / count, rows, whole=bool(cycles)))
    return found
