"""What the study nonlinear runs and draws."""

from __future__ import annotations

from itertools import islice
from pathlib import Path

import numpy as np

from comparison.execution.run import Job, Outcome, Progress, run_all, successful
from comparison.files import replacing
from comparison.formatting import quantity
from comparison.studies.nonlinear import scenes
from comparison.studies.nonlinear.chains import SAMPLES, TRANSIENT, followed, twins_of
from comparison.studies.nonlinear.figures import draw_bifurcation, draw_exponents, draw_growth, draw_sections
from comparison.studies.nonlinear.methods.lyapunov import exponents
from comparison.studies.nonlinear.methods.twins import Twins
from comparison.studies.nonlinear.press import by_turn, spread, states
from comparison.studies.nonlinear.tables import Found, text
from comparison.studies.shared.progress import part
from comparison.tables.arrays import Array
from comparison.tables.table import Table

DRAWN = (0, 7, 15, 34)
"""Samples of a turn whose sections are drawn."""
SHOWN_TURNS = 40
"""Of a run with another parameter; those before are left out."""
STRETCHES = 20
PARAMETERS = (("drive.speed_rpm", "speed (rpm)", 1.0), ("clearance.slider", "clearance (mm)", 1e3))
"""Key, label and factor of what a bifurcation diagram shows."""


def write(folder: Path, n_jobs: int, on_progress: Progress | None) -> None:
    """Run all, and write README.md and figures."""
    chains = scenes.chains()
    half, rest = part(on_progress, 0.0, 0.5), part(on_progress, 0.5, 1.0)
    rows = followed(list(chains.values()), n_jobs, half)
    twins = {key: twins_of(row, chains[key]) for key, row in zip(chains, rows, strict=True)}
    found: Found = {key: [] if of is None else exponents(of, SAMPLES, skip=1) for key, of in twins.items()}
    which = [(name, model) for name in scenes.SCENES for model in scenes.LONG]
    jobs = {key: scenes.long_run(*key) for key in which}
    varied = {
        key: [scenes.bifurcation(key, value) for value in values]
        for (key, _, _), values in zip(PARAMETERS, (scenes.SPEEDS, scenes.CLEARANCES), strict=True)
    }
    every = [*jobs.values(), *(job for of in varied.values() for job in of)]
    outcomes = iter(run_all(every, n_jobs, rest))
    runs = {key: successful(next(outcomes), job) for key, job in jobs.items()}
    sections = {key: _section(runs[key], jobs[key]) for key in which}
    swept = {key: list(islice(outcomes, len(of))) for key, of in varied.items()}
    _draw(folder, twins, found, sections, varied, swept)
    main = (scenes.MAIN, "reference")
    with replacing(folder / "README.md") as file:
        file.write_text(text(found, twins, sections, runs[main], jobs[main]), "utf-8")


def _section(run: Table, job: Job) -> Array:
    """Return the states by turn and angle, shape (turns, angles, 4), without the first turns."""
    return by_turn(states(run, job.scene), job.scene)[TRANSIENT:]


def _draw(
    folder: Path,
    twins: dict[tuple[str, str, float], Twins | None],
    found: Found,
    sections: dict[tuple[str, str], Array],
    varied: dict[str, list[Job]],
    swept: dict[str, list[Outcome]],
) -> None:
    a, b = (sections[scenes.MAIN, model] for model in ("reference", "exudyn"))
    draw_sections(a, b, DRAWN, scenes.ANGLES, folder / "sections.svg")
    panels = []
    for key, label, unit in PARAMETERS:
        section, values = key.split(".")
        parameter, points = [], []
        for job, outcome in zip(varied[key], swept[key], strict=True):
            if outcome.table is not None:
                x = by_turn(states(outcome.table, job.scene), job.scene)[-SHOWN_TURNS:, :, 0]
                parameter.append(unit * job.scene.data[section][values])
                points.append(x[:, np.argmax(x.std(axis=0))] / job.scene.data["clearance"]["slider"])
        panels.append((label, "x / clearance", np.array(parameter), np.array(points)))
    draw_bifurcation(panels, folder / "bifurcation.svg")
    exponents_of = {
        f"{model}, {tolerance:.0e}": (scenes.DISTANCES[model], found[scenes.MAIN, model, tolerance])
        for model, tolerance in (
            *(("reference", t) for t in scenes.TOLERANCES["reference"][1:]),
            ("exudyn", scenes.USUAL["exudyn"]),
        )
        if found[scenes.MAIN, model, tolerance]
    }
    draw_exponents(exponents_of, folder / "exponents.svg")
    growth = {
        f"twins at {quantity(scenes.DISTANCES['reference'][k], 'm')}": _growth(of, k)
        for k in (1, 2, 3)
        if (of := twins[scenes.MAIN, "reference", scenes.USUAL["reference"]]) is not None
    }
    scene = scenes.long_run(scenes.MAIN, "reference").scene
    draw_growth(
        np.arange(scenes.ANGLES) / scenes.ANGLES,
        spread(a, scene),
        np.arange(STRETCHES + 1) / STRETCHES,
        growth,
        folder / "growth.svg",
    )


def _growth(twins: Twins, which: int) -> Array:
    """Return the mean logarithm of the growth from the start angle to the end of each stretch of a turn."""
    begins = twins.times[:, 0] % SAMPLES
    length = twins.times[:, 1] - twins.times[:, 0]
    turns = max(1, round(float(np.sum(length)) / SAMPLES))
    total = np.zeros(STRETCHES)
    per_sample = twins.logs[which] / length
    samples = SAMPLES // STRETCHES
    for begin, log_rate, count in zip(begins, per_sample, length, strict=True):
        stretches = ((begin + np.arange(count)) % SAMPLES) // samples
        total += log_rate * np.bincount(stretches, minlength=STRETCHES)
    return np.asarray(np.cumsum(total / turns))
