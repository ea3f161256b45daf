"""How often a stroboscopic section repeats: the period of an orbit in periods of its drive."""

from __future__ import annotations

import numpy as np

from comparison.tables.arrays import Array

LONGEST = 16
"""The longest period that is looked for."""


def period(section: Array, tolerance: float) -> int | None:
    """Return after how many periods of the drive a stroboscopic section repeats.

    Parameters
    ----------
    section
        One value or state a period, shape (n,) or (n, k), in units in which the tolerance makes sense.
    tolerance
        Two states this close are the same.

    Returns
    -------
    int or None
        The shortest that holds over the whole section; None: none up to `LONGEST`, or the section is too
        short to have shown it twice.
    """
    points = section.reshape(len(section), -1)
    for count in range(1, min(LONGEST, len(points) // 2) + 1):
        if np.max(np.linalg.norm(points[count:] - points[:-count], axis=1)) <= tolerance:
            return count
    return None
