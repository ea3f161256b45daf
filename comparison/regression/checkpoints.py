"""Checkpoints of a run for a baseline: few samples, where the model's own uncertainty is small.

A sample can be a checkpoint where the run is predictable, as in `comparison.verdict.channel` but by the
uncertainty of this model alone, and where the channel is further from zero than its threshold: a force is
zero most of the time, whatever the model does.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from decimal import ROUND_CEILING, Context, Decimal
from math import ceil, floor, log10
from typing import Any

import numpy as np
from numpy.typing import NDArray

from comparison.accuracy.thresholds import thresholds
from comparison.execution.job import Job
from comparison.regression.baseline import Checkpoint, RunRecord
from comparison.regression.neighbours import scatter
from comparison.tables.channels import channels, expected
from comparison.tables.table import Table
from comparison.verdict.compare import Runs, model_uncertainty

COUNT = 5  # of a channel: with ten scenes the file stays near 100 kB


def record(runs: Runs, gated: Job, tier: str, neighbours: Sequence[Table] = ()) -> RunRecord:
    """Choose a run's checkpoints, spread evenly over the samples that can be one.

    Parameters
    ----------
    runs
        The run, and the others of its family that give the uncertainty.
    gated, tier
        What was run, at which of `comparison.accuracy.tiers.TIERS`.
    neighbours
        The run from starts next to its own. They count like perturbed runs: on another machine round-off
        alone leads to one of them, after each chatter to another one.
    """
    limits, scene, time = thresholds(tier), gated.scene, runs.base.time
    predictable: dict[str, NDArray[np.bool_]] = {}
    found: dict[str, list[Checkpoint]] = {}
    unexcited, unpredictable = [], []
    for name in expected(scene.data):  # positions come before what follows from them
        channel, values = channels()[name], runs.base.values(name)
        u = model_uncertainty(runs, name, scene.period)
        assert u is not None  # every model of ours can be refined
        u = np.maximum(u, scatter(gated, runs.base, neighbours, name))
        extent = float(np.ptp(values))
        predictable[name] = u <= limits.alpha * channel.scale_value(scene.data, extent)
        if channel.follows is not None:
            predictable[name] &= predictable[channel.follows]
        candidates = np.flatnonzero(predictable[name] & (np.abs(values) > limits.k * u))
        if extent < channel.floor:
            unexcited.append(name)
        elif not candidates.size:
            unpredictable.append(name)
        else:
            at = np.unique(((np.arange(COUNT) + 0.5) / COUNT * candidates.size).astype(int))
            found[name] = [_checkpoint(time[i], values[i], limits.k * u[i]) for i in candidates[at].tolist()]
    return RunRecord(
        settings=settings(scene.data, runs.base, gated.model),
        counters=counters(runs.base),
        spread=_spread(runs, neighbours),
        unexcited=unexcited,
        unpredictable=unpredictable,
        channels=found,
    )


def settings(scene: Mapping[str, Any], table: Table, model: str) -> dict[str, Any]:
    """Return the model's settings of a scene, with the formulation that it chose by itself."""
    chosen = {key: table.provenance[key] for key in ("formulation",) if key in table.provenance}
    return {**scene["solver"][model], **chosen}


def counters(table: Table) -> dict[str, int]:
    """Return the counters of a run's work, and how many contacts it had."""
    contacts = 0 if table.events is None else len(table.events)
    return {**table.provenance.get("counters", {}), "contacts": contacts}


def _spread(runs: Runs, neighbours: Sequence[Table]) -> dict[str, int]:
    """Return the largest distance of each counter that varies.

    The work of a run depends on its setting; its number of contacts does not, so for contacts the whole
    family counts. Without neighbours (five bodies) the work varies in the proportion in which the contacts
    do: where the family does not have the same ones, rounding alone leads to others, and their steps.
    """
    own = counters(runs.base)
    others = [counters(neighbour) for neighbour in neighbours]
    family = [run for run in (runs.finer, runs.coarser, *runs.perturbed_runs) if run is not None]
    others += [{"contacts": counters(run)["contacts"]} for run in family]
    largest = {
        name: max((abs(other.get(name, value) - value) for other in others), default=0)
        for name, value in own.items()
    }
    if not neighbours and own["contacts"]:
        share = largest["contacts"] / own["contacts"]
        largest |= {name: ceil(share * value) for name, value in own.items() if name != "contacts"}
    return {name: distance for name, distance in largest.items() if distance}


def _checkpoint(time: float, value: float, threshold: float) -> Checkpoint:
    """Keep the significant digits: of the value to a hundredth of the threshold, of the threshold two."""
    rounded = Context(prec=2, rounding=ROUND_CEILING).create_decimal(Decimal(float(threshold)))
    return Checkpoint(float(f"{time:.9g}"), round(float(value), 2 - floor(log10(threshold))), float(rounded))
