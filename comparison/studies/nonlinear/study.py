"""Whether the press is chaotic."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from comparison.execution.run import Outcome, Progress, run_all, successful
from comparison.execution.tasks import measure_all, on_processes
from comparison.formatting import quantity
from comparison.models import MODELS
from comparison.scene import Scene
from comparison.studies.nonlinear import chains, figures, scenes, tables
from comparison.studies.nonlinear.chains import SAMPLES, TRANSIENT
from comparison.studies.nonlinear.chaos import believed
from comparison.studies.nonlinear.controls import controls
from comparison.studies.nonlinear.memory import remembered
from comparison.studies.nonlinear.methods.lyapunov import Exponent, exponents
from comparison.studies.nonlinear.methods.perturbed_orbits import PerturbedOrbits
from comparison.studies.nonlinear.press import by_cycle, spread, states
from comparison.studies.nonlinear.scenes import (
    CLEARANCE,
    DISTANCES,
    MAIN,
    SPEED,
    USUAL,
    Config,
    Key,
)
from comparison.studies.shared.study import Study, part
from comparison.tables.arrays import Array
from comparison.tables.table import Table


@dataclass(frozen=True)
class Results:
    """What was run, and what follows from it at once."""

    config: Config
    perturbed: dict[Key, PerturbedOrbits | None]
    exponents: dict[Key, list[Exponent]]
    """Perturbed runs, None where they cannot be followed, and their exponents, one a distance."""
    best: dict[Key, Exponent]
    """Of these exponents the ones to believe, by which `comparison.studies.nonlinear.chaos` judges."""
    scatter: dict[str, Array]
    """Scene -> how far its states scatter at each angle of the reference's long run, m, shape (angles,)."""
    runs: dict[tuple[str, str], Table]
    """(scene, model) -> its long run."""
    long: dict[tuple[str, str], Scene]
    """(scene, model) -> the scene of that run."""
    sections: dict[tuple[str, str], Array]
    """(scene, model) -> states by cycle and angle, shape (cycles, angles, 4), without the first cycles."""
    swept: dict[tuple[str, float], Outcome]
    """(key, value) -> run of the main scene with this value."""


def measure(config: Config, n_jobs: int, on_progress: Progress | None) -> Results:
    """Follow perturbed runs, and run the rest.

    Raises
    ------
    RunError
        If a long run does not succeed.
    """
    asked = scenes.chains(config)
    half, rest = part(on_progress, 0.0, 0.5), part(on_progress, 0.5, 1.0)
    rows = measure_all(chains.measure, list(asked.values()), on_processes(n_jobs), half)
    perturbed = {key: chains.perturbed_orbits_of(row) for key, row in zip(asked, rows, strict=True)}
    long, swept = scenes.long_runs(config), scenes.swept(config)
    outcomes = run_all([*long.values(), *swept.values()], n_jobs, rest)
    runs = {key: successful(of, job) for (key, job), of in zip(long.items(), outcomes, strict=False)}
    of_long = {key: job.scene for key, job in long.items()}
    found = {key: [] if of is None else exponents(of, SAMPLES, skip=1) for key, of in perturbed.items()}
    sections = {
        key: by_cycle(states(run, of_long[key]), of_long[key])[TRANSIENT:] for key, run in runs.items()
    }
    scatter = {
        name: spread(of, of_long[name, model]) for (name, model), of in sections.items() if model == MODELS[0]
    }
    return Results(
        config,
        perturbed,
        found,
        believed(found, {name: float(of.max()) for name, of in scatter.items()}),
        scatter,
        runs,
        of_long,
        sections,
        dict(zip(swept, outcomes[len(long) :], strict=True)),
    )


def page(results: Results) -> dict[str, object]:
    """Return what stands in the page."""
    config, main = results.config, (MAIN, "reference")
    orbit = results.perturbed[*main, USUAL["reference"]]
    best, scatter = results.best, results.scatter
    return {
        "finding": tables.finding(best, config.scenes),
        "answer": tables.answer(best, config.scenes),
        "controls": controls(config.periods),
        "main": tables.by_distance(results.exponents),
        "scenes": tables.by_scene(
            best, results.sections, results.long, {name: scatter[name] for name in config.scenes}
        ),
        "forgetting": tables.forgetting(best, scatter),
        "without_memory": tables.without_memory(best, scatter),
        "memory": tables.memory(remembered(results.runs[main], results.long[main], TRANSIENT)),
        "distributions": tables.distributions(results.sections, results.long, config.scenes),
        "noise": quantity(float("nan") if orbit is None else float(np.median(orbit.noise)), "m", 2),
        "cycles": config.cycles["reference"],
        "exudyn_cycles": config.cycles["exudyn"],
        "long": config.long_main["reference"],
        "long_exudyn": config.long_main["exudyn"],
    }


def draw(results: Results, folder: Path) -> None:
    """Draw sections, bifurcation diagrams, exponents and growth."""
    reference, exudyn = (results.sections[MAIN, model] for model in MODELS)
    figures.draw_sections(reference, exudyn, folder / "sections.svg")
    figures.draw_bifurcation(results.swept, scenes.swept(results.config), folder / "bifurcation.svg")
    coarsest = results.config.tolerances["reference"][0]
    shown = {
        f"{model}, {tol:.0e}": (DISTANCES[model], of)
        for (name, model, tol), of in results.exponents.items()
        if of and name == MAIN and (tol == USUAL["exudyn"] if model == "exudyn" else tol != coarsest)
    }
    figures.draw_exponents(shown, folder / "exponents.svg")
    orbit = results.perturbed[MAIN, "reference", USUAL["reference"]]
    figures.draw_growth(results.scatter[MAIN], orbit, folder / "growth.svg")


STUDY = Study(
    "nonlinear",
    small=Config(
        scenes=(MAIN, "300rpm-0.2mm"),
        tolerances={"reference": (1e-10, 1e-12), "exudyn": (1e-10,)},
        cycles={"reference": 3, "exudyn": 2},
        long={"reference": 112, "exudyn": 14},
        long_main={"reference": 112, "exudyn": 14},
        swept={SPEED: (100.0, 200.0), CLEARANCE: (1e-4, 2e-4)},
        periods=110,
    ),
    full=Config(
        scenes=(MAIN, "300rpm-0.2mm", "69GPa", "poisson-0.33", "90rpm-0.1mm", "90rpm-0.5mm"),
        tolerances={"reference": (1e-9, 1e-10, 1e-11, 1e-12), "exudyn": (1e-8, 1e-9, 1e-10, 1e-11)},
        cycles={"reference": 40, "exudyn": 8},
        long={"reference": 600, "exudyn": 60},
        long_main={"reference": 600, "exudyn": 110},
        swept={
            SPEED: tuple(float(speed) for speed in range(60, 401, 10)),
            CLEARANCE: tuple(round(1e-5 * k, 6) for k in range(6, 61, 2)),
        },
        periods=1000,
    ),
    measure=measure,
    page=page,
    draw=draw,
)
