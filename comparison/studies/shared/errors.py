"""The second cycle of a run, from which the paper takes its peaks."""

from __future__ import annotations

from comparison.tables.arrays import Array, BoolArray


def second_cycle(time: Array, period: float) -> BoolArray:
    """Return where the time is in [T, 2T], up to its rounding."""
    slack = 1e-9 * period
    return (time >= period - slack) & (time <= 2 * period + slack)
