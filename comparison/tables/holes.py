"""Missing rows of a table, found from its times."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from comparison.tables.arrays import Array

_EVEN = 0.9  # share of equal steps from which times count as equidistant
_COVERED = 0.05  # share of the span that they then cover at least
_EQUAL = 0.1  # by which equal steps differ, as a share of the usual one: times with few digits
_RATIO = 10.0  # of a hole to the longest other step, where steps vary
_FEW = 0.01  # of the steps of such a table, at most, that can be holes


class Hole(NamedTuple):
    """Interval without rows."""

    start: float
    end: float
    """Its two rows, s."""
    missing: int
    """Rows that are missing between them, at the table's usual interval; 0 where that is unknown."""


def holes(time: Array) -> list[Hole]:
    """Find the holes in a table's times.

    Of equidistant times (nine tenths of the steps are equal to 10 %, and make up a part of the span) every
    step of two intervals or more is one. Where a program chooses its steps, a hole is ten times as long as
    every step that is not, and there are few of them; a shorter one looks like a long step.

    Parameters
    ----------
    time
        s, strictly increasing, shape (n,), n >= 2.
    """
    steps = np.diff(time)
    usual = float(np.median(steps))
    equal = np.abs(steps - usual) <= _EQUAL * usual
    # Not where most steps are equal because they resolve contacts, between which the solver takes long ones.
    if equal.mean() >= _EVEN and steps[equal].sum() >= _COVERED * (time[-1] - time[0]):
        missing = np.round(steps / usual) - 1
        found = np.flatnonzero(missing >= 1)
        return [Hole(float(time[n]), float(time[n + 1]), int(missing[n])) for n in found]
    ordered = np.sort(steps)
    most = max(1, int(_FEW * steps.size))
    jumps = np.flatnonzero(ordered[1:] >= _RATIO * ordered[:-1])
    if steps.size < 3 or not jumps.size or steps.size - 1 - jumps[-1] > most:
        return []
    found = np.flatnonzero(steps >= ordered[jumps[-1] + 1])
    return [Hole(float(time[n]), float(time[n + 1]), 0) for n in found]


def isolated(time: Array, values: Array, allowed: float) -> Array:
    """Return each sample's distance from the line through its neighbours where above a limit, else 0.

    Parameters
    ----------
    time, values
        Shape (n,), n >= 3; s, strictly increasing.
    allowed
        The limit, in the unit of the values. Of two neighbouring samples both can be above it.
    """
    distance = np.zeros(time.shape)
    share = (time[1:-1] - time[:-2]) / (time[2:] - time[:-2])
    line = values[:-2] + share * (values[2:] - values[:-2])
    distance[1:-1] = np.abs(values[1:-1] - line)
    return np.where(distance > allowed, distance, 0.0)
