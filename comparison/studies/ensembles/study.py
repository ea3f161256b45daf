"""Both models as distributions, on the part of the time where single runs cannot be compared."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import NamedTuple

import numpy as np

from comparison.accuracy.levels import thresholds
from comparison.execution.run import Job, Progress, run_all, successful
from comparison.formatting import number, quantity
from comparison.report import svg
from comparison.scene import Scene, load_scene
from comparison.studies.ensembles.statistics import RATE, Distance, ask, distances
from comparison.studies.shared.frames import rows_table
from comparison.studies.shared.scenes import at_tier
from comparison.studies.shared.study import Study
from comparison.tables.arrays import Array
from comparison.tables.channels import channels
from comparison.tables.table import Table

SCENE = "150rpm-0.2mm"
CYCLES = 4
FIRST_CYCLE = 1
SPREAD = 0.01
"""Of the clearance: initial offsets are drawn from so much to either side. After a cycle it is forgotten."""
ASKED = ("slider_x", "slider_angle", "slider_vx", "slider_vy", "slider_omega")
INSTANTS = 40
"""A cycle, at which the channels are compared."""
SAMPLES = 200
LISTED = 15
ROUND_OFF = 1e-16
"""m; of a coordinate of 0.55 m."""


class Ensemble(NamedTuple):
    """Runs that are compared with the first ensemble."""

    words: str
    expected: str
    model: str
    seed: int
    changed: dict[str, object]


FIRST = Ensemble("", "", "reference", 1, {})
MODELS = Ensemble("reference against Exudyn", "the question", "exudyn", 2, {})
OTHERS = (
    MODELS,
    Ensemble("reference against itself, other starts", "nothing", "reference", 3, {}),
    Ensemble("restitution 1 % lower in one", "a difference", "reference", 4, {"contact.restitution": 0.891}),
    Ensemble("restitution 5 % lower in one", "a difference", "reference", 5, {"contact.restitution": 0.855}),
    Ensemble("friction 1 % higher in one", "a difference", "reference", 6, {"friction.coefficient": 0.1515}),
)


@dataclass(frozen=True)
class Results:
    """What is found and drawn."""

    members: int
    """Runs in an ensemble."""
    tests: list[list[Distance]]
    """One list for each of `OTHERS`."""
    cycles: Array
    """Times in cycles, shape (n,)."""
    bands: tuple[Array, Array]
    """5, 50 and 95 % quantiles of x over the runs of the reference and of Exudyn, m, shape (3, n) each."""
    predictable: float
    """m; where x scatters by less single runs can be compared."""


def member(of: Ensemble, k: int) -> Job:
    """Return the k-th run of an ensemble: every seed draws offsets of its own."""
    scene = load_scene(SCENE, {"drive.cycles": float(CYCLES), "output.samples_per_cycle": SAMPLES})
    clearance, usual = scene.data["clearance"]["slider"], scene.data["initial"]["slider_offset"]
    moved = SPREAD * clearance * np.random.default_rng([of.seed, k]).uniform(-1.0, 1.0)
    drawn = scene.with_values({"initial.slider_offset": float(usual + moved)} | of.changed)
    return Job(at_tier(drawn, "tight"), of.model)


def measure(members: int, n_jobs: int, on_progress: Progress | None) -> Results:
    """Run the ensembles, each of so many runs, and test them.

    Raises
    ------
    RunError
        If a run does not succeed.
    """
    jobs = [member(of, k) for of in (FIRST, *OTHERS) for k in range(members)]
    tables = map(successful, run_all(jobs, n_jobs, on_progress), jobs)
    first, *others = (list(islice(tables, members)) for _ in (FIRST, *OTHERS))
    scene = jobs[0].scene
    return Results(
        members,
        [_tests(first, runs, scene) for runs in others],
        first[0].time / scene.period,
        (_bands(first), _bands(others[OTHERS.index(MODELS)])),
        thresholds().alpha * scene.data["clearance"]["slider"],
    )


def _tests(a: Sequence[Table], b: Sequence[Table], scene: Scene) -> list[Distance]:
    cycle = np.arange(INSTANTS) / INSTANTS
    instants = scene.period * np.concatenate([cycle + k for k in range(FIRST_CYCLE, CYCLES)])
    alpha, known = thresholds().alpha, channels()
    floors = {name: (alpha * known[name].scale_value(scene.data, 0.0), known[name].unit) for name in ASKED}
    asked = ask(a, b, instants=instants, floors=floors, period=scene.period, first_cycle=FIRST_CYCLE)
    return distances(asked)


def _bands(runs: Sequence[Table]) -> Array:
    x = np.array([table.values("slider_x") for table in runs])
    return np.asarray(np.quantile(x, (0.05, 0.5, 0.95), axis=0))


def figure(results: Results, folder: Path) -> None:
    """Draw the medians of both ensembles, and how far their runs scatter."""
    a, b = results.bands
    middle = 0.5 * float(a.max() + a.min())
    with svg.panels(folder / "slider_x.svg", 2, height=4.4, sharex=True) as (upper, lower):
        for bands, line, label in zip((a, b), svg.MODEL_LINES, ("reference", "exudyn"), strict=True):
            upper.plot(results.cycles, 1e3 * (bands[1] - middle), label=label, **line)
            width = np.maximum(bands[2] - bands[0], ROUND_OFF)  # zero has no logarithm
            lower.semilogy(results.cycles, 1e3 * width, **line)
        lower.axhline(1e3 * results.predictable, color=svg.LIMIT, dashes=(1, 2))
        upper.plot([], [], label="predictable below", color=svg.LIMIT, dashes=(1, 2))
        upper.set_ylabel("median of slider x (mm)")
        lower.set(xlabel="time (crank cycles)", ylabel="95 % − 5 % quantile (mm)")
        svg.legend_above(upper)


def page(results: Results) -> dict[str, object]:
    """Return what stands in the page."""
    main = results.tests[OTHERS.index(MODELS)]
    contacts = sorted((test for test in main if "contact" in test.quantity), key=lambda test: test.adjusted)
    found = sum(test.found for test in main)
    return {
        "members": results.members,
        "cycles": CYCLES,
        "scene": SCENE,
        "spread": f"{SPREAD:.0%}",
        "instants": INSTANTS,
        "rate": f"{RATE:.0%}",
        "answer": f"{found} of {len(main)} quantities differ between the two models."
        if found
        else "No difference between the two models was found.",
        "answers": rows_table(_answer(*each) for each in zip(OTHERS, results.tests, strict=True)),
        "contacts": rows_table(_contact(test) for test in contacts[:LISTED]),
    }


def _answer(of: Ensemble, tests: Sequence[Distance]) -> dict[str, str]:
    least = min(tests, key=lambda test: test.p)
    return {
        "ensembles": of.words,
        "expected": of.expected,
        "tests": str(len(tests)),
        f"unadjusted p <= {RATE:g}": str(sum(test.p <= RATE for test in tests)),
        "found": f"**{sum(test.found for test in tests)}**",
        "smallest adjusted p": f"{min(test.adjusted for test in tests):.2g}",
        "largest distance": f"{least.statistic:.2f} ({least.quantity}, {least.where})",
    }


def _contact(test: Distance) -> dict[str, str]:
    return {
        "quantity": test.quantity,
        "where": test.where,
        "largest distance of distributions": f"{test.statistic:.2f}",
        "Wasserstein distance": quantity(test.wasserstein, test.unit)
        if test.unit
        else number(test.wasserstein),
        "adjusted p": f"{test.adjusted:.2g}",
    }


STUDY = Study(
    "ensembles",
    small=3,  # runs in an ensemble
    full=64,
    measure=measure,
    page=page,
    draw=figure,
)
