"""The section of the page about the stability of steps."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise, product
from pathlib import Path

import pandas as pd

from comparison.execution.run import Progress
from comparison.studies.extremes.step_stability import baumgarte, contacts_tables, figures
from comparison.studies.extremes.step_stability.contacts import LEAST, Impact, run_impacts, run_map
from comparison.studies.extremes.step_stability.fixed_steps import METHODS
from comparison.studies.shared.study import Study, part

SHARES = (0.0, 0.6, 0.9, 1.0)
"""Of the expected time: where gains, impacts and map begin and end."""


@dataclass(frozen=True)
class Config:
    """Values of settings."""

    gains: tuple[float, ...]
    """Baumgarte's alpha and beta, 1/s, ascending from 0; the default of a scene among them."""
    tolerances: tuple[float, ...]
    """Of a step under them, rad and m, descending; the first is that of all pairs and of the long runs."""
    cycles: tuple[float, ...]
    """Lengths of the long runs, ascending from 1."""
    moduli: tuple[float, ...]
    """Young's, of contacts without error control, Pa, ascending."""
    impact_steps: tuple[float, ...]
    """Of single impacts, s."""
    phases: tuple[float, ...]
    """How much of a step the touch comes after a state in flight."""
    map_steps: tuple[float, ...]
    """Of a quarter of a cycle, s, ascending."""


@dataclass(frozen=True)
class Results:
    """Frames with a row a run: Baumgarte's gains, single impacts, and the map of step and modulus."""

    gains: pd.DataFrame
    impacts: pd.DataFrame
    points: pd.DataFrame


def measure(config: Config, n_jobs: int, on_progress: Progress | None) -> Results:
    """Run all; of the impacts those that take so few steps that they can err."""
    first, second, third = (part(on_progress, *ends) for ends in pairwise(SHARES))
    gains = baumgarte.measured(config.gains, config.tolerances, config.cycles, n_jobs, first)
    every = [Impact(*of) for of in product(METHODS, config.impact_steps, config.moduli, config.phases)]
    impacts = run_impacts([impact for impact in every if impact.wh >= LEAST], n_jobs, second)
    return Results(gains, impacts, run_map(config.map_steps, config.moduli, n_jobs, third))


def page(results: Results) -> Mapping[str, object]:
    """Return what stands in the template."""
    gains = baumgarte.values(results.gains)
    fixed = contacts_tables.values(results.impacts, results.points)
    return {f"gains_{key}": value for key, value in gains.items()} | {
        f"contacts_{key}": value for key, value in fixed.items()
    }


def draw(results: Results, folder: Path) -> None:
    """Write the four figures."""
    figures.steps_over_gain(results.gains, folder)
    figures.drift_over_gains(results.gains, folder)
    figures.rebound(results.impacts, folder)
    figures.step_and_modulus(results.points, folder)


STUDY = Study(
    "extremes.step_stability",
    small=Config(
        gains=(0.0, 10.0, 1e3), tolerances=(5e-6, 1e-7), cycles=(1.0, 2.0), moduli=(1e9, 1e12),
        impact_steps=(1e-6, 1e-5), phases=(0.375,), map_steps=(1e-5, 1e-4),
    ),
    full=Config(
        gains=(0.0, 1.0, 10.0, 100.0, 1e3, 1e4, 1e5),
        # The loosest that the scene with contact is given is a hundredth of its clearance.
        tolerances=(5e-6, 1e-7, 1e-10),
        cycles=(1.0, 2.0, 5.0, 10.0, 20.0, 50.0),
        moduli=tuple(10.0**power for power in range(6, 14)),
        impact_steps=(1e-7, 1e-6, 1e-5, 1e-4, 1e-3),
        phases=(0.125, 0.375, 0.625, 0.875),
        map_steps=(1e-6, 2e-6, 5e-6, 1e-5, 2e-5, 5e-5, 1e-4, 2e-4, 5e-4, 1e-3),
    ),
    measure=measure,
    page=page,
    draw=draw,
)  # fmt: skip
