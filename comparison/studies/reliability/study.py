"""The reliability of the paper's cases by both models, over the paper's two cycles and over more."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.ticker import NullLocator

from comparison.accuracy.levels import refinement, thresholds
from comparison.accuracy.refine import levels
from comparison.accuracy.uncertainty import Runs
from comparison.execution.run import Job, Progress, run_all, successful
from comparison.formatting import quantity
from comparison.models import MODELS
from comparison.reliability.assessment import ROUNDING, cap
from comparison.reliability.averages import integrals
from comparison.reliability.difference import (
    MARGIN,
    Difference,
    compare_reliability,
    dense_scene,
    ideal_scenes,
)
from comparison.reliability.errors import QUANTITIES, slider_errors, unit_of
from comparison.report import svg
from comparison.report.figures import against_angle
from comparison.scene import Scene, load_scene
from comparison.studies.shared.frames import crossed, write_csv
from comparison.studies.shared.scenes import at_tier
from comparison.studies.shared.study import Study
from comparison.tables.table import Table
from comparison.words.reliability import rounded

LEFT_OUT = 1
"""Cycles at the start of a long run, which still depend on the initial position of the slider."""
PAPER = 2
"""Cycles of the paper's figures and of the shipped scenes."""
LEAST = 1e-12
"""Of a reliability: what a logarithmic axis shows of less."""


@dataclass(frozen=True)
class Config:
    """Scenes, cycles of each long run, and samples a cycle of a scene."""

    cases: tuple[str, ...]
    cycles: int
    samples: int


@dataclass(frozen=True)
class Results:
    """Both models' reliabilities by scene and quantity, and what `repeating` returns for the reference.

    ``paper``: over two cycles; ``long``: over the later ones of the long runs.
    """

    config: Config
    scenes: dict[str, Scene]
    paper: dict[str, dict[str, Difference]]
    long: dict[str, dict[str, Difference]]
    repeating: dict[str, dict[str, float]]


def measure(config: Config, n_jobs: int, on_progress: Progress | None) -> Results:
    """Run the cases and the ideal mechanism by both models; `RunError` if one does not succeed."""
    scenes = {
        (name, cycles): at_tier(
            load_scene(name, {"drive.cycles": float(cycles), "output.samples_per_cycle": config.samples}),
            "tight",
        )
        for name in config.cases
        for cycles in (PAPER, config.cycles)
    }
    jobs = {
        (which, model, motion, level): Job(variant, model)
        for which, scene in scenes.items()
        for model in MODELS
        for motion, variants in (
            ("actual", levels(dense_scene(scene), model)),
            ("ideal", ideal_scenes(scene, model)),
        )
        for level, variant in variants.items()
    }
    outcomes = run_all(list(jobs.values()), n_jobs, on_progress)
    tables = {
        key: successful(outcome, job) for (key, job), outcome in zip(jobs.items(), outcomes, strict=True)
    }

    def side(which: tuple[str, int], model: str, motion: str) -> Runs:
        runs = {key[3]: run for key, run in tables.items() if key[:3] == (which, model, motion)}
        return Runs(refinement=refinement(model, scenes[which]), **runs)

    def compared(which: tuple[str, int], left_out: int) -> dict[str, Difference]:
        scene, (a, b) = scenes[which], MODELS
        actual = side(which, a, "actual"), side(which, b, "actual")
        ideal = side(which, a, "ideal"), side(which, b, "ideal")
        k, start = thresholds("tight").k, left_out * scene.period
        return compare_reliability(actual, ideal, scene.period, scene.reliability, k, start)

    long = {name: (name, config.cycles) for name in config.cases}
    return Results(
        config,
        {name: scenes[which] for name, which in long.items()},
        {name: compared((name, PAPER), 0) for name in config.cases},
        {name: compared(which, LEFT_OUT) for name, which in long.items()},
        {
            name: repeating(
                tables[which, MODELS[0], "actual", "base"],
                tables[which, MODELS[0], "ideal", "base"],
                scenes[which].period,
            )
            for name, which in long.items()
        },
    )


def repeating(run: Table, ideal: Table, period: float) -> dict[str, float]:
    """Return by quantity the share of the error's variance that its average over the cycles has.

    Of the averages over hundredths of a cycle.
    """
    errors = slider_errors(run, ideal, period, start=LEFT_OUT * period)
    cycles = round(errors.time[-1] / period)
    edges = period * np.arange(100 * cycles + 1) / 100
    shares = {}
    for name, channel in QUANTITIES.items():
        by_cycle = integrals(errors.time, errors.by_channel[channel], edges).reshape(cycles, -1)
        total = by_cycle.var()
        shares[name] = float(by_cycle.mean(0).var() / total) if total > 0 else float("nan")
    return shares


# ---- page


def differences(by_scene: dict[str, dict[str, Difference]]) -> pd.DataFrame:
    """Return a row for each scene and quantity: both smallest reliabilities, their difference, its error."""
    rows = []
    for scene, quantities in by_scene.items():
        for name, each in quantities.items():
            row: dict[str, Any] = {"scene": scene, "quantity": name}
            for model, side in zip(MODELS, (each.a, each.b), strict=True):
                row |= {f"{model}_smallest": side.minimum, f"{model}_at_deg": side.angle[side.worst]}
            rows.append(
                row
                | {"difference": each.minimum, "half_width": each.half_width, "other_cycles": each.sampling}
                | {"numerics": each.numerical, "quadrature": each.quadrature, "verdict": each.verdict}
            )
    return pd.DataFrame(rows)


def one_model(results: Results) -> pd.DataFrame:
    """Return what the reference's reliability means: a row for each scene and quantity."""
    rows = []
    for scene, quantities in results.long.items():
        for name, side in ((name, each.a) for name, each in quantities.items()):
            least = int(side.within.argmin())
            rows.append(
                {"scene": scene, "quantity": name, "unit": unit_of(name), "smallest_R": side.minimum}
                | dict(zip(("R_low", "R_high"), side.interval, strict=True))
                | {"parts_at_cap": int(side.capped.sum()), "parts": side.capped.size}
                | {"smallest_P": side.within[least], "P_low": side.within_low[least]}
                | {"P_high": side.within_high[least], "largest_mean": side.mean.max()}
                | {"largest_deviation": side.deviation.max(), "repeats": results.repeating[scene][name]}
            )
    return pd.DataFrame(rows)


def page(results: Results) -> dict[str, object]:
    """Return what the template asks."""
    long, settings = differences(results.long), next(iter(results.scenes.values())).reliability
    return {
        "config": results.config,
        "long": long,
        "verdicts": {name: int((long["verdict"] == name).sum()) for name in ("agree", "undecided", "differ")},
        "settings": settings,
        "limits": ", ".join(
            f"{name} {quantity(getattr(settings, name).upper, unit_of(name))}" for name in QUANTITIES
        ),
        "cap": f"{cap(settings.displacement):.10f}",
        "rounding": f"{ROUNDING:g}",
        "margin": f"{MARGIN:g}",
        "smallest": _by_quantity(long),
        "two": _by_quantity(differences(results.paper)),
        "alone": one_model(results),
        "figures": {picture(name): scene.title for name, scene in results.scenes.items()},
    }


def _by_quantity(rows: pd.DataFrame) -> str:
    """Return both models' smallest reliabilities, once where they round to the same, with the verdicts."""
    cells = []
    for _, row in rows.iterrows():
        both = dict.fromkeys(rounded(row[f"{model}_smallest"]) for model in MODELS)
        verdict = row["verdict"] if row["verdict"] == "agree" else f"**{row['verdict']}**"
        cells.append(f"{' and '.join(both)}, {verdict}")
    return crossed("scene", list(rows["scene"]), list(rows["quantity"]), cells)


# ---- figures


def picture(name: str) -> str:
    """Return the name of a scene's figure."""
    return f"{name.replace('.', '_')}.svg"


def draw(results: Results, folder: Path) -> None:
    """Draw differences, and the reliabilities against the crank angle; write the tables as CSV."""
    long = differences(results.long)
    _differences(long, folder / "differences.svg")
    with svg.style():
        for name, quantities in results.long.items():
            svg.write_svg(against_angle(quantities, MODELS), folder / picture(name))
    frames = {"differences": long, "two-cycles": differences(results.paper), "one-model": one_model(results)}
    write_csv(frames, folder)


def _differences(rows: pd.DataFrame, path: Path) -> None:
    """Draw the models' differences with their half-widths against the margin: a panel a quantity."""
    scenes = list(dict.fromkeys(rows["scene"]))
    with svg.panels(
        path, 1, len(QUANTITIES), height=1.4 + 0.2 * len(scenes), sharex=True, sharey=True
    ) as axes:
        for panel, name in zip(axes, QUANTITIES, strict=True):
            shown = rows[rows["quantity"] == name]
            place = shown["scene"].map(scenes.index)
            size, width = shown["difference"].abs().clip(LEAST), shown["half_width"].clip(LEAST)
            panel.hlines(place, LEAST, width, color=svg.SHADE, lw=5, label="± half-width")
            panel.plot(size, place, "o", color=svg.SERIES[0], ms=4, label="|difference| of the smallest R")
            panel.axvline(MARGIN, color=svg.LIMIT, dashes=(1, 2), label=f"margin {MARGIN:g}")
            panel.set(
                xscale="log", xlim=(LEAST, 1.0), ylim=(len(scenes) - 0.5, -0.5), xticks=[1e-10, 1e-5, 1]
            )
            panel.xaxis.set_minor_locator(NullLocator())
            panel.set_xlabel("difference of R (-)")
            panel.set_title(name, fontsize=9)
        axes[0].set_yticks(range(len(scenes)), scenes)
        svg.legend_above(axes[0])


CASES = ("150rpm-0.2mm", "69GPa", "poisson-0.33", "90rpm-0.1mm", "90rpm-0.5mm", "300rpm-0.2mm", "crank-pin")
STUDY = Study(
    "reliability",
    small=Config(cases=("150rpm-0.2mm", "crank-pin"), cycles=3, samples=100),
    full=Config(cases=CASES, cycles=11, samples=1000),
    measure=measure,
    page=page,
    draw=draw,
)
