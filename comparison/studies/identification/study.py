"""The geometry from the published facts, and what runs say about radius, gravity and reference line."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

import numpy as np

from comparison.execution.run import Progress
from comparison.files import replacing
from comparison.report import svg
from comparison.studies.identification import figures, text_fits, text_runs
from comparison.studies.identification.facts import Facts, printed_facts, shipped_geometry, table_1
from comparison.studies.identification.fitting import Fit, fit, profile
from comparison.studies.identification.kinematics import TOPOLOGIES, Lengths
from comparison.studies.identification.runs import BASE, simulate

FITTING = 0.1
"""Share of the progress that the fits take."""
HELD = 13
"""Values of a profile."""
REACH = 3.0
"""Standard deviations to either side that a profile spans."""


def write(folder: Path, n_jobs: int, on_progress: Progress | None) -> None:
    """Fit every topology, run what kinematics leave open, and write README.md and figures."""
    lengths, speed = table_1(BASE)
    facts = printed_facts()
    fits = ranked(lengths, speed, facts, on_progress)

    def later(share: float) -> None:
        if on_progress:
            on_progress(FITTING + (1 - FITTING) * share)

    runs = simulate(fits[1], n_jobs, later)
    spread = np.sqrt(np.diag(fits[0].covariance))
    profiles = [
        profile(fits[0], n, middle + sd * np.linspace(-REACH, REACH, HELD), lengths, speed, facts)
        for n, (middle, sd) in enumerate(zip(fits[0].geometry, spread, strict=True))
    ]
    with svg.style():
        figures.draw_presses(fits, lengths, folder / "press.svg")
        figures.draw_ranking(fits, folder / "ranking.svg")
        figures.draw_profiles(profiles, shipped_geometry(), folder / "profiles.svg")
        figures.draw_radius(runs, folder / "radius.svg")
        figures.draw_offset(runs, folder / "offset.svg")
    template = files("comparison.studies.identification").joinpath("identification.md").read_text("utf-8")
    parts = text_fits.of_kinematics(fits, facts, profiles, lengths, speed) | text_runs.of_runs(
        fits[1], runs, lengths, speed
    )
    with replacing(folder / "README.md") as part:
        part.write_text(template.format(**parts), "utf-8")


def ranked(lengths: Lengths, speed: float, facts: Facts, on_progress: Progress | None) -> list[Fit]:
    """Return the best fit of every topology that can be assembled, the best first."""
    found = []
    for n, topology in enumerate(TOPOLOGIES):
        found.append(fit(topology, lengths, speed, facts))
        if on_progress:
            on_progress(FITTING * (n + 1) / len(TOPOLOGIES))
    return sorted((each for each in found if each is not None), key=lambda each: each.misfit)
