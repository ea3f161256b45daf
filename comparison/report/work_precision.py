"""Work-precision plot of the settings of both models on one scene."""

from __future__ import annotations

from pathlib import Path

from matplotlib.ticker import LogLocator

from comparison.accuracy.work_precision import WorkPrecision
from comparison.models import MODELS
from comparison.report import svg

_MARKS = {"minimal": "o", "multiplier": "s", "tree": "^", "full": "D"}


def draw(found: WorkPrecision, path: Path) -> Path:
    """Draw processor time over error, both logarithmic: a line a formulation, and the Pareto front behind.

    Runs without a result, or without an error, are not drawn.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    with svg.panels(path) as (axes,):
        axes.set(
            xscale="log", yscale="log", xlabel="largest error of slider x (m)", ylabel="processor time (s)"
        )
        front = [(found.error(row), row.seconds) for row in found.front if found.error(row) > 0.0]
        if front:
            axes.plot(*zip(*front, strict=True), color=svg.SHADE, lw=5, label="Pareto front")
        for formulation, mark in _MARKS.items():
            rows = [row for row in found.rows if row.candidate.formulation == formulation]
            points = [(found.error(row), row.seconds) for row in rows if found.error(row) > 0.0]
            if points:
                points.sort(key=lambda point: point[1])
                model = rows[0].candidate.model
                colour = svg.FIRST if model == MODELS[0] else svg.SECOND
                label = f"{model}, {formulation}"
                axes.plot(
                    *zip(*points, strict=True), color=colour, marker=mark, mfc="none", ms=4, label=label
                )
        axes.margins(0.04)  # the outermost marks whole
        axes.xaxis.set_major_locator(LogLocator(numticks=6))
        axes.invert_xaxis()
        svg.legend_above(axes, columns=2)
    return path
