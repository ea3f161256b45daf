"""What the study extremes runs and writes."""

from __future__ import annotations

from importlib.resources import files
from itertools import pairwise
from pathlib import Path

from comparison.execution.run import Progress
from comparison.files import replacing
from comparison.studies.extremes import (
    baumgarte,
    baumgarte_figures,
    baumgarte_text,
    closer,
    differences,
    limits,
    limits_figures,
    stability,
    stability_figures,
    stability_text,
    tables,
)
from comparison.studies.extremes.cells import HYPERCUBE, LAWS
from comparison.studies.extremes.gather import LONG_LIMIT, SHORT_LIMIT, gather
from comparison.studies.extremes.maps import draw_axes, draw_errors, draw_hypercube
from comparison.studies.extremes.outcomes import WORDS
from comparison.studies.extremes.runs import LIMIT
from comparison.studies.shared.progress import part

SHARES = (0.0, 0.83, 0.86, 0.93, 0.96, 1.0)
"""Of the expected time: where each part begins and ends."""


def write(folder: Path, n_jobs: int, on_progress: Progress | None) -> None:
    """Run all, and write README.md, cells.csv and figures."""
    parts = [part(on_progress, *ends) for ends in pairwise(SHARES)]
    found = gather(n_jobs, parts[0])
    closer.look(found, differences.unexplained(found), n_jobs, parts[1])
    tables.write_rows(found, folder / "cells.csv")
    draw_axes(found, LAWS[:2], folder / "axes.svg")
    draw_hypercube(found, folder / "hypercube.svg")
    draw_errors(found, folder / "errors.svg")
    to_limits = limits.measured(n_jobs, parts[2])
    limits_figures.draw(to_limits, folder)
    gains = baumgarte.measured(n_jobs, parts[3])
    baumgarte_figures.draw(gains, folder)
    fixed = stability.measured(n_jobs, parts[4])
    stability_figures.draw(fixed, folder)
    template = files("comparison.studies.extremes").joinpath("extremes.md").read_text("utf-8")
    left = [f"- {differences.listed(found[number], name)}" for number, name in differences.unexplained(found)]
    text = template.format(
        limit=f"{LIMIT:g}",
        short_limit=f"{SHORT_LIMIT:g}",
        long_limit=f"{LONG_LIMIT:g}",
        points=sum(of.cell.axis == HYPERCUBE for of in found),
        classes="\n".join(f"- **{kind}**: {words};" for kind, words in WORDS.items()),
        counts=tables.counts(found),
        drifts=tables.drifts(found),
        turns=tables.turns(found),
        stops=tables.stops(found),
        differences=differences.along_the_axes(found),
        hypercube=differences.in_the_hypercube(found),
        unexplained="\n".join(left) or "None.",
        limits=limits.text(to_limits),
        stability=stability_text.text(fixed),
        baumgarte=baumgarte_text.text(gains),
    )
    with replacing(folder / "README.md") as file:
        file.write_text(text, "utf-8")
