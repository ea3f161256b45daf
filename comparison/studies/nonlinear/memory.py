"""What the slider remembers while it rests: its later state as a function of frozen impact speeds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from comparison.scene import Scene
from comparison.studies.nonlinear.press import STATE, by_cycle, scale, states
from comparison.tables.arrays import Array
from comparison.tables.table import Table

RESTING = 0.78
"""Of a cycle from the start: the slider lies at the right wall with both corners."""
LATER = (0.78, 0.86, 0.0)
"""Of a cycle: still at rest, just after it has left the wall, at the next top dead centre."""
CORNERS = ("lr", "ur")


@dataclass(frozen=True)
class Memory:
    """Of one coordinate of the state at an angle, over many cycles."""

    angle: float
    channel: str
    scatter: float
    """Standard deviation, m, by `scale`."""
    explained: float
    """Share of the variance that is a linear function of the inverse impact speeds, 0 to 1."""


def remembered(table: Table, scene: Scene, first_cycle: int) -> list[Memory]:
    """Fit the states after a rest by the impact speeds that the contacts keep through it.

    The damping force is K d^n C d' / v with the frozen speed v of the contact's first touch (Eqs. 9-11):
    where d' is given from outside, as in the slow rise and fall of the load during the rest, the depth
    departs from the elastic one by a share of 1 / v.

    Returns
    -------
    remembered
        Four for each angle of `LATER`, from ``first_cycle`` (from 0) on; none where the slider does not rest
        on both corners in every cycle.
    """
    cycles = by_cycle(states(table, scene) * scale(scene), scene)
    speeds = _speeds(table, scene, first_cycle, len(cycles) - 1)
    if speeds is None:
        return []
    found = []
    for angle in LATER:
        sample = round(angle * cycles.shape[1])
        # What comes before the rest in a cycle's count of angles is in the next cycle.
        shift = 1 if angle < RESTING else 0
        values = cycles[first_cycle + shift : len(cycles) - 1 + shift, sample]
        basis = np.column_stack([np.ones(len(speeds)), 1.0 / speeds])
        for k, channel in enumerate(STATE):
            fitted = basis @ np.linalg.lstsq(basis, values[:, k])[0]
            scatter = float(np.std(values[:, k]))
            left = float(np.var(values[:, k] - fitted))
            found.append(Memory(angle, channel, scatter, 1.0 - left / scatter**2 if scatter else 0.0))
    return found


def _speeds(table: Table, scene: Scene, first: int, last: int) -> Array | None:
    """Return the impact speeds (m/s) of both corners at rest, shape (cycles, 2)."""
    if table.events is None:
        return None
    speeds = []
    for cycle in range(first, last):
        when = (cycle + RESTING) * scene.period
        closed = table.events[(table.events["start"] < when) & (table.events["end"] > when)]
        of_corner = closed.drop_duplicates("corner").set_index("corner")["normal_speed"].reindex(CORNERS)
        if of_corner.isna().any():
            return None
        speeds.append(of_corner.to_numpy(float))
    return np.array(speeds)
