"""Errors of the slider's motion: a result less the ideal mechanism's at equal time, Eq. 35 of the paper."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from comparison.tables.align import SAME_GRID, hermite
from comparison.tables.channels import Array, channels
from comparison.tables.table import Table, TableError

QUANTITIES = {"displacement": "slider_y", "velocity": "slider_vy", "acceleration": "slider_ay"}
"""Channels of the paper's displacement, velocity and acceleration of the slider, y up."""
PRIMITIVES = {"slider_vy": "slider_y", "slider_ay": "slider_vy"}  # channels, and whose rate they are


@dataclass(frozen=True)
class Peak:
    """An error of largest size, signed, and its instant, s."""

    value: float
    time: float


@dataclass(frozen=True)
class SliderErrors:
    """Errors at the times (s) of the result from the start of the first cycle that counts, shape (n,).

    ``by_channel``: actual less ideal. ``between``: times and errors where the model has its extrema, of each
    cycle or of the whole run, shape (2, m): they need not be samples.
    """

    time: Array
    period: float
    by_channel: dict[str, Array]
    between: dict[str, Array]

    def peak(self, channel: str, start: float = -np.inf, end: float = np.inf) -> Peak:
        """Return the error of largest size from ``start`` to ``end`` (s), between samples too."""
        slack = SAME_GRID * self.period
        samples = np.array([self.time, self.by_channel[channel]])
        points = np.concatenate([samples, self.between[channel]], axis=1)
        points = points[:, (points[0] >= start - slack) & (points[0] <= end + slack)]
        if not points.size:
            raise TableError(f"the result: has no sample from {start:g} to {end:g} s")
        time, value = points[:, np.abs(points[1]).argmax()].tolist()
        return Peak(value, time)


def slider_errors(
    actual: Table,
    ideal: Table,
    period: float,
    *,
    start: float = 0.0,
    names: Sequence[str] = tuple(QUANTITIES.values()),
) -> SliderErrors:
    """Return the errors of a result, from a start (s) on, against the ideal mechanism's at its times.

    Of the channels ``names`` that the result holds; `TableError` if the ideal one lacks one of them, a table
    does not start at zero, or they have too few times in common.
    """
    held = [name for name in names if name in actual.names]
    if not held:
        raise TableError(f"the result: holds none of {', '.join(names)}")
    if missing := [name for name in held if name not in ideal.names]:
        raise TableError(f"the ideal mechanism's: channel {missing[0]} is missing")
    for name, table in (("the result", actual), ("the ideal mechanism's", ideal)):
        if table.time.size < 2 or abs(table.time[0]) > 0.5 * np.diff(table.time).mean():
            raise TableError(f"{name}: does not start at t = 0 s")
    slack = SAME_GRID * period
    counts = (actual.time >= start - slack) & (actual.time <= ideal.time[-1] + slack)
    time = actual.time[counts]
    if time.size < 2:
        raise TableError("the result and the ideal mechanism's: have no interval in common")

    def off(name: str, at: Array, values: Array) -> Array:
        slopes = np.gradient(ideal.values(name), ideal.time, edge_order=2 if ideal.time.size > 2 else 1)
        within = np.clip(at, ideal.time[0], ideal.time[-1])
        return values - hermite(ideal.time, ideal.values(name), slopes, within)[0]

    by_channel, between = {}, {}
    for name in held:
        at, values = _extrema(actual, name)
        kept = (at >= start - slack) & (at <= time[-1] + slack)
        by_channel[name] = off(name, time, actual.values(name)[counts])
        between[name] = np.array([at - start, off(name, at, values)])[:, kept]
    return SliderErrors(time - start, period, by_channel, between)


def unit_of(quantity: str) -> str:
    """Return the unit of one of `QUANTITIES`."""
    return channels()[QUANTITIES[quantity]].unit


def _extrema(table: Table, name: str) -> Array:
    """Return times and values of a channel's extrema: of each cycle, else of the whole run, where known."""
    parts = [f"{name}_{part}" for part in ("time_of_min", "time_of_max", "min", "max")]
    whole = {f"{name}_{part}": [value] for part, value in table.extrema.get(name, {}).items()}
    held = next((known for known in (table.cycle_extrema or {}, whole) if known.keys() >= set(parts)), None)
    if held is None:
        return np.empty((2, 0))
    points = np.reshape([held[part] for part in parts], (2, -1)).astype(np.float64)
    return points[:, np.isfinite(points).all(axis=0)]
