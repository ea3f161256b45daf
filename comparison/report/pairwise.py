"""Page of several models: the verdict of each pair on each scene, and who stands alone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from comparison.files import replacing
from comparison.formatting import MISSING, percent, quantity
from comparison.report.templates import TEMPLATES, style
from comparison.verdict.several import Pair, Standing
from comparison.words.verdicts import SYMBOLS, standing, standings


@dataclass(frozen=True)
class PairResult:
    """Verdict of a pair on a scene; ``found`` is the mapping of `comparison.report.text.as_mapping`."""

    pair: Pair
    found: dict[str, Any]

    @property
    def link(self) -> str:
        """Address of the pair's own report, relative to the page."""
        return f"{'-'.join(self.pair)}/report.html"

    @property
    def largest(self) -> str:
        """Largest difference of slider x over the whole run, and the share of it that is predictable."""
        channel = self.found["channels"].get("slider_x")
        if channel is None:
            return MISSING
        share = "" if channel["coverage"] is None else f", predictable {percent(channel['coverage'])}"
        return f"slider x: {quantity(channel['max_difference'], channel['unit'])}{share}"


@dataclass(frozen=True)
class Row:
    """A scene at the standard tier, which every pair has."""

    name: str
    title: str
    standing: Standing
    results: list[PairResult]


def write_pairwise(rows: Sequence[Row], folder: Path, *, models: Sequence[str], command: str) -> Path:
    """Write ``report.html`` of several models into a folder and return its path."""
    page = TEMPLATES.get_template("pairwise.html.j2").render(
        rows=rows,
        pairs=[result.pair for result in rows[0].results],
        models=models,
        command=command,
        lead=standings([row.standing for row in rows]),
        symbols=SYMBOLS,
        sentence=standing,
        css=style(),
    )
    path = folder / "report.html"
    with replacing(path) as temporary:
        temporary.write_text(page, "utf-8")
    return path
