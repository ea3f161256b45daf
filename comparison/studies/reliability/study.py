"""The reliability of the paper's cases by both models, over the paper's two cycles and over more."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from comparison.accuracy.levels import refinement, thresholds
from comparison.accuracy.refine import levels
from comparison.accuracy.uncertainty import Runs
from comparison.execution.run import Job, Progress, run_all, successful
from comparison.formatting import number, percent, quantity
from comparison.models import MODELS
from comparison.reliability.assessment import ROUNDING, Assessment, cap
from comparison.reliability.averages import integrals
from comparison.reliability.difference import (
    MARGIN,
    Difference,
    compare_reliability,
    dense_scene,
    ideal_scenes,
)
from comparison.reliability.errors import QUANTITIES, slider_errors, unit_of
from comparison.report.figures import against_angle
from comparison.report.svg import style, write_svg
from comparison.scene import Scene, load_scene
from comparison.studies.shared.frames import rows_table
from comparison.studies.shared.scenes import at_tier
from comparison.studies.shared.study import Study
from comparison.tables.table import Table
from comparison.words.reliability import rounded

LEFT_OUT = 1
"""Cycles at the start of a long run, which still depend on the initial position of the slider."""
PAPER = 2
"""Cycles of the paper's figures and of the shipped scenes."""


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


def scene(name: str, config: Config, cycles: int) -> Scene:
    """Return a case over so many cycles at the settings of the tight tier."""
    values = {"drive.cycles": float(cycles), "output.samples_per_cycle": config.samples}
    return at_tier(load_scene(name, values), "tight")


def measure(config: Config, n_jobs: int, on_progress: Progress | None) -> Results:
    """Run the cases and the ideal mechanism by both models.

    Raises
    ------
    RunError
        If a run does not succeed.
    """
    scenes = {
        (name, cycles): scene(name, config, cycles)
        for name in config.cases
        for cycles in (PAPER, config.cycles)
    }
    jobs = {
        (which, model, motion, kind): Job(level, model)
        for which, of in scenes.items()
        for model in MODELS
        for motion, variants in (
            ("actual", levels(dense_scene(of), model)),
            ("ideal", ideal_scenes(of, model)),
        )
        for kind, level in variants.items()
    }
    outcomes = run_all(list(jobs.values()), n_jobs, on_progress)
    tables = {
        key: successful(outcome, job) for (key, job), outcome in zip(jobs.items(), outcomes, strict=True)
    }

    def runs(which: tuple[str, int], model: str, motion: str) -> Runs:
        kinds = {key[3]: table for key, table in tables.items() if key[:3] == (which, model, motion)}
        return Runs(refinement=refinement(model, scenes[which]), **kinds)

    def compared(name: str, cycles: int, left_out: int) -> dict[str, Difference]:
        of, which = scenes[name, cycles], (name, cycles)
        pairs = [[runs(which, model, motion) for model in MODELS] for motion in ("actual", "ideal")]
        (a, b), (ideal_a, ideal_b) = pairs
        return compare_reliability(
            (a, b),
            (ideal_a, ideal_b),
            of.period,
            of.reliability,
            thresholds("tight").k,
            left_out * of.period,
        )

    repeats = {}
    for name in config.cases:
        which = (name, config.cycles)
        run, still = (tables[which, MODELS[0], motion, "base"] for motion in ("actual", "ideal"))
        repeats[name] = repeating(run, still, scenes[which])
    return Results(
        config,
        {name: scenes[name, config.cycles] for name in config.cases},
        {name: compared(name, PAPER, 0) for name in config.cases},
        {name: compared(name, config.cycles, LEFT_OUT) for name in config.cases},
        repeats,
    )


def repeating(run: Table, ideal: Table, of: Scene) -> dict[str, float]:
    """Return by quantity the share of the error's variance that its average over the cycles has.

    Of the averages over hundredths of a cycle.
    """
    errors = slider_errors(run, ideal, of.period, start=LEFT_OUT * of.period)
    cycles = round(errors.time[-1] / of.period)
    edges = of.period * np.arange(100 * cycles + 1) / 100
    shares = {}
    for name, channel in QUANTITIES.items():
        by_cycle = integrals(errors.time, errors.by_channel[channel], edges).reshape(cycles, -1)
        total = by_cycle.var()
        shares[name] = float(by_cycle.mean(0).var() / total) if total > 0 else float("nan")
    return shares


def picture(name: str) -> str:
    """Return the name of a scene's figure."""
    return f"{name.replace('.', '_')}.svg"


def figures(results: Results, folder: Path) -> None:
    """Draw the reliabilities of every scene against the crank angle."""
    with style():
        for name, quantities in results.long.items():
            write_svg(against_angle(quantities, MODELS), folder / picture(name))


def page(results: Results) -> dict[str, object]:
    """Return what stands in the page."""
    each, two = (
        [(name, quantity, of) for name, found in runs.items() for quantity, of in found.items()]
        for runs in (results.long, results.paper)
    )
    verdicts = [of.verdict for *_, of in each]
    settings = next(iter(results.scenes.values())).reliability
    inside = np.concatenate([np.abs(of.curve) <= of.curve_half_width for *_, of in each])
    return {
        "cycles": results.config.cycles - LEFT_OUT,
        "all_cycles": results.config.cycles,
        "two": rows_table(_compared(*of) for of in two),
        "bins": settings.bins,
        "of_what": "size of the error" if settings.errors == "absolute" else "signed error",
        "limits": ", ".join(
            f"{name} {quantity(getattr(settings, name).upper, unit_of(name))}"
            for name in dict.fromkeys(name for _, name, _ in each)
        ),
        "cap": f"{cap(settings.displacement):.10f}",
        "rounding": f"{ROUNDING:g}",
        "margin": f"{MARGIN:g}",
        "count": len(each),
        **{verdict: verdicts.count(verdict) for verdict in ("agree", "undecided", "differ")},
        "within": sum(abs(of.minimum) <= of.half_width for *_, of in each),
        "bins_within": percent(float(inside.mean())),
        "differences": rows_table(_compared(*of) for of in each),
        "one_model": rows_table(
            _alone(name, quantity, of.a, results.repeating[name][quantity]) for name, quantity, of in each
        ),
        "figures": "\n\n".join(
            f"![{of.title}: reliability against the crank angle]({picture(name)})\n\n{of.title}"
            for name, of in results.scenes.items()
        ),
    }


def _compared(name: str, quantity_: str, of: Difference) -> dict[str, str]:
    return {
        "scene": name,
        "quantity": quantity_,
        **{
            f"smallest R, {model}": f"{rounded(side.minimum)} at {side.angle[side.worst]:g}°"
            for model, side in zip(MODELS, (of.a, of.b), strict=True)
        },
        "difference": number(of.minimum, 2),
        "other cycles": f"± {number(of.sampling, 2)}",
        "numerics": f"± {number(of.numerical, 2)}",
        "quadrature": f"± {number(of.quadrature, 2)}",
        "verdict": f"**{of.verdict}**",
    }


def _alone(name: str, quantity_: str, of: Assessment, repeats: float) -> dict[str, str]:
    least, unit = int(of.within.argmin()), unit_of(quantity_)
    mean, deviation = (quantity(float(values.max()), unit) for values in (of.mean, of.deviation))
    return {
        "scene": name,
        "quantity": quantity_,
        "smallest R, 95 % interval": "{} ({:.5f} … {:.5f})".format(rounded(of.minimum), *of.interval),
        "parts of the cycle at the cap": f"{int(of.capped.sum())} of {of.capped.size}",
        "smallest P, 95 % interval": f"{of.within[least]:.3f} ({of.within_low[least]:.3f} … "
        f"{of.within_high[least]:.3f})",
        "largest mean, deviation": f"{mean}, {deviation}",
        "repeats in every cycle": percent(repeats),
    }


STUDY = Study(
    "reliability",
    small=Config(cases=("150rpm-0.2mm", "crank-pin"), cycles=3, samples=100),
    full=Config(
        cases=(
            "150rpm-0.2mm",
            "69GPa",
            "poisson-0.33",
            "90rpm-0.1mm",
            "90rpm-0.5mm",
            "300rpm-0.2mm",
            "crank-pin",
        ),
        cycles=11,
        samples=1000,
    ),
    measure=measure,
    page=page,
    draw=figures,
)
