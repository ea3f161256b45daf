"""The reliability of the paper's cases by both models, over more cycles than the paper's two."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

import numpy as np

from comparison.accuracy.levels import refinement
from comparison.accuracy.thresholds import thresholds
from comparison.accuracy.tiers import tight
from comparison.accuracy.uncertainty import Runs
from comparison.agreement.cross_check import levels
from comparison.execution.run import MODELS, Job, Progress, run_all, successful
from comparison.files import replacing
from comparison.formatting import number, percent, quantity, table
from comparison.reliability.assessment import Assessment
from comparison.reliability.difference import MARGIN, Difference, compare_reliability
from comparison.reliability.errors import since, slider_errors, unit_of
from comparison.reliability.ideal import ideal_scenes
from comparison.reliability.interference import ROUNDING, cap
from comparison.reliability.words import rounded
from comparison.report.reliability import against_angle
from comparison.report.svg import style, write_svg
from comparison.scene import Scene, load_scene
from comparison.tables.table import Table

CASES = (
    "150rpm-0.2mm",
    "69GPa",
    "poisson-0.33",
    "90rpm-0.1mm",
    "90rpm-0.5mm",
    "300rpm-0.2mm",
    "crank-pin",
)
CYCLES = 11
LEFT_OUT = 1
"""Turns at the start, which still remember how the slider was put in."""
SAMPLES = 1000
"""A turn."""

ACTUAL, IDEAL = "actual", "ideal"
COMPARED = (
    "scene",
    "quantity",
    *(f"smallest R, {model}" for model in MODELS),
    "difference",
    "other cycles",
    "numerics",
    "verdict",
)
ALONE = (
    "scene",
    "quantity",
    "smallest R, 95 % interval",
    "parts of the turn at the cap",
    "smallest P, 95 % interval",
    "largest mean, deviation",
    "repeats in every cycle",
)


def scene(name: str) -> Scene:
    """Return a case over all cycles at the settings of the tight tier."""
    usual = load_scene(name, {"drive.cycles": float(CYCLES), "output.samples_per_cycle": SAMPLES})
    closer = tight(usual, MODELS)
    if closer is None:
        raise ValueError("the models of this study have a tight tier")
    return closer


def write(folder: Path, n_jobs: int, on_progress: Progress | None) -> None:
    """Run the cases and the ideal mechanism by both models; write README.md and a figure for each case.

    Raises
    ------
    RunError
        If a run does not succeed.
    """
    scenes = {name: scene(name) for name in CASES}
    jobs = {
        (name, model, motion, kind): Job(level, model)
        for name, of in scenes.items()
        for model in MODELS
        for motion, variants in ((ACTUAL, levels(of, model)), (IDEAL, ideal_scenes(of, model)))
        for kind, level in variants.items()
    }
    outcomes = run_all(list(jobs.values()), n_jobs, on_progress)
    families: dict[tuple[str, str, str], dict[str, Table]] = {}
    for ((name, model, motion, kind), job), outcome in zip(jobs.items(), outcomes, strict=True):
        later = since(successful(outcome, job), LEFT_OUT * scenes[name].period)
        families.setdefault((name, model, motion), {})[kind] = later
    runs = {
        (name, model, motion): Runs(refinement=refinement(model, scenes[name]), **tables)
        for (name, model, motion), tables in families.items()
    }
    a, b = MODELS
    found = {
        name: compare_reliability(
            (runs[name, a, ACTUAL], runs[name, b, ACTUAL]),
            (runs[name, a, IDEAL], runs[name, b, IDEAL]),
            of.period,
            of.reliability,
            thresholds("tight").k,
        )
        for name, of in scenes.items()
    }
    locked = {
        name: repeating(runs[name, a, ACTUAL].base, runs[name, a, IDEAL].base, of)
        for name, of in scenes.items()
    }
    with style():
        for name, quantities in found.items():
            write_svg(against_angle(quantities, MODELS), folder / picture(name))
    with replacing(folder / "README.md") as part:
        part.write_text(text(scenes, found, locked), "utf-8")


def picture(name: str) -> str:
    """Return the name of a scene's figure."""
    return f"{name.replace('.', '_')}.svg"


def repeating(run: Table, ideal: Table, of: Scene) -> dict[str, float]:
    """Return by quantity the share of the error's variance that its average over the cycles has."""
    errors = slider_errors(run, ideal, of.period)
    shares = {}
    for name, values in errors.by_quantity.items():
        cycles = values.reshape(-1, errors.per_turn)
        total = cycles.var()
        shares[name] = float(cycles.mean(0).var() / total) if total > 0 else float("nan")
    return shares


def text(
    scenes: dict[str, Scene],
    found: dict[str, dict[str, Difference]],
    locked: dict[str, dict[str, float]],
) -> str:
    """Return the study's README.

    Parameters
    ----------
    scenes
        By name.
    found
        Scene -> quantity -> both models' reliabilities.
    locked
        Scene -> quantity -> share of the error's variance that repeats in every cycle.
    """
    each = [(name, quantity, of) for name, all_ in found.items() for quantity, of in all_.items()]
    verdicts = [of.verdict for *_, of in each]
    settings = next(iter(scenes.values())).reliability
    limits = (getattr(settings, quantity) for quantity in found[CASES[0]])
    template = files("comparison.studies.reliability").joinpath("reliability.md").read_text("utf-8")
    return template.format(
        cycles=CYCLES - LEFT_OUT,
        all_cycles=CYCLES,
        bins=settings.bins,
        of_what="size of the error" if settings.errors == "absolute" else "signed error",
        limits=", ".join(
            f"{name} {quantity(limit.upper, unit_of(name))}"
            for name, limit in zip(found[CASES[0]], limits, strict=True)
        ),
        cap=f"{cap(settings.displacement):.10f}",
        rounding=f"{ROUNDING:g}",
        margin=f"{MARGIN:g}",
        count=len(each),
        agree=verdicts.count("agree"),
        undecided=verdicts.count("undecided"),
        differ=verdicts.count("differ"),
        within=sum(abs(of.minimum) <= of.half_width for *_, of in each),
        bins_within=percent(
            float(np.mean(np.concatenate([np.abs(of.curve) <= of.curve_half_width for *_, of in each])))
        ),
        differences=table(
            COMPARED,
            [_compared(*of) for of in each],
        ),
        one_model=table(
            ALONE,
            [_alone(name, quantity, of.a, locked[name][quantity]) for name, quantity, of in each],
        ),
        figures="\n\n".join(
            f"![{of.title}: reliability against the crank angle]({picture(name)})\n\n{of.title}"
            for name, of in scenes.items()
        ),
    )


def _compared(name: str, quantity_: str, of: Difference) -> list[str]:
    return [
        name,
        quantity_,
        *(f"{rounded(side.minimum)} at {side.angle[side.worst]:g}°" for side in (of.a, of.b)),
        number(of.minimum, 2),
        f"± {number(of.sampling, 2)}",
        f"± {number(of.numerical, 2)}",
        f"**{of.verdict}**",
    ]


def _alone(name: str, quantity_: str, of: Assessment, repeats: float) -> list[str]:
    worst, least, unit = of.worst, int(of.within.argmin()), unit_of(quantity_)
    return [
        name,
        quantity_,
        f"{rounded(of.minimum)} ({of.low[worst]:.5f} … {of.high[worst]:.5f})",
        f"{int(of.capped.sum())} of {of.capped.size}",
        f"{of.within[least]:.3f} ({of.within_low[least]:.3f} … {of.within_high[least]:.3f})",
        f"{quantity(float(of.mean.max()), unit)}, {quantity(float(of.deviation.max()), unit)}",
        percent(repeats),
    ]
