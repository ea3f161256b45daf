"""Runs of the paper's conditions by its own formulation and solver, and what each shows of its figures."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

import numpy as np
import pandas as pd

from comparison.execution.run import VIOLATED, Job, Progress, run_one, run_uncached
from comparison.execution.store import Row
from comparison.execution.tasks import Task
from comparison.scene import Scene
from comparison.studies.paper.runs import (
    CENTRAL,
    PEAKS,
    RANGES,
    Config,
    Runs,
    ideal_scene,
    long_scene,
    numbers,
    short_scene,
)
from comparison.studies.paper.runs import measure as shown
from comparison.studies.shared.scenes import MULTIPLIERS_BDF, at_tier
from comparison.tables.table import Table

MODEL = MULTIPLIERS_BDF.model
COORDINATES = ("slider_x", "slider_y", "slider_angle")
RATES = ("slider_vx", "slider_vy", "slider_omega")


@cache
def figures() -> pd.DataFrame:
    """Return those of the `numbers` that are peaks or ranges with clearance at the slider, no misprints."""
    every = numbers()
    name = every["quantity"]
    kinds = name.isin(PEAKS) | name.str.rpartition("_")[0].isin(RANGES)
    return every[kinds & (every["pair"] == "translational") & (every["use"] != "misprint")]


@dataclass(frozen=True)
class Run(Task):
    """A run of a condition: of two cycles for its peaks, or of more for its ranges."""

    name: str  # of the condition
    scene: Scene
    config: Config
    ranges: bool

    @property
    def models(self) -> tuple[str, ...]:
        """The reference alone."""
        return (MODEL,)

    @property
    def cost(self) -> float:
        """Expected time, s."""
        cycles = float(self.scene.data["drive"]["cycles"])
        return cycles * (1.3 if self.scene.data["solver"][MODEL]["method"] == "BDF" else 0.02)


def asked(
    config: Config, name: str, changes: Mapping[str, object], *, ranges: bool, moved: float = 0.0
) -> Run:
    """Return a run of a condition at changed settings, or from a start moved by so much, m.

    Without changes it counts as converged: minimal formulation, at the tight tier.
    """
    scene = at_tier(long_scene(config, name), "tight") if ranges else short_scene(config, name)
    start = scene.data["mechanism"]["reference_offset"] + moved
    return Run(name, scene.variant({**changes, "initial.slider_offset": start}), config, ranges)


def measure(task: Run, progress: Progress) -> Row:
    """Run, and return status, message, drift and what the run shows of each figure.

    ``values``: id -> value and instant (s, nan of a range); ``scales``: median size of each of the slider's
    coordinates and rates. A run whose constraints drift past the model's bounds has them too: the paper's
    program need not have noticed.
    """
    outcome = run_uncached(Job(task.scene, MODEL), progress)
    table = outcome.partial if outcome.status == VIOLATED else outcome.table
    row: Row = {"status": outcome.status, "message": outcome.message, "values": {}}
    if table is None:
        return row
    runs, printed = _as_runs(task, table), figures()
    for identifier in printed.index[printed["scene"] == task.name]:
        if (printed.loc[identifier, "quantity"] in PEAKS) != task.ranges:
            peak = shown(str(identifier), runs, MODEL, {})
            row["values"][str(identifier)] = [peak.value, peak.time]
    row["scales"] = {name: float(np.median(np.abs(table.values(name)))) for name in (*COORDINATES, *RATES)}
    return row | {"drift": table.provenance.get("constraints", {}).get("position")}


def _as_runs(task: Run, table: Table) -> Runs:
    """Return one run as the study paper measures it."""
    key, ideal = (task.name, MODEL), _ideal(task.config, task.name)
    short, long = ({}, {key: table}) if task.ranges else ({key: [table]}, {})
    ideals = {key: ideal, (CENTRAL, MODEL): ideal}
    return Runs(task.config, short, ideals, long)


@cache
def _ideal(config: Config, name: str) -> Table:
    return run_one(ideal_scene(config, name), MODEL)
