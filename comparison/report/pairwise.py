"""Page of several models: the verdict of each pair on each scene, the outlier, and all on common plots."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from comparison.formatting import MISSING, number, percent, quantity
from comparison.report.plots import table_plots
from comparison.report.templates import interactive_page, write_page
from comparison.tables.channels import channels
from comparison.tables.table import Table, TableError
from comparison.tables.table_files import read
from comparison.verdict.several import Pair, Standing
from comparison.words.verdicts import standing, standings

_DRAWN = 3
"""Models on common plots at most: of more lines over each other none can be followed."""


@dataclass(frozen=True)
class PairResult:
    """Verdict of a pair on a scene; ``record`` is its entry in the pair's ``summary.json``."""

    pair: Pair
    record: dict[str, Any]

    @property
    def link(self) -> str:
        """Address of the pair's own report, relative to the page."""
        return f"{'-'.join(self.pair)}/report.html"

    @property
    def cells(self) -> tuple[str, str, str]:
        """Ratio of the decisive channel, largest difference of slider x, and its predictable share."""
        ratio, channel = self.record["ratio"], self.record["channels"].get("slider_x")
        if channel is None:
            return MISSING, MISSING, MISSING
        return (
            MISSING if ratio is None else number(ratio, 2),
            quantity(channel["max_difference"], channel["unit"]),
            MISSING if channel["coverage"] is None else percent(channel["coverage"]),
        )


@dataclass(frozen=True)
class Row:
    """A scene at the standard tier, which every pair has."""

    name: str
    title: str
    standing: Standing
    results: list[PairResult]


def write_pairwise(rows: Sequence[Row], folder: Path, *, models: Sequence[str], command: str) -> Path:
    """Write ``report.html`` of several models into a folder and return its path.

    The curves are those of the tables that the pairs' reports have written into the folder.
    """
    html = interactive_page(
        "pairwise.html.j2",
        title=f"{len(models)} models against each other",
        models=models,
        pairs=[result.pair for result in rows[0].results],
        rows=rows,
        lead=standings([row.standing for row in rows]),
        sentence=standing,
        plots=[_plots(row, folder, models) for row in rows],
        command=command,
    )
    return write_page(html, folder / "report.html")


def _plots(row: Row, folder: Path, models: Sequence[str]) -> str:
    """Return the plots of a scene's base runs, of the models that have one; empty without two."""
    tables: dict[str, Table] = {}
    for model in models:
        for result in row.results:
            path = folder / "-".join(result.pair) / "tables" / f"{row.name}-{model}.csv"
            if model in result.pair and model not in tables and path.exists():
                try:
                    tables[model] = read(path)
                except TableError:
                    continue  # a run that did not succeed has no complete table
    tables = dict(list(tables.items())[:_DRAWN])
    if len(tables) < 2 or any(table.time.size < 2 for table in tables.values()):
        return ""
    scene: Mapping[str, Any] = next(iter(tables.values())).provenance.get("scene") or {}
    names = [name for name in channels() if not (name.startswith("corner_") and not name.endswith("_normal"))]
    return table_plots(
        tables,
        names,
        period=60.0 / abs(float(scene["drive"]["speed_rpm"])) if scene else None,
        guide=float(scene["mechanism"]["guide_x"]) if scene else 0.0,
    )
