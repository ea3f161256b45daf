"""The reliability of the paper's cases by both models, over the paper's two cycles and over more."""

from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from matplotlib.ticker import NullLocator

from comparison.accuracy.levels import refinement, thresholds
from comparison.accuracy.refine import levels
from comparison.accuracy.uncertainty import Runs
from comparison.execution.run import Job, Progress, run_all, successful
from comparison.formatting import quantity
from comparison.models import MODELS
from comparison.reliability.assessment import (
    MARGIN,
    ROUNDING,
    Difference,
    cap,
    compare_reliability,
    dense_scene,
    ideal_scenes,
)
from comparison.reliability.errors import QUANTITIES, integrals, slider_errors, unit_of
from comparison.report import svg
from comparison.report.figures import against_angle
from comparison.scene import Scene, load_scene
from comparison.studies.shared.scenes import at_tier
from comparison.studies.shared.study import Study, crossed, write_csv
from comparison.tables.table import Table
from comparison.words.reliability import rounded

LEFT_OUT = 1
"""Cycles at the start of a long run, which still depend on the initial position of the slider."""
PAPER = 2  # cycles of the paper's figures and of the shipped scenes
LEAST = 1e-12  # of a reliability: what a logarithmic axis shows of less


class Config(NamedTuple):
    """Scenes, cycles of each long run, and samples a cycle of a scene."""

    cases: tuple[str, ...]
    cycles: int
    samples: int


class Results(NamedTuple):
    """Both models' reliabilities over the later cycles of long runs, by scene and quantity, and tables."""

    config: Config
    scenes: dict[str, Scene]
    long: dict[str, dict[str, Difference]]
    tables: dict[str, pd.DataFrame]
    """Differences of these, and of the paper's "two-cycles"; "one-model": what the reference's mean."""


def measure(config: Config, n_jobs: int, on_progress: Progress | None) -> Results:
    """Run the cases and the ideal mechanism by both models; `RunError` if one does not succeed."""
    scenes, planned = {}, {}
    start = load_scene(CASES[0]).data["mechanism"]["crank_angle_deg"]
    for which in product(config.cases, (PAPER, config.cycles)):
        values = {"drive.cycles": float(which[1]), "output.samples_per_cycle": config.samples}
        values["mechanism.crank_angle_deg"] = start  # the workpiece's own scene begins elsewhere
        scene = scenes[which] = at_tier(load_scene(which[0], values), "tight")
        for model in MODELS:
            planned[which, model, "actual"] = levels(dense_scene(scene), model)
            planned[which, model, "ideal"] = ideal_scenes(scene, model)
    jobs = [Job(variant, model) for (_, model, _), each in planned.items() for variant in each.values()]
    tables = map(successful, run_all(jobs, n_jobs, on_progress), jobs)
    runs = {
        (which, model, motion): Runs(
            refinement=refinement(model, scenes[which]), **dict(zip(variants, tables, strict=False))
        )
        for (which, model, motion), variants in planned.items()
    }

    def compared(name: str, cycles: int, left_out: int) -> dict[str, Difference]:
        which, (a, b) = (name, cycles), MODELS
        scene, k = scenes[which], thresholds("tight").k
        actual, ideal = ((runs[which, a, motion], runs[which, b, motion]) for motion in ("actual", "ideal"))
        start = left_out * scene.period
        return compare_reliability(actual, ideal, scene.period, scene.reliability, k, start)

    long = {name: compared(name, config.cycles, LEFT_OUT) for name in config.cases}
    rows = []
    for name, by_quantity in long.items():
        run, ideal = (runs[(name, config.cycles), MODELS[0], motion].base for motion in ("actual", "ideal"))
        repeats = repeating(run, ideal, scenes[name, config.cycles].period)
        for word, each in by_quantity.items():
            side = each.a
            least, (low, high) = int(side.within.argmin()), side.interval
            rows.append(
                {
                    "scene": name,
                    "quantity": word,
                    "unit": unit_of(word),
                    "smallest_R": side.minimum,
                    "R_low": low,
                    "R_high": high,
                    "parts_at_cap": int(side.capped.sum()),
                    "parts": side.capped.size,
                    "smallest_P": side.within[least],
                    "P_low": side.within_low[least],
                    "P_high": side.within_high[least],
                    "largest_mean": side.mean.max(),
                    "largest_deviation": side.deviation.max(),
                    "repeats": repeats[word],
                }
            )
    frames = {
        "differences": differences(long),
        "two-cycles": differences({name: compared(name, PAPER, 0) for name in config.cases}),
        "one-model": pd.DataFrame(rows),
    }
    return Results(config, {name: scenes[name, config.cycles] for name in long}, long, frames)


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
    for scene, by_quantity in by_scene.items():
        for name, each in by_quantity.items():
            row: dict[str, Any] = {"scene": scene, "quantity": name}
            for model, side in zip(MODELS, (each.a, each.b), strict=True):
                row |= {f"{model}_smallest": side.minimum, f"{model}_at_deg": side.angle[side.worst]}
            row |= {"difference": each.minimum, "half_width": each.half_width, "other_cycles": each.sampling}
            row |= {"numerics": each.numerical, "quadrature": each.quadrature, "verdict": each.verdict}
            rows.append(row)
    return pd.DataFrame(rows)


def page(results: Results) -> dict[str, object]:
    """Return what the template asks."""
    long, settings = results.tables["differences"], next(iter(results.scenes.values())).reliability
    alone = results.tables["one-model"]
    idle, loaded = (alone[alone["scene"] == name].set_index("quantity") for name in (CASES[0], LOADED))
    limits = (f"{name} {quantity(getattr(settings, name).upper, unit_of(name))}" for name in QUANTITIES)
    return {
        "config": results.config,
        "long": long,
        "verdicts": {name: int((long["verdict"] == name).sum()) for name in ("agree", "undecided", "differ")},
        "settings": settings,
        "limits": ", ".join(limits),
        "cap": f"{cap(settings.displacement):.10f}",
        "rounding": f"{ROUNDING:g}",
        "margin": f"{MARGIN:g}",
        "smallest": _by_quantity(long),
        "two": _by_quantity(results.tables["two-cycles"]),
        "alone": alone,
        "loads": loaded.join(idle.add_suffix("_idle")),
        "rounded": rounded,
        "figures": {_picture(name): scene.title for name, scene in results.scenes.items()},
    }


def _picture(scene: str) -> str:
    return f"{scene.replace('.', '_')}.svg"


def _by_quantity(rows: pd.DataFrame) -> str:
    """Return both models' smallest reliabilities, once where they round to the same, with the verdicts."""
    cells = []
    for row in rows.to_dict("records"):
        both = dict.fromkeys(rounded(row[f"{model}_smallest"]) for model in MODELS)
        verdict = row["verdict"] if row["verdict"] == "agree" else f"**{row['verdict']}**"
        cells.append(f"{' and '.join(both)}, {verdict}")
    return crossed("scene", list(rows["scene"]), list(rows["quantity"]), cells)


def draw(results: Results, folder: Path) -> None:
    """Draw differences, and the reliabilities against the crank angle; write the tables as CSV."""
    long = results.tables["differences"]
    write_csv(results.tables, folder)
    with svg.style():
        for name, quantities in results.long.items():
            svg.write_svg(against_angle(quantities, MODELS), folder / _picture(name))
    # The differences with their half-widths against the margin: a panel a quantity.
    scenes = list(dict.fromkeys(long["scene"]))
    height, shared = 1.4 + 0.2 * len(scenes), {"sharex": True, "sharey": True}
    with svg.panels(folder / "differences.svg", 1, len(QUANTITIES), height=height, **shared) as axes:
        for panel, name in zip(axes, QUANTITIES, strict=True):
            shown = long[long["quantity"] == name]
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
LOADED = "workpiece"  # the first of them with a workpiece
STUDY = Study(
    "reliability",
    small=Config(cases=("150rpm-0.2mm", LOADED), cycles=3, samples=100),
    full=Config(cases=(*CASES, LOADED), cycles=11, samples=1000),
    measure=measure,
    page=page,
    draw=draw,
)
