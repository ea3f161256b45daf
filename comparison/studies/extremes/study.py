"""What the study extremes runs and writes."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

from comparison.files import replacing
from comparison.run import Progress
from comparison.studies.extremes import tables
from comparison.studies.extremes.cells import HYPERCUBE
from comparison.studies.extremes.gather import LONG_LIMIT, SHORT_LIMIT, gather
from comparison.studies.extremes.maps import draw_axes, draw_errors, draw_hypercube
from comparison.studies.extremes.outcomes import WORDS
from comparison.studies.extremes.runs import LIMIT


def write(folder: Path, n_jobs: int, on_progress: Progress | None) -> None:
    """Run all, and write README.md, cells.csv and figures."""
    found = gather(n_jobs, on_progress)
    tables.write_rows(found, folder / "cells.csv")
    draw_axes(found, ("hertz-corners", "strip"), folder / "axes.svg")
    draw_hypercube(found, folder / "hypercube.svg")
    draw_errors(found, folder / "errors.svg")
    template = files("comparison.studies.extremes").joinpath("extremes.md").read_text("utf-8")
    left = tables.unexplained(found)
    text = template.format(
        limit=f"{LIMIT:g}",
        short_limit=f"{SHORT_LIMIT:g}",
        long_limit=f"{LONG_LIMIT:g}",
        points=sum(of.cell.axis == HYPERCUBE for of in found),
        classes="\n".join(f"- **{kind}**: {words};" for kind, words in WORDS.items()),
        counts=tables.counts(found),
        drifts=tables.drifts(found),
        turns=tables.turns(found),
        differences=tables.differences(found),
        parts="",
        unexplained="\n".join(f"- {line}" for line in left) or "None.",
    )
    with replacing(folder / "README.md") as part:
        part.write_text(text, "utf-8")
