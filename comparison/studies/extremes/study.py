"""The study extremes: the grid of runs, the limits with a known answer, and the stability of steps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import pandas as pd

from comparison.execution.run import Progress
from comparison.files import replacing
from comparison.studies.extremes import figures, tables
from comparison.studies.extremes.campaign import LONG_LIMIT, SHORT_LIMIT, run_campaign
from comparison.studies.extremes.cells import AXES, HYPERCUBE, LAWS, cells
from comparison.studies.extremes.checks import check
from comparison.studies.extremes.limits import section as limits
from comparison.studies.extremes.reasons import unexplained
from comparison.studies.extremes.refinement import rerun
from comparison.studies.extremes.runs import LIMIT
from comparison.studies.extremes.step_stability import section as step_stability
from comparison.studies.shared.benchmark_unit import BENCHMARK
from comparison.studies.shared.study import Study, part

SHARES = (0.0, 0.7, 0.83, 0.86, 0.93, 1.0)
"""Of the expected time: where the grid, checks, refined reruns, and each further part begin and end."""
Part = Study[Any, Any]


@dataclass(frozen=True)
class Config:
    """Axes along which one number is pushed, points of the Latin hypercube, and further parts of the page."""

    axes: Sequence[str]
    points: int
    parts: tuple[Part, ...]


@dataclass(frozen=True)
class Results:
    """The runs of the grid (`tables.frame`), and each further part with what it measured."""

    runs: pd.DataFrame
    parts: list[tuple[Part, Any]]


def measure(config: Config, n_jobs: int, on_progress: Progress | None) -> Results:
    """Run all parts."""
    grid, checked, reruns, *others = (part(on_progress, *ends) for ends in pairwise(SHARES))
    outcomes = run_campaign(cells(config.axes, config.points), n_jobs, grid)
    check(outcomes, n_jobs, checked)
    rerun(outcomes, unexplained(outcomes), n_jobs, reruns)
    parts = zip(config.parts, others, strict=False)
    found = [(each, each.measure(each.full, n_jobs, share)) for each, share in parts]
    return Results(tables.frame(outcomes), found)


def page(results: Results) -> Mapping[str, object]:
    """Return what stands in the page."""
    runs = results.runs
    different = tables.differing(runs)
    return {
        "finding": tables.finding(runs),
        "limit": f"{LIMIT:g}",
        "short_limit": f"{SHORT_LIMIT:g}",
        "long_limit": f"{LONG_LIMIT:g}",
        "benchmark": BENCHMARK,
        "points": runs.loc[runs["axis"] == HYPERCUBE, "cell"].nunique(),
        "counts": tables.counts(runs),
        "announced": tables.announced(runs),
        "drifts": tables.drifts(runs),
        "cycles": tables.cycles(runs),
        "stops": tables.stops(runs),
        "differences": tables.along_the_axes(different),
        "hypercube": tables.in_the_hypercube(different),
        "unexplained": tables.unexplained(runs),
        "parts": "\n".join(each.text(found) for each, found in results.parts),
    }


def draw(results: Results, folder: Path) -> None:
    """Write the figures, and every run of the grid as a row of cells.csv."""
    figures.draw(results.runs, LAWS[:2], folder)
    for each, found in results.parts:
        each.draw(found, folder)
    with replacing(folder / "cells.csv") as file:
        tables.csv(results.runs).to_csv(file, index=False)


STUDY = Study(
    "extremes",
    # What the further parts hold the models to only the models can give, not few and short runs.
    small=Config(axes=AXES[:3], points=12, parts=()),
    full=Config(axes=AXES, points=200, parts=(limits.STUDY, step_stability.STUDY)),
    measure=measure,
    page=page,
    draw=draw,
)
