"""The section of the page about all limits, and a figure each: points beside lines of the expected orders."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any

import pandas as pd
from matplotlib.axes import Axes

from comparison.report import svg
from comparison.studies.extremes.limits import clearance, convergence, lossless, speed, stiffness
from comparison.studies.extremes.limits.convergence import Limit, Panel
from comparison.studies.shared.study import Study

LIMITS = (clearance.LIMIT, stiffness.LIMIT, lossless.LIMIT, speed.LIMIT)
_MODELS: dict[str, dict[str, Any]] = {
    "reference": {"marker": "o", "color": svg.FIRST, "ms": 5.5},
    "exudyn": {"marker": "x", "color": svg.SECOND, "ms": 4},
}
_DASHES = ((None, None), (4, 1.5))


def page(found: Sequence[tuple[Limit, pd.DataFrame]]) -> Mapping[str, object]:
    """Return what stands in the template."""
    return {key: value for each in found for key, value in convergence.values(*each).items()}


def draw(found: Sequence[tuple[Limit, pd.DataFrame]], folder: Path) -> None:
    """Write ``limit_NAME.svg`` for each limit."""
    for limit, frame in found:
        with svg.panels(folder / f"limit_{limit.name}.svg", 1, 2, height=3.2) as both:
            for axes, panel in zip(both, limit.panels, strict=True):
                _panel(axes, panel, frame, limit.variable)
            if limit.panels[0].label:
                svg.legend_above(both[0], 2)


def _panel(axes: Axes, panel: Panel, frame: pd.DataFrame, variable: str) -> None:
    shown = frame.query(panel.rows) if panel.rows else frame
    kept = list(dict.fromkeys([variable, "model", *([panel.by] if panel.by in frame else [])]))
    points = shown.melt(kept, list(panel.quantities))
    lines = dict(zip(points[panel.by].unique(), _DASHES, strict=False))
    for (key, model), line in points.groupby([panel.by, "model"], sort=False):
        look: dict[str, Any] = _MODELS[str(model)] | {"dashes": lines[key], "lw": 0.8, "mfc": "none"}
        axes.plot(line[variable], line["value"], label=panel.label.format(key, model), **look)
    start, end, first, order = panel.guide
    last = first * (end / start) ** order
    axes.plot((start, end), (first, last), color=svg.LIMIT, lw=3, alpha=0.5, zorder=0)
    written = str(Fraction(order).limit_denominator(10)).replace("-", "−")
    axes.set_title(f"grey: order {written}", size=9, loc="right")
    axes.set(xscale="log", yscale="log", xlabel=panel.x, ylabel=panel.y)
    axes.margins(x=0.04)


STUDY = Study("extremes.limits", LIMITS, LIMITS, convergence.measured, page, draw)
"""Its runs are few and short: it has no smaller form."""
