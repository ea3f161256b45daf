"""Runs with dense output, of which the contacts alone are kept: by models that do not note their forces.

What a worker imports for them is here.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import ceil, log10
from typing import Any

import numpy as np
import pandas as pd

from comparison.execution.job import Job, Progress, kernels
from comparison.execution.run import run_one
from comparison.execution.task_order import Kernels
from comparison.execution.task_store import Task
from comparison.scene import Scene, scene_from_mapping
from comparison.tables.channels import CORNERS, touching
from comparison.tables.pulses import envelope
from comparison.tables.table import Table

_AIMED = 25  # samples of a short contact: a sine's largest one is then 0.2 % below its peak at most
_SHORT = 0.02  # share of the contacts that may be shorter
_MOST = 400_000  # samples of a run, about 100 MB; a longer run is cut


@dataclass(frozen=True)
class DenseRun(Task):
    """Run of a scene with dense output by a model."""

    scene: Scene
    model: str

    @property
    def models(self) -> Sequence[str]:
        """The one model."""
        return (self.model,)

    @property
    def cost(self) -> float:
        """Expected time, s."""
        return Job(self.scene, self.model).cost

    @property
    def kernels(self) -> frozenset[Kernels]:
        """Code that the model compiles at its first run."""
        return frozenset([kernels(self.scene, self.model)])


def measure(task: DenseRun, progress: Progress) -> dict[str, Any]:
    """Run, and return the contacts by start: event and thinned samples of each."""
    table = run_one(task.scene, task.model, progress)
    return {"contacts": list(_contacts(table))}


def dense(recorded: Mapping[str, Any] | None, events: pd.DataFrame | None) -> Scene | None:
    """Return the scene of a model's base run with output that resolves the slider's contacts, if it has any.

    The crank pin's forces are no channels. A run of too many samples is cut: its later contacts are not
    resolved.
    """
    if recorded is None or events is None:
        return None
    at_corners = events[events["corner"].isin(CORNERS)] if len(events) else events
    if at_corners.empty:
        return None
    scene = scene_from_mapping(recorded)
    per_cycle = int(scene.data["output"]["samples_per_cycle"])
    interval = scene.period / per_cycle
    shortest = float(np.quantile(at_corners["end"] - at_corners["start"], _SHORT))
    if not shortest > 0.0:
        return None
    # Round numbers divide the steps between samples, where there are as many
    finer = _round_up(_AIMED * interval / shortest)
    cycles = min(float(scene.data["drive"]["cycles"]), _MOST / (per_cycle * finer))
    groups = dict.fromkeys([*scene.data["output"]["groups"], "corners"])
    return scene.variant(
        {
            "output.samples_per_cycle": per_cycle * finer,
            "output.groups": list(groups),
            "drive.cycles": cycles,
        }
    )


def _contacts(table: Table) -> Iterable[dict[str, Any]]:
    if table.events is None or table.events.empty:
        return
    time = table.time
    events = table.events[table.events["corner"].isin(CORNERS)]
    for corner, start, end in events[["corner", "start", "end"]].itertuples(index=False):
        part = slice(*np.searchsorted(time, [start, end], side="right").tolist())
        sharing = touching(corner, table.provenance.get("scene", {}))
        force = np.sum([table.values(f"corner_{name}_normal")[part] for name in sharing], axis=0)
        kept = envelope(np.zeros(force.size, np.int64), force)
        yield {
            "corner": corner,
            "start": start,
            "time": [float(f"{t:.6g}") for t in (time[part] - start)[kept]],
            "force": [float(f"{n:.6g}") for n in force[kept]],
        }


def _round_up(factor: float) -> int:
    """Return the next larger of 1, 2, 5, 10, 20, ..."""
    decade: int = 10 ** max(0, ceil(log10(max(factor, 1.0))) - 1)
    return next(n * decade for n in (1, 2, 5, 10) if n * decade >= factor)
