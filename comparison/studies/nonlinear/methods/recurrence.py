"""How often a stroboscopic section repeats: the period of an orbit in periods of its drive."""

from __future__ import annotations

import numpy as np

from comparison.tables.arrays import Array

LONGEST = 16
"""The longest period that is looked for."""


def period(section: Array, tolerance: float) -> int | None:
    """Return after how many periods of the drive, the fewest, the whole of a stroboscopic section repeats.

    The section has one value or state a period, shape (n,) or (n, k); two of them that are as close as the
    tolerance, in their unit, are the same. None: no period up to `LONGEST` holds, or the section is too short
    to have shown it twice.
    """
    points = section.reshape(len(section), -1)
    for count in range(1, min(LONGEST, len(points) // 2) + 1):
        if np.max(np.linalg.norm(points[count:] - points[:-count], axis=1)) <= tolerance:
            return count
    return None
