"""The geometry from the published facts, and what runs say about radius, gravity and reference line."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from comparison.execution.run import Progress
from comparison.studies.identification import figures
from comparison.studies.identification.facts import printed_facts
from comparison.studies.identification.fitting import Fit, Profile, fit, profile
from comparison.studies.identification.kinematics import TOPOLOGIES
from comparison.studies.identification.runs import Config, Runs, simulate
from comparison.studies.identification.tables import of_fits, of_runs
from comparison.studies.shared.study import Study, part

FITTING = 0.1
"""Share of the progress that the fits take."""
HELD = np.linspace(-3.0, 3.0, 13)
"""Values of a profile, standard deviations from the best."""


@dataclass(frozen=True)
class Results:
    """Fits of all topologies, the best first, its profiles, one an unknown, and what was run."""

    config: Config
    facts: pd.DataFrame
    fits: list[Fit]
    profiles: list[Profile]
    runs: Runs


def measure(config: Config, n_jobs: int, on_progress: Progress | None) -> Results:
    """Fit every topology and run what kinematics leave open."""
    facts, found = printed_facts(), []
    for n, topology in enumerate(config.topologies):
        found.append(fit(topology, facts))
        if on_progress:
            on_progress(FITTING * (n + 1) / len(config.topologies))
    fits = sorted((each for each in found if each is not None), key=lambda each: each.misfit)
    runs = simulate(fits[1], config, n_jobs, part(on_progress, FITTING, 1.0))
    best = fits[0]
    spread = np.sqrt(np.diag(best.covariance))
    profiles = [profile(best, n, best.geometry[n] + spread[n] * HELD, facts) for n in range(3)]
    return Results(config, facts, fits, profiles, runs)


def page(results: Results) -> dict[str, object]:
    """Return what stands in the page."""
    config = results.config
    return (
        {"members": config.members, "cycles": config.cycles, "tried": len(config.topologies)}
        | of_fits(results.fits, results.facts, results.profiles)
        | of_runs(results.runs)
    )


def draw(results: Results, folder: Path) -> None:
    """Draw presses, ranking and profiles of the fits, radius and offset of the runs."""
    figures.draw_presses(results.fits, folder / "press.svg")
    figures.draw_ranking(results.fits, folder / "ranking.svg")
    figures.draw_profiles(results.profiles, folder / "profiles.svg")
    figures.draw_radius(results.runs, folder / "radius.svg")
    figures.draw_offset(results.runs, folder / "offset.svg")


STUDY = Study(
    "identification",
    small=Config(topologies=TOPOLOGIES[:5], members=2, samples=100, cycles=3, long_samples=100),
    # 10,000 samples a cycle are 40 us apart at 150 rpm, where half of the contacts last more than 200 us.
    full=Config(topologies=TOPOLOGIES, members=4, samples=10_000, cycles=100, long_samples=1000),
    measure=measure,
    page=page,
    draw=draw,
)
