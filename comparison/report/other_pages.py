"""Pages besides the report: several models against each other, and the press in motion."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from comparison.files import write_text
from comparison.metrics.contacts import noted
from comparison.report.plots import FORCES, MOTION, table_plots
from comparison.report.schematic import joints, schematic
from comparison.report.templates import interactive_page
from comparison.tables.channels import channels
from comparison.tables.table import Table, TableError
from comparison.tables.table_files import read
from comparison.verdict.validate import Pair, Standing
from comparison.words.verdicts import standing, standings

_DRAWN = 3
"""Models on common plots at most: of more lines over each other none can be followed."""


class Row(NamedTuple):
    """A scene at the standard tier, with its entry in the ``summary.json`` of every pair."""

    name: str
    title: str
    standing: Standing
    results: dict[Pair, dict[str, Any]]


def write_pairwise(rows: Sequence[Row], folder: Path, *, models: Sequence[str], command: str) -> Path:
    """Write ``report.html`` of several models beside the pairs' reports, whose tables it draws."""
    html = interactive_page(
        "pairwise.html.j2",
        title=f"{len(models)} models against each other",
        models=models,
        rows=rows,
        lead=standings([row.standing for row in rows]),
        sentence=standing,
        plots=[_plots(row, folder, models) for row in rows],
        command=command,
    )
    write_text(html, folder / "report.html")
    return folder / "report.html"


def _plots(row: Row, folder: Path, models: Sequence[str]) -> str:
    """Return the plots of a scene's base runs, of the models that have one; empty without two."""
    tables: dict[str, Table] = {}
    for model, pair in ((model, pair) for model in models for pair in row.results if model in pair):
        if model not in tables and len(tables) < _DRAWN:
            with suppress(TableError):  # a run that did not succeed has no complete table
                tables[model] = read(folder / "-".join(pair) / "tables" / f"{row.name}-{model}.csv")
    if len(tables) < 2 or any(table.time.size < 2 for table in tables.values()):
        return ""
    scene: Mapping[str, Any] = next(iter(tables.values())).provenance.get("scene") or {}
    return table_plots(
        tables,
        [name for name in channels() if not name.startswith("corner_") or name.endswith("_normal")],
        period=60.0 / abs(float(scene["drive"]["speed_rpm"])) if scene else None,
        guide=float(scene["mechanism"]["guide_x"]) if scene else 0.0,
    )


def write_animation(
    tables: Mapping[str, Table], scene: Mapping[str, Any], path: Path, *, title: str, command: str
) -> Path:
    """Write the animation of one table, or two over each other at the times of the first, into a file."""
    for label, table in tables.items():
        if missing := [name for name in MOTION if name not in table.channels]:
            needs = f"an animation needs {', '.join(MOTION)}"
            raise TableError(f"{label}: channel {missing[0]!r} is missing; {needs}")
        if table.time.size < 2:
            raise TableError(f"{label}: an animation needs two samples at least")
    mechanism, speed = scene["mechanism"], float(scene["drive"]["speed_rpm"])
    time = next(iter(tables.values())).time
    seconds = float(time[-1] - time[0])
    turned = np.sign(speed) * np.linspace(0, min(360.0, 6.0 * abs(speed) * seconds), 360)
    if any(joints(mechanism, mechanism["crank_angle_deg"] + angle) is None for angle in turned):
        raise TableError("the mechanism of this scene cannot be assembled at every crank angle")
    html = interactive_page(
        "animation.html.j2",
        title=title,
        labels=list(tables),
        seconds=seconds,
        cycles=seconds * abs(speed) / 60.0,
        schematic=schematic(scene),
        plots=table_plots(
            tables,
            (*MOTION, *FORCES),
            period=60.0 / abs(speed),
            guide=float(mechanism["guide_x"]),
            pulses=[noted(table) for table in tables.values()],
        ),
        command=command,
    )
    write_text(html, path)
    return path
