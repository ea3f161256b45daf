"""Whether the press is chaotic: runs and exponents, the verdict on a scene, page and figures."""

from collections.abc import Mapping, Sequence
from math import nan
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from comparison.execution.run import Job, Progress, run_all, successful
from comparison.execution.tasks import measure_all, on_processes
from comparison.formatting import MISSING, prefix, quantity
from comparison.models import MODELS
from comparison.report import svg
from comparison.scene import Scene, load_scene
from comparison.studies.paper import exponents as methods
from comparison.studies.paper.exponents import (
    LEAST,
    LONGEST,
    TRANSIENT,
    Exponent,
    Key,
    chaos_indicator,
    recurrence,
    verdict,
)
from comparison.studies.shared.study import Quantities, Study, part, quantities, write_csv
from comparison.tables.channels import Array
from comparison.tables.table import Table

MAIN = "150rpm-0.2mm"
FORGETTING = "adams-impact"
"""Label of the main scene with a damping that refers to the speed of the moment."""
SPEED, CLEARANCE = "drive.speed_rpm", "clearance.slider"
USUAL = {"reference": 1e-12, "exudyn": 1e-10}  # tolerances of the models where only one is run
DISTANCES = {"reference": (1e-10, 1e-9, 1e-8, 1e-7, 1e-6), "exudyn": (1e-8, 1e-7)}
"""m, of perturbed runs from their orbit."""
NEAR = 0.01
"""Of the largest scatter over the angles: perturbed runs that start farther away are no neighbours."""
ANGLES = 40  # samples a cycle of a long run
SWEPT_CYCLES, SHOWN_CYCLES = 60, 40
"""Of a run with another speed or clearance, and of these the last that are drawn."""


class Config(NamedTuple):
    """What is run."""

    scenes: tuple[str, ...]  # the first is `MAIN`
    tolerances: Mapping[str, tuple[float, ...]]
    """Model -> those of the perturbed runs of the main scene; the reference's in all scenes."""
    cycles: Mapping[str, int]  # model -> cycles through which these are followed
    long: Mapping[str, int]
    long_main: Mapping[str, int]
    """Model -> cycles of a run for sections; of the main scene enough for the 0-1 test."""
    swept: Mapping[str, tuple[float, ...]]  # key of a scene -> its values in a bifurcation diagram


class Results(NamedTuple):
    """What was run, and what follows from it at once."""

    config: Config
    exponents: dict[Key, list[Exponent]]  # one a distance; none where they cannot be followed
    best: dict[Key, Exponent]  # of these the ones to believe
    sections: dict[tuple[str, str], Array]
    """(scene, model) -> states by cycle and angle, shape (cycles, angles, 4), without the first cycles."""
    scatter: dict[str, Array]
    """Scene -> how far its states scatter at each angle of the reference's long run, m, shape (angles,)."""
    swept: dict[str, dict[float, Array]]
    """Key -> value -> x over the clearance by cycle and angle, shape (cycles, angles); of successful runs."""


# ---- runs


def measure(config: Config, n_jobs: int, on_progress: Progress | None) -> Results:
    """Follow perturbed runs, and run the rest; every long run must succeed."""
    followed = [(name, "reference", tol) for name in config.scenes for tol in config.tolerances["reference"]]
    followed += [(MAIN, "exudyn", tol) for tol in config.tolerances["exudyn"]]
    followed += [(name, "exudyn", USUAL["exudyn"]) for name in config.scenes if name != MAIN]
    followed += [(FORGETTING, model, USUAL[model]) for model in MODELS]
    chains = [
        methods.Chain(_scene(*key, {}), key[1], config.cycles[key[1]], DISTANCES[key[1]]) for key in followed
    ]
    rows = measure_all(methods.measure, chains, on_processes(n_jobs), part(on_progress, 0.0, 0.5))
    by_distance = [[Exponent(*each) for each in row.get("exponents", [])] for row in rows]
    measured = dict(zip(followed, by_distance, strict=True))

    lengths = {
        name: config.long_main if name == MAIN else config.long for name in (*config.scenes, FORGETTING)
    }
    long = {
        (name, model): _sparse(name, model, USUAL[model], cycles[model], {})
        for name, cycles in lengths.items()
        for model in MODELS
    }
    varied = {
        (key, value): _sparse(MAIN, "reference", 1e-10, SWEPT_CYCLES, {key: value})
        for key, values in config.swept.items()
        for value in values
    }
    outcomes = run_all([*long.values(), *varied.values()], n_jobs, part(on_progress, 0.5, 1.0))
    tables = map(successful, outcomes[: len(long)], long.values())
    sections = {
        pair: _cycles(table, job.scene)[TRANSIENT:]
        for (pair, job), table in zip(long.items(), tables, strict=True)
    }
    scatter = {}
    for name in lengths:
        in_metres = sections[name, MODELS[0]] * methods.scale(long[name, MODELS[0]].scene)
        scatter[name] = np.asarray(np.linalg.norm(in_metres.std(axis=0), axis=1))
    diagrams: dict[str, dict[float, Array]] = {key: {} for key in config.swept}
    for ((key, value), job), outcome in zip(varied.items(), outcomes[len(long) :], strict=True):
        if outcome.table is not None:
            x = _cycles(outcome.table, job.scene)[-SHOWN_CYCLES:, :, 0]
            diagrams[key][value] = x / job.scene.data["clearance"]["slider"]
    best = believed(measured, {name: float(sizes.max()) for name, sizes in scatter.items()})
    return Results(config, measured, best, sections, scatter, diagrams)


def _scene(name: str, model: str, tolerance: float, values: Mapping[str, object]) -> Scene:
    """Return a scene at a tolerance of a model; Exudyn integrates the tree (rod 4 and slider)."""
    fixed: dict[str, object] = {f"solver.{model}.tolerance": tolerance, **values}
    if model == "exudyn":
        fixed["solver.exudyn.formulation"] = "tree"
    return load_scene(name, fixed)


def _sparse(name: str, model: str, tolerance: float, cycles: int, values: Mapping[str, object]) -> Job:
    """Return a run for sections."""
    fixed = {"drive.cycles": float(cycles), "output.groups": [], "output.samples_per_cycle": ANGLES}
    return Job(_scene(name, model, tolerance, {**values, **fixed}), model)


def _cycles(table: Table, scene: Scene) -> Array:
    return methods.by_cycle(methods.states(table, scene), scene)


# ---- exponents to believe


def believed(measured: Mapping[Key, Sequence[Exponent]], scatter: Mapping[str, float]) -> dict[Key, Exponent]:
    """Return the exponent to believe of each orbit that could be followed.

    Of the distances (each has one exponent) at which perturbed runs are neighbours, by the largest scatter of
    a scene's states (m), the smallest at which it is measured; where it is nowhere, the lowest bound.
    """
    best = {}
    for (name, model, tolerance), each in measured.items():
        pairs = zip(each, DISTANCES[model], strict=False)
        near = [e for e, distance in pairs if distance <= NEAR * scatter[name]] or each[:1]
        if near:
            lowest = min(near, key=lambda e: e.value)
            best[name, model, tolerance] = next((e for e in near if e.measured), lowest)
    return best


# ---- page

SECTION = 15  # the sample of a cycle, of `ANGLES`, that stands for the others: in the slider's chatter
SAME = 1e-3  # of the clearance: two states of a section this close are the same
SECTIONS: Quantities = {
    "scene": "scene",
    "K, reference": ("K, reference", "", 2),
    "K, exudyn": ("K, exudyn", "", 2),
    "section repeats after (cycles)": "repeats",
    "largest scatter": ("scatter_m", "m", 2),
    "least": ("least_scatter_m", "m", 2),
}
"""Columns of a table of the appendix."""
LATER = (0.78, 0.86, 0.0)
"""Of a cycle: at rest at the right wall, just after it has left it, at the next top dead centre."""


def page(results: Results) -> dict[str, object]:
    """Return what stands in the page."""
    config, best = results.config, results.best
    return {
        "config": config,
        "verdicts": pd.Series([verdict(best, name).value for name in config.scenes]).value_counts(),
        "answer": pd.DataFrame(answer(best, name) for name in config.scenes),
        "sections": quantities(_sections(results), SECTIONS),
        "forgetting": pd.DataFrame(_forgetting(results, name) for name in (MAIN, FORGETTING)),
        "longest": LONGEST,
        "shown": SHOWN_CYCLES,
        "swept": SWEPT_CYCLES,
    }


def answer(best: Mapping[Key, Exponent], name: str) -> dict[str, str]:
    """Return for a scene whether it is chaotic, its exponents, and how many runs measure them."""
    line = {"scene": name, "verdict": f"**{verdict(best, name).value}**"}
    for model in MODELS:
        runs = [e for key, e in best.items() if key[:2] == (name, model)]
        measured = sorted(e.value for e in runs if e.measured)
        ends = " … ".join(f"{value:.2f}" for value in dict.fromkeys(measured[:1] + measured[-1:]))
        bound = f"≤ {min(e.value for e in runs):.2f}" if runs else MISSING
        line[f"exponent, {model} (1/cycle)"] = ends or bound
        line[f"runs that measure it, {model}"] = f"{len(measured)} of {len(runs)}"
    return line


def _sections(results: Results) -> pd.DataFrame:
    """Return 0-1 test, recurrence and scatter of each scene."""
    rows = []
    for name in results.config.scenes:
        series = {model: results.sections[name, model][:, SECTION, 0] for model in MODELS}
        same = SAME * load_scene(name).data["clearance"]["slider"]
        rows.append(
            {"scene": name}
            | {f"K, {model}": chaos_indicator(x) if x.size >= LEAST else nan for model, x in series.items()}
            | {
                "repeats": recurrence(series[MODELS[0]], same) or "never",
                "scatter_m": results.scatter[name].max(),
                "least_scatter_m": results.scatter[name].min(),
            }
        )
    return pd.DataFrame(rows)


def _forgetting(results: Results, name: str) -> dict[str, str]:
    """Return exponents and scatter of a scene whose contacts remember their impact speed, or do not."""
    line = {"scene": name}
    for model in MODELS:
        line[f"exponent, {model}"] = MISSING
        if e := results.best.get((name, model, USUAL[model])):
            bound = "" if e.measured else "≤ "
            line[f"exponent, {model}"] = f"{bound}{e.value:.2f} ({e.low:.2f} … {e.high:.2f})"
    scatter = results.scatter[name]
    sizes = {f"scatter at {360 * angle:.0f}°": scatter[round(angle * ANGLES)] for angle in LATER}
    sizes["largest"] = scatter.max()
    return line | {where: quantity(float(size), "m", 2) for where, size in sizes.items()}


# ---- figures

COLOURS = dict(zip(MODELS, (svg.FIRST, svg.SECOND), strict=True))
DRAWN = (0, 7, 15, 34)  # samples of a cycle whose sections are drawn
MOST_POINTS = 200
DIAGRAMS = (
    (SPEED, "speed (rpm)", 1.0, 15),
    (SPEED, "speed (rpm)", 1.0, 36),
    (CLEARANCE, "clearance (mm)", 1e3, 15),
)
"""Key, label, factor and sample of a cycle of each bifurcation diagram: after the reversal the slider
chatters, before the top dead centre only at high speed."""
BINS = 400  # of a bifurcation diagram's height: cycles that fall into the same are one point


def draw(results: Results, folder: Path) -> None:
    """Write the figures, and exponents and sections as tables."""
    exponents = pd.DataFrame(
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
        for (name, model, tolerance), measured in results.exponents.items()
        for distance, e in zip(DISTANCES[model], measured, strict=False)
    )
    write_csv({"exponents": exponents, "sections": _sections(results)}, folder, "%.6g")
    _exponents(results, folder / "exponents.svg")
    with svg.panels(folder / "sections.svg", 2, 2, height=4.8) as panels:
        for axes, angle in zip(panels, DRAWN, strict=True):
            # x and its rate once a cycle, of both models, from the reference's median.
            reference = results.sections[MAIN, MODELS[0]][:, angle]
            middle, reach = np.median(reference, axis=0), np.ptp(reference, axis=0)
            factor, unit = prefix(max(0.3 * reach[0], 1e-9), "m")
            rate_factor, rate_unit = prefix(max(0.3 * reach[2], 1e-9), "m/s")
            for model, marker in zip(MODELS, "ox", strict=True):
                x, _, rate, _ = (results.sections[MAIN, model][:MOST_POINTS, angle] - middle).T
                look: Any = {
                    "color": COLOURS[model],
                    "ms": 2.6,
                    "mew": 0.6,
                    "label": model,
                    "fillstyle": "none",
                }
                axes.plot(x / factor, rate / rate_factor, marker, **look)
            axes.margins(0.06)
            axes.locator_params(nbins=5)
            axes.ticklabel_format(style="plain", useOffset=False)
            axes.set_title(f"{360 * angle / ANGLES:.0f}° after the start", fontsize=9)
            axes.set(xlabel=f"slider x ({unit})", ylabel=f"velocity of x ({rate_unit})")
        svg.legend_above(panels[0])
    with svg.panels(folder / "bifurcation.svg", len(DIAGRAMS), height=6.4) as panels:
        for axes, (key, label, factor, angle) in zip(panels, DIAGRAMS, strict=True):
            points = [
                (factor * value, y / BINS)
                for value, x in results.swept[key].items()
                for y in np.unique(np.round(x[:, angle] * BINS))
            ]
            at, y = np.array(points).reshape(-1, 2).T
            # Very short dashes with round ends are dots, in one path: a tenth of the bytes of markers.
            gap, ends = np.full(at.size, np.nan), at + 1e-4 * np.ptp(at) if at.size else at
            line = np.column_stack([at, ends, gap]).ravel(), np.column_stack([y, y, gap]).ravel()
            axes.plot(*line, color=svg.FIRST, lw=1.5, solid_capstyle="round")
            axes.margins(x=0.02)
            axes.set_title(f"{360 * angle / ANGLES:.0f}° after the start", fontsize=9)
            axes.set(xlabel=label, ylabel="slider x / clearance (-)")


def _exponents(results: Results, path: Path) -> None:
    """Draw the exponents to believe with their intervals; hollow: an upper bound."""
    names = results.config.scenes
    with svg.panels(path, height=0.42 * len(names) + 1.0) as (axes,):
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


_FEW_CYCLES = {"reference": 112, "exudyn": 14}
STUDY = Study(
    "nonlinear",
    small=Config(
        scenes=(MAIN, "300rpm-0.2mm"),
        tolerances={"reference": (1e-10, 1e-12), "exudyn": (1e-10,)},
        cycles={"reference": 3, "exudyn": 2},
        long=_FEW_CYCLES,
        long_main=_FEW_CYCLES,
        swept={SPEED: (100.0, 200.0), CLEARANCE: (1e-4, 2e-4)},
    ),
    full=Config(
        scenes=(MAIN, "300rpm-0.2mm", "69GPa", "poisson-0.33", "90rpm-0.1mm", "90rpm-0.5mm"),
        tolerances={"reference": (1e-9, 1e-10, 1e-11, 1e-12), "exudyn": (1e-8, 1e-9, 1e-10, 1e-11)},
        cycles={"reference": 40, "exudyn": 8},
        long={"reference": 600, "exudyn": 60},
        long_main={"reference": 600, "exudyn": 110},
        swept={
            SPEED: tuple(float(speed) for speed in range(60, 401, 2)),
            CLEARANCE: tuple(round(5e-6 * k, 6) for k in range(12, 121)),
        },
    ),
    measure=measure,
    page=page,
    draw=draw,
    part_of="paper",
)
