"""Both models as distributions, on the part of the time where single runs cannot be compared."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from comparison.accuracy.levels import thresholds
from comparison.execution.run import Job, Progress, run_all, successful
from comparison.report import svg
from comparison.scene import load_scene
from comparison.studies.ensembles.statistics import RATE, distances, numbers_of, scattered
from comparison.studies.shared.scenes import at_tier
from comparison.studies.shared.study import Study
from comparison.tables.arrays import Array
from comparison.tables.channels import channels

CYCLES, FIRST_CYCLE = 4, 1
SPREAD = 0.01
"""Of the clearance: initial offsets are drawn from so much to either side. After a cycle it is forgotten."""
COMPARED = ("slider_x", "slider_angle", "slider_vx", "slider_vy", "slider_omega")
INSTANTS = 40
"""A cycle, at which the channels are compared."""
ROUND_OFF = 1e-16
"""m; of a coordinate of 0.55 m."""


class Ensemble(NamedTuple):
    """Runs that are compared with the first ensemble."""

    words: str
    expected: str
    model: str
    seed: int
    changed: dict[str, object]


ENSEMBLES = (
    Ensemble("", "", "reference", 1, {}),
    Ensemble("reference against Exudyn", "the question", "exudyn", 2, {}),
    Ensemble("reference against itself, other starts", "nothing", "reference", 3, {}),
    Ensemble("restitution 1 % lower in one", "a difference", "reference", 4, {"contact.restitution": 0.891}),
    Ensemble("restitution 5 % lower in one", "a difference", "reference", 5, {"contact.restitution": 0.855}),
    Ensemble("friction 1 % higher in one", "a difference", "reference", 6, {"friction.coefficient": 0.1515}),
)
"""The first is compared with each of the others: the question, and controls."""


@dataclass(frozen=True)
class Results:
    """Tests, and what is drawn."""

    members: int
    """Runs in an ensemble."""
    tests: list[pd.DataFrame]
    """By `distances`, one for each ensemble but the first."""
    cycles: Array
    """Times in cycles, shape (n,)."""
    bands: list[Array]
    """5, 50 and 95 % quantiles of x over the runs of the reference and of Exudyn, m, shape (3, n) each."""
    predictable: float
    """m; where x scatters by less single runs can be compared."""


def member(ensemble: Ensemble, k: int) -> Job:
    """Return the k-th run of an ensemble: every seed draws offsets of its own."""
    scene = load_scene("150rpm-0.2mm", {"drive.cycles": float(CYCLES), "output.samples_per_cycle": 200})
    clearance, usual = scene.data["clearance"]["slider"], scene.data["initial"]["slider_offset"]
    moved = SPREAD * clearance * np.random.default_rng([ensemble.seed, k]).uniform(-1.0, 1.0)
    drawn = scene.with_values({"initial.slider_offset": float(usual + moved)} | ensemble.changed)
    return Job(at_tier(drawn, "tight"), ensemble.model)


def measure(members: int, n_jobs: int, on_progress: Progress | None) -> Results:
    """Run the ensembles, each of so many runs, all of which must succeed, and test them."""
    jobs = [member(ensemble, k) for ensemble in ENSEMBLES for k in range(members)]
    tables = map(successful, run_all(jobs, n_jobs, on_progress), jobs)
    ensembles = [list(islice(tables, members)) for _ in ENSEMBLES]
    scene, known, alpha = jobs[0].scene, channels(), thresholds().alpha
    instants = scene.period * np.arange(FIRST_CYCLE * INSTANTS, CYCLES * INSTANTS) / INSTANTS
    units = {name: known[name].unit for name in COMPARED}
    floors = {name: alpha * known[name].scale_value(scene.data, 0.0) for name in COMPARED}
    first, *others = (numbers_of(runs, instants, units, scene.period, FIRST_CYCLE) for runs in ensembles)
    x = ([run.values("slider_x") for run in runs] for runs in ensembles[:2])
    return Results(
        members,
        [distances(*scattered(first, other, floors)) for other in others],
        ensembles[0][0].time / scene.period,
        [np.quantile(values, (0.05, 0.5, 0.95), axis=0) for values in x],
        alpha * scene.data["clearance"]["slider"],
    )


def page(results: Results) -> dict[str, object]:
    """Return what stands in the page."""
    rows = []
    for ensemble, tests in zip(ENSEMBLES[1:], results.tests, strict=True):
        least = int(tests["p"].argmin())
        quantity, where, _ = tests.index[least]
        rows.append(
            {
                "ensembles": ensemble.words,
                "expected": ensemble.expected,
                "tests": len(tests),
                f"unadjusted p <= {RATE:g}": (tests["p"] <= RATE).sum(),
                "differ": f"**{tests['differs'].sum()}**",
                "smallest adjusted p": f"{tests['adjusted'].min():.2g}",
                "largest distance": f"{tests['statistic'].iloc[least]:.2f} ({quantity}, {where})",
            }
        )
    return {
        "question": results.tests[0],
        "answers": pd.DataFrame(rows),
        "members": results.members,
        "cycles": CYCLES,
        "spread": f"{SPREAD:.0%}",
        "instants": INSTANTS,
        "rate": f"{RATE:.0%}",
    }


def draw(results: Results, folder: Path) -> None:
    """Draw the medians of both ensembles and how far their runs scatter; write the tests of both models."""
    tests = results.tests[0].sort_values("p", kind="stable")
    tests.to_csv(folder / "tests.csv", float_format="%.6g")
    middle = 0.5 * float(results.bands[0].max() + results.bands[0].min())
    with svg.panels(folder / "slider_x.svg", 2, height=4.4, sharex=True) as (upper, lower):
        for (low, median, high), line, label in zip(
            results.bands, svg.MODEL_LINES, ("reference", "exudyn"), strict=True
        ):
            upper.plot(results.cycles, 1e3 * (median - middle), label=label, **line)
            # Zero has no logarithm.
            lower.semilogy(results.cycles, 1e3 * np.maximum(high - low, ROUND_OFF), **line)
        lower.axhline(1e3 * results.predictable, color=svg.LIMIT, dashes=(1, 2))
        upper.plot([], [], label="predictable below", color=svg.LIMIT, dashes=(1, 2))
        upper.set_ylabel("median of slider x (mm)")
        lower.set(xlabel="time (crank cycles)", ylabel="95 % − 5 % quantile (mm)")
        svg.legend_above(upper)


STUDY = Study(
    "ensembles",
    small=3,  # runs in an ensemble
    full=64,
    measure=measure,
    page=page,
    draw=draw,
)
