"""Contact forces resolved in time: the samples of a table are farther apart than most contacts last.

A model notes the forces of its contacts at its own steps; the table of its base run has them. No verdict
depends on them: they are drawn.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.interpolate import PchipInterpolator

from comparison.tables.arrays import Array
from comparison.tables.table import Table

POINTS = 20
"""Points of a drawn pulse at least; fewer noted ones are joined by a monotone spline."""
_NOTED = 5
"""Points that a model must have noted of a contact, its peak among them."""
PEAK = 0.01
"""Relative distance of a drawn pulse's peak from that of the event table at most."""


@dataclass(frozen=True)
class Pulse:
    """Normal force of one contact, shape (n,), n >= `POINTS`.

    Attributes
    ----------
    row
        Row of the contact in the base run's event table.
    time
        From the touch, s, increasing.
    force
        N.
    """

    row: int
    time: Array
    force: Array


def noted(table: Table) -> list[Pulse]:
    """Return the contacts that a table has the force of, with enough points and the peak of its events."""
    if table.pulses is None or table.events is None:
        return []
    row, time, force = (table.pulses[name] for name in ("row", "time", "force"))
    starts, peaks = (table.events[name].to_numpy(dtype=np.float64) for name in ("start", "peak_force"))
    edges = np.flatnonzero(np.diff(row, prepend=-1, append=-1)).tolist()
    pulses = [
        _pulse(int(row[first]), time[first:stop] - starts[row[first]], force[first:stop])
        for first, stop in pairwise(edges)
        if stop - first >= _NOTED
    ]
    return [pulse for pulse in pulses if _has_peak(pulse, float(peaks[pulse.row]))]


def _pulse(row: int, time: Array, force: Array) -> Pulse:
    """Return a contact's force at the steps of the model; the few of a method of high order are joined."""
    if time.size < POINTS:
        parts = np.linspace(0.0, 1.0, -(-POINTS // (time.size - 1)), endpoint=False)
        closer = np.append((time[:-1, None] + np.diff(time)[:, None] * parts).ravel(), time[-1])
        time, force = closer, PchipInterpolator(time, force)(closer)
    return Pulse(row, time, force)


def _has_peak(pulse: Pulse, peak: float) -> bool:
    """Whether a pulse has, against errors of any kind, the peak of its row in the events."""
    return abs(float(pulse.force.max()) - peak) <= PEAK * peak > 0.0
