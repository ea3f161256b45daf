"""Runs from starts next to that of a gated run: what round-off alone may lead to after chatter.

The perturbed runs alone do not show the scatter of chatter.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, pi, sin, sqrt

from comparison.accuracy.uncertainty import movable, moved, perturbation, spread, window_samples
from comparison.execution.run import Job
from comparison.tables.arrays import Array
from comparison.tables.table import Table

RECORDED = range(8)
"""Of the neighbours, those that a baseline's thresholds count."""
CONFIRMING = range(8, 28)
"""Those that confirm a failed check: twenty, as a "differ" is confirmed by at least 19."""
LATER = 5
"""Chatter ends earlier or later from one start to the next, and what is left of it falls by decades within a
hundredth of a cycle: neighbours are compared within a window wider than that of u by this factor."""


def neighbours(gated: Job, tier: str, numbers: Sequence[int]) -> dict[str, Job]:
    """Return runs from starts next to its own, in all directions.

    None without clearance, nor at the standard tier, where steps of the family differ by more than any start.
    """
    if tier != "tight" or movable(gated.scene) is None:
        return {}
    jobs = {}
    for number in numbers:
        # Once and twice as far as a perturbed run, turned by the golden angle from one to the next.
        angle, shift = number * pi * (3.0 - sqrt(5.0)), (1 + number % 2) * perturbation(gated.scene)
        scene = moved(gated.scene, shift * cos(angle), shift * sin(angle))
        jobs[f"neighbour {number}"] = Job(scene, gated.model)
    return jobs


def scatter(gated: Job, table: Table, tables: Sequence[Table], channel: str) -> Array:
    """Return the part of a run's uncertainty that its neighbours show, shape (n,), in the channel's unit."""
    time = table.time
    width = window_samples(gated.scene.period, float(time[-1] - time[0]) / (time.size - 1))
    return spread(table.values(channel), [one.values(channel) for one in tables], LATER * width)
