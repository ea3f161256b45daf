"""Errors of the slider's motion: a result less the ideal mechanism's at equal time, Eq. 35 of the paper."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from comparison.tables.arrays import Array
from comparison.tables.channels import channels
from comparison.tables.resample import resample
from comparison.tables.table import Table, TableError
from comparison.tables.time_shift import SAME_GRID

QUANTITIES = {"displacement": "slider_y", "velocity": "slider_vy", "acceleration": "slider_ay"}
"""Channels of the paper's displacement, velocity and acceleration of the slider, y up."""


@dataclass(frozen=True)
class SliderErrors:
    """Errors at equal steps of the crank angle from the start.

    Attributes
    ----------
    per_cycle
        Samples in a crank cycle.
    by_quantity
        Quantity -> actual - ideal in the channel's unit, shape (n,): sample i at (i + 1) 360 / per_cycle deg.
        The start is excluded: there the slider is where the scene puts it.
    """

    per_cycle: int
    by_quantity: dict[str, Array]

    @property
    def samples(self) -> int:
        """Number of samples."""
        return next(iter(self.by_quantity.values())).size


def slider_errors(actual: Table, ideal: Table, period: float) -> SliderErrors:
    """Return the errors of a result against the ideal mechanism's.

    Both may be any tables that start at the crank's start. Tables of the same times with whole samples a
    cycle, as both models make them, are taken as they are; others are interpolated to the coarser one's mean
    interval (`comparison.tables.resample`: accelerations are split at the contacts that the tables record).

    Parameters
    ----------
    actual, ideal
        With channels of `QUANTITIES`: the second must hold all that the first does.
    period
        Of a crank cycle, s.

    Raises
    ------
    TableError
        If a channel is missing, a table does not start at zero, or they have no step in common.
    """
    held = {name: channel for name, channel in QUANTITIES.items() if channel in actual.frame}
    if not held:
        raise TableError(f"the result: holds none of {', '.join(QUANTITIES.values())}")
    if missing := [channel for channel in held.values() if channel not in ideal.frame]:
        raise TableError(f"the ideal mechanism's: channel {missing[0]} is missing")
    for name, table in (("the result", actual), ("the ideal mechanism's", ideal)):
        if table.time.size < 2 or abs(table.time[0]) > 0.5 * _interval(table):
            raise TableError(f"{name}: does not start at t = 0 s")
    interval = max(_interval(actual), _interval(ideal))
    per_cycle = max(1, round(period / interval))
    end = min(actual.time[-1], ideal.time[-1])
    count = int(end / period * per_cycle * (1 + 1e-12) + SAME_GRID)
    if count < 1:
        raise TableError(f"the result and the ideal mechanism's: have no step of {interval:g} s in common")
    grid: Array = np.arange(1, count + 1) * np.float64(period / per_cycle)
    a, b = (_at(table, list(held.values()), grid, SAME_GRID * interval) for table in (actual, ideal))
    return SliderErrors(per_cycle, {name: a[channel] - b[channel] for name, channel in held.items()})


def since(table: Table, start: float) -> Table:
    """Return a table from a sample on, with times counted from there, to omit whole cycles.

    Parameters
    ----------
    start
        Time of a sample, s.
    """
    time = table.time
    first = int(np.abs(time - start).argmin())
    events = table.events
    if events is not None:
        left = events.loc[events["end"] > time[first]]
        events = left.assign(start=left["start"] - time[first], end=left["end"] - time[first])
    later = table.frame.iloc[first:].reset_index(drop=True)
    return replace(table, frame=later.assign(time=later["time"] - time[first]), events=events, pulses=None)


def unit_of(quantity: str) -> str:
    """Return the unit of one of `QUANTITIES`."""
    return channels()[QUANTITIES[quantity]].unit


def _interval(table: Table) -> float:
    """Mean sample interval, s."""
    return float(table.time[-1] - table.time[0]) / (table.time.size - 1)


def _at(table: Table, names: list[str], grid: Array, slack: float) -> dict[str, Array]:
    """Return the channels on the grid: the samples themselves where it is theirs."""
    columns = {channel: table.values(channel) for channel in names}
    own = table.time[1 : grid.size + 1]
    if own.size == grid.size and np.abs(own - grid).max() <= slack:
        return {channel: values[1 : grid.size + 1] for channel, values in columns.items()}
    inside = np.clip(grid, table.time[0], table.time[-1])
    sampled, _ = resample(table.time, columns, inside, table.events)
    return sampled
