"""The section of the page about the stability of steps."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from comparison.execution.run import Progress
from comparison.studies.extremes.step_stability import (
    baumgarte,
    baumgarte_tables,
    contacts,
    contacts_tables,
    figures,
)
from comparison.studies.extremes.step_stability.config import Config
from comparison.studies.shared.progress import part
from comparison.studies.shared.study import Study

HALF = 0.6
"""Of the expected time: where the gains end."""


@dataclass(frozen=True)
class Results:
    """Frames with a row a run: Baumgarte's gains, single impacts, and the map of step and modulus."""

    config: Config
    gains: pd.DataFrame
    impacts: pd.DataFrame
    points: pd.DataFrame


def measure(config: Config, n_jobs: int, on_progress: Progress | None) -> Results:
    """Run all."""
    gains = baumgarte.measured(config, n_jobs, part(on_progress, 0.0, HALF))
    return Results(config, gains, *contacts.measured(config, n_jobs, part(on_progress, HALF, 1.0)))


def page(results: Results) -> Mapping[str, object]:
    """Return what stands in the template."""
    gains = baumgarte_tables.values(results.config, results.gains)
    fixed = contacts_tables.values(results.impacts, results.points)
    return {f"gains_{key}": value for key, value in gains.items()} | {
        f"contacts_{key}": value for key, value in fixed.items()
    }


def draw(results: Results, folder: Path) -> None:
    """Write the four figures."""
    figures.steps_over_gain(results.gains, folder)
    figures.drift_over_gains(results.gains, results.config.tolerances[0], folder)
    figures.rebound(results.impacts, folder)
    figures.step_and_modulus(results.points, folder)


STUDY = Study(
    "extremes.step_stability",
    small=Config(
        gains=(0.0, 10.0, 1e3),
        tolerances=(5e-6, 1e-7),
        cycles=(1.0, 2.0),
        moduli=(1e9, 1e12),
        impact_steps=(1e-6, 1e-5),
        phases=(0.375,),
        map_steps=(1e-5, 1e-4),
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
)
