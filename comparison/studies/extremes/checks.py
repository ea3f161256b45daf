"""A posteriori accuracy of the runs that err more than their bound: whether a user is told.

By the run itself, whose warnings `sixbar run` prints (`comparison.execution.quality`), or by
``sixbar run --check``: its estimate from a finer, a coarser and perturbed runs of the same scene exceeds the
bound, or there is none. `sixbar run` names that check for every scene on which the bound was not measured.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import nan

import numpy as np

from comparison.accuracy.levels import refinement
from comparison.accuracy.refine import levels
from comparison.accuracy.uncertainty import Levels, uncertainty, window_samples
from comparison.execution.quality import FEW_STEPS, MUCH_DRIFT, MUCH_ENERGY
from comparison.execution.run import Progress
from comparison.execution.store import Row
from comparison.scene import Scene
from comparison.studies.extremes.campaign import CellOutcome, scene_of
from comparison.studies.extremes.cells import CYCLES
from comparison.studies.extremes.runs import CellRun, run_tasks
from comparison.studies.extremes.verdicts import Class
from comparison.studies.shared.formulations import Method


def check(outcomes: Sequence[CellOutcome], n_jobs: int, on_progress: Progress | None) -> None:
    """Estimate the errors of the degraded runs, note them, and call announced what a user is told of."""
    scenes = {
        (number, method): scene_of(of.cell, method).with_values({"drive.cycles": CYCLES})
        for number, of in enumerate(outcomes)
        for method in of.cell.methods
        if of.verdicts[method.name].kind is Class.DEGRADED
    }
    tasks: dict[tuple[tuple[int, Method], str], CellRun] = {
        (run, kind): CellRun(each, run[1].model, outcomes[run[0]].rows[run[1].name]["limit"])
        for run, scene in scenes.items()
        for kind, each in levels(scene, run[1].model).items()
    }
    rows = run_tasks(tasks, n_jobs, on_progress)
    for run, scene in scenes.items():
        (number, method), name = run, run[1].name
        of = outcomes[number]
        family = {kind: row for (of_run, kind), row in rows.items() if of_run == run}
        of.estimates[name] = error = estimate(family, scene, method.model)
        verdict = of.verdicts[name]
        if warned(of.rows[name]) or not error <= verdict.bound:
            of.verdicts[name] = replace(verdict, kind=Class.ANNOUNCED)


def warned(row: Row) -> bool:
    """Return whether `sixbar run` warns of a run by itself."""
    steps = row.get("steps_per_contact")
    return (
        (steps is not None and steps < FEW_STEPS)
        or (row.get("energy_share") or 0.0) > MUCH_ENERGY
        or (row.get("constraint_m") or 0.0) > MUCH_DRIFT
    )


def estimate(family: Mapping[str, Row], scene: Scene, model: str) -> float:
    """Return the largest numerical uncertainty of slider_x over the cycle, m; nan without a finer run.

    Parameters
    ----------
    family
        Rows of `runs.run_cell` by the names of `comparison.accuracy.refine.levels`.
    scene, model
        Of the run itself.
    """
    x = {kind: np.asarray(row["x"]) for kind, row in family.items() if row["status"] == "success"}
    if not {"base", "finer"} <= set(x):
        return nan
    # Perturbed runs are beside the coarser one, where that is there
    beside = "coarser" in x or "coarser" not in family
    perturbed = tuple(values for kind, values in x.items() if beside and kind.endswith("perturbed"))
    factor, order = refinement(model, scene)
    runs = Levels(x["base"], x["finer"], x.get("coarser"), perturbed, factor, order)
    half_width = window_samples(scene.period, scene.period / scene.data["output"]["samples_per_cycle"])
    return float(uncertainty(runs, half_width, 0.0).max())
