"""Contact forces resolved in time: the samples of a table are farther apart than most contacts last.

Where a model notes its contacts' forces, the table of its base run has them. Any other model runs its base
setting once more with dense output, of which the contacts alone are kept. No verdict depends on this run:
what is compared stays the base run, from which the dense one may depart, since steps can end at samples.
Where the two runs have the same contact, its force is drawn.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import pandas as pd

from comparison.agreement.cross_check import Validation
from comparison.agreement.dense_run import DenseRun, dense, measure
from comparison.execution.job import Progress
from comparison.execution.task_store import SUCCESS, measure_all, on_processes
from comparison.metrics.impacts import WINDOW, match
from comparison.tables.arrays import Array
from comparison.tables.table import Table

POINTS = 20
"""Points of a drawn pulse at least."""
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


Pulses = Mapping[tuple[str, str], tuple[Sequence[Pulse], Sequence[Pulse]]]
"""By scene and tier, of either model."""


def resolved(results: Sequence[Validation], n_jobs: int, on_progress: Progress | None = None) -> Pulses:
    """Return the resolved contacts of both models.

    Parameters
    ----------
    results
        Of the scenes; those whose runs failed, and tables without contacts, have none.
    n_jobs
        Number of parallel worker processes, for the models that do not note their contacts' forces.
    on_progress
        Called with the finished share, 0 to 1.

    Raises
    ------
    LedgerError
        If rows cannot be read or kept.
    """
    bases = {
        (result.comparison.name, tier, model): runs[model].base
        for result in results
        for tier, runs in (("standard", result.runs), ("tight", result.tight_runs))
        for model in runs
    }
    found = {key: noted(base) for key, base in bases.items() if base.pulses is not None}
    tasks = {
        key: DenseRun(scene, key[2])
        for key, base in bases.items()
        if key not in found and (scene := dense(base.provenance.get("scene"), base.events)) is not None
    }
    rows = measure_all(measure, list(tasks.values()), on_processes(n_jobs), on_progress)
    for (key, task), row in zip(tasks.items(), rows, strict=True):
        if row["status"] == SUCCESS and (events := bases[key].events) is not None:
            found[key] = drawable(row["contacts"], events, WINDOW * task.scene.period)
    pulses = {}
    for result in results:
        for tier in result.comparison.tiers:
            a, b = (found.get((result.comparison.name, tier.tier, label), []) for label in tier.labels)
            pulses[result.comparison.name, tier.tier] = a, b
    return pulses


def noted(table: Table) -> list[Pulse]:
    """Return the contacts that a table has the force of, with enough points and the peak of its events."""
    if table.pulses is None or table.events is None:
        return []
    row, time, force = (table.pulses[name] for name in ("row", "time", "force"))
    starts, peaks = (table.events[name].to_numpy(dtype=np.float64) for name in ("start", "peak_force"))
    edges = np.flatnonzero(np.diff(row, prepend=-1, append=-1)).tolist()
    pulses = [
        Pulse(int(row[first]), time[first:stop] - starts[row[first]], force[first:stop])
        for first, stop in pairwise(edges)
    ]
    return [pulse for pulse in pulses if _is_drawn(pulse, peaks)]


def drawable(contacts: Iterable[Mapping[str, Any]], events: pd.DataFrame, window: float) -> list[Pulse]:
    """Return the contacts of a dense run that the base run has too, with enough points and the same peak.

    Parameters
    ----------
    contacts
        From `measure`.
    events
        Of the base run.
    window
        Distance of two starts at most, s, see `comparison.metrics.impacts.match`.
    """
    contacts = list(contacts)
    table = pd.DataFrame(
        {"corner": [c["corner"] for c in contacts], "start": [float(c["start"]) for c in contacts]}
    )
    peaks = events["peak_force"].to_numpy(dtype=np.float64)
    pulses = []
    for row, number in match(events, table, window).tolist():
        time, force = (np.array(contacts[number][key], dtype=np.float64) for key in ("time", "force"))
        pulses.append(Pulse(row, time, force))
    return [pulse for pulse in pulses if _is_drawn(pulse, peaks)]


def _is_drawn(pulse: Pulse, peaks: Array) -> bool:
    """Whether a pulse is resolved and, against errors of any kind, has the peak of its row in the events."""
    peak = float(peaks[pulse.row])
    return pulse.time.size >= POINTS and abs(float(pulse.force.max()) - peak) <= PEAK * peak > 0.0
