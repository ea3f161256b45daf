"""Chaos of the press: exponents of both models at several tolerances."""

from collections.abc import Mapping, Sequence
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from comparison.execution.run import Job, Progress, run_all, table_of
from comparison.execution.tasks import measure_all, on_processes
from comparison.formatting import MISSING, quantity
from comparison.models import MODELS
from comparison.report import svg
from comparison.scene import Scene, load_scene
from comparison.studies.paper import exponents
from comparison.studies.paper.exponents import TRANSIENT, Exponent, Key, verdict
from comparison.studies.paper.figures import COLOURS
from comparison.studies.shared.study import Study, part, write_csv

MAIN = "150rpm-0.2mm"
ADAMS = "adams-impact"
"""The main scene with a damping that does not depend on the speed of a contact's first touch."""
TOLERANCE = {"reference": 1e-12, "exudyn": 1e-10}  # tolerances of the models where only one is run
DISTANCES = {"reference": (1e-10, 1e-9, 1e-8, 1e-7, 1e-6), "exudyn": (1e-8, 1e-7)}
"""m, of perturbed runs from their orbit."""
NEIGHBOURHOOD = 0.01
"""Of the largest scatter over the angles: perturbed runs that start farther away are no neighbours."""
SHIPPED = ""
VALUES: dict[str, dict[str, object]] = {
    SHIPPED: {},
    " without gravity": {"environment.gravity": 0.0},
    " at a corner radius of 4 mm": {"contact.corner_radius": 4e-3},
}
"""Values that the paper does not print in place of the shipped ones: gravity, an end of a drawn range."""
ANGLES = 40  # samples a cycle of a long run
REPETITION = 1e-6  # m of scatter below which the motion repeats: a hundredth of the narrowest clearance


class Config(NamedTuple):
    """Extent of the runs."""

    scenes: tuple[str, ...]  # the first is `MAIN`
    tolerances: Mapping[str, tuple[float, ...]]
    """Model -> those of the perturbed runs of the main scene; the reference's in all scenes."""
    cycles: Mapping[str, int]  # model -> cycles through which these are followed
    long: int  # cycles of a run of the reference that shows the scatter of the states


class Results(NamedTuple):
    """Exponents of all runs, and the largest scatter of each scene's states, m, by `VALUES`."""

    config: Config
    runs: dict[Key, list[Exponent]]  # one a distance; none where they cannot be followed
    best: dict[Key, Exponent]  # of these the ones to believe
    scatter: dict[str, dict[str, float]]


def measure(config: Config, n_jobs: int, on_progress: Progress | None) -> Results:
    """Follow perturbed runs and run the long ones, each of which must succeed."""
    names = (*config.scenes, ADAMS)
    keys = [(name, "reference", tol) for name in config.scenes for tol in config.tolerances["reference"]]
    keys += [(MAIN, "exudyn", tol) for tol in config.tolerances["exudyn"]]
    keys += [(name, "exudyn", TOLERANCE["exudyn"]) for name in config.scenes if name != MAIN]
    keys += [(ADAMS, model, TOLERANCE[model]) for model in MODELS]
    chains = [exponents.Chain(_scene(*key), key[1], config.cycles[key[1]], DISTANCES[key[1]]) for key in keys]
    rows = measure_all(exponents.measure, chains, on_processes(n_jobs), part(on_progress, 0.0, 0.7))
    by_distance = [[Exponent(*each) for each in row.get("exponents", [])] for row in rows]
    runs = dict(zip(keys, by_distance, strict=True))
    sampling = {"output.groups": [], "output.samples_per_cycle": ANGLES, "drive.cycles": float(config.long)}
    pairs = list(product(VALUES, names))
    scenes = [_scene(name, "reference", TOLERANCE["reference"]).with_values(VALUES[of]) for of, name in pairs]
    jobs = [Job(scene.with_values(sampling), "reference") for scene in scenes]
    scatter: dict[str, dict[str, float]] = {of: {} for of in VALUES}
    outcomes = run_all(jobs, n_jobs, part(on_progress, 0.7, 1.0))
    for (of, name), job, outcome in zip(pairs, jobs, outcomes, strict=True):
        states = exponents.states(table_of(outcome, job), job.scene) * exponents.scale(job.scene)
        later = exponents.by_cycle(states, job.scene)[TRANSIENT:]
        scatter[of][name] = float(np.linalg.norm(later.std(axis=0), axis=1).max())
    return Results(config, runs, choose(runs, scatter[SHIPPED]), scatter)


def _scene(name: str, model: str, tolerance: float) -> Scene:
    """Return a scene at a tolerance of a model; Exudyn integrates the tree (rod 4 and slider)."""
    values: dict[str, object] = {f"solver.{model}.tolerance": tolerance}
    if model == "exudyn":
        values["solver.exudyn.formulation"] = "tree"
    return load_scene(name, values)


def choose(runs: Mapping[Key, Sequence[Exponent]], scatter: Mapping[str, float]) -> dict[Key, Exponent]:
    """Return the exponent to believe of each orbit that could be followed.

    Of the distances (each has one exponent) at which perturbed runs are neighbours, by the largest scatter of
    a scene's states (m), the smallest at which it is measured; where it is nowhere, the lowest bound.
    """
    best = {}
    for (name, model, tolerance), each in runs.items():
        pairs = zip(each, DISTANCES[model], strict=False)
        neighbours = [e for e, distance in pairs if distance <= NEIGHBOURHOOD * scatter[name]] or each[:1]
        if neighbours:
            lowest = min(neighbours, key=lambda e: e.value)
            best[name, model, tolerance] = next((e for e in neighbours if e.measured), lowest)
    return best


def frame(results: Results) -> pd.DataFrame:
    """Return a row for each run and distance."""
    return pd.DataFrame(
        {
            "scene": name,
            "model": model,
            "tolerance": tolerance,
            "distance_m": distance,
            "exponent_per_cycle": e.value,
            "low": e.low,
            "high": e.high,
            "share_collapsed": e.collapsed,
            "upper_bound": not e.measured,
            "believed": e == results.best[name, model, tolerance],
        }
        for (name, model, tolerance), by_distance in results.runs.items()
        for distance, e in zip(DISTANCES[model], by_distance, strict=False)
    )


# ---- page and figure


def page(results: Results) -> dict[str, object]:
    """Return the variables of the template."""
    config, best = results.config, results.best
    return {
        "config": config,
        "verdicts": pd.Series([verdict(best, name).value for name in config.scenes]).value_counts(),
        "answer": pd.DataFrame(
            answer(best, name)
            | {f"scatter{of}": quantity(sizes[name], "m", 2) for of, sizes in results.scatter.items()}
            for name in (*config.scenes, ADAMS)
        ),
        "angles": ANGLES,
        "repeating": {
            of: [name for name in config.scenes if results.scatter[of][name] < REPETITION] for of in VALUES
        },
        "repeated": REPETITION,
    }


def answer(best: Mapping[Key, Exponent], name: str) -> dict[str, str]:
    """Return a scene's verdict on chaos, its exponents, and the number of runs that measure them."""
    line = {"scene": name, "verdict": f"**{verdict(best, name).value}**"}
    for model in MODELS:
        runs = [e for key, e in best.items() if key[:2] == (name, model)]
        cells = []
        for mark in ("", "≤ "):
            values = sorted(e.value for e in runs if e.measured != bool(mark))
            ends = dict.fromkeys(f"{value:.2f}" for value in values[:1] + values[-1:])
            cells += [mark + " … ".join(ends)] if ends else []
        line[f"exponent, {model} (1/cycle)"] = "; ".join(cells) or MISSING
        line[f"runs that measure it, {model}"] = f"{sum(e.measured for e in runs)} of {len(runs)}"
    return line


def draw(results: Results, folder: Path) -> None:
    """Draw the exponents to believe with their intervals (hollow: an upper bound); write all as a table."""
    write_csv({"exponents": frame(results)}, folder, "%.6g")
    names = (*results.config.scenes, ADAMS)
    with svg.panels(folder / "exponents.svg", height=0.42 * len(names) + 1.0) as (axes,):
        for row, name in enumerate(names):
            runs = [(model, e) for (scene, model, _), e in results.best.items() if scene == name]
            for n, (model, e) in enumerate(runs):
                at, bars = row + 0.12 * (n - 0.5 * (len(runs) - 1)), [[e.value - e.low], [e.high - e.value]]
                look: Any = {"color": COLOURS[model], "mfc": None if e.measured else "none"}
                axes.errorbar(e.value, at, xerr=bars, fmt="o", ms=4, lw=0.9, capsize=1.5, **look)
        for model, colour in COLOURS.items():
            axes.plot([], [], "o", ms=4, color=colour, label=model)
        axes.plot([], [], "o", ms=4, color=svg.INK, mfc="none", label="upper bound")
        axes.axvline(0.0, color=svg.LIMIT, lw=0.8)
        axes.set_yticks(range(len(names)), names)
        axes.invert_yaxis()
        axes.set(xlabel="largest Lyapunov exponent (1/cycle)", ylabel="scene")
        svg.legend_above(axes)


STUDY = Study(
    "nonlinear",
    small=Config(
        scenes=(MAIN, "300rpm-0.2mm"),
        tolerances={"reference": (1e-10, 1e-12), "exudyn": (1e-10,)},
        cycles={"reference": 3, "exudyn": 2},
        long=112,
    ),
    full=Config(
        scenes=(MAIN, "300rpm-0.2mm", "69GPa", "poisson-0.33", "90rpm-0.1mm", "90rpm-0.5mm"),
        tolerances={"reference": (1e-9, 1e-10, 1e-11, 1e-12), "exudyn": (1e-8, 1e-9, 1e-10, 1e-11)},
        cycles={"reference": 40, "exudyn": 8},
        long=600,
    ),
    measure=measure,
    page=page,
    draw=draw,
    part_of="paper",
)
