"""Work against precision: one drawing a scene and measure of work."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import ceil
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from comparison.report import svg
from comparison.studies.tradeoff.front import Point, front

_MARKS = ("o", "s", "^", "v", "D", "P", "X")
_SHORT = {"reference": "R", "exudyn": "E"}
_DASHES = ((None, None), (4, 1.5), (1, 1.5), (5, 1.5, 1, 1.5))


def draw(
    path: Path,
    curves: Mapping[tuple[str, str], Sequence[Point]],
    firm: Mapping[tuple[str, str], Sequence[bool]],
    *,
    error: str,
    cost: str,
    failed: Mapping[tuple[str, str], int],
) -> None:
    """Draw cost over error, both logarithmic, a line a method.

    Parameters
    ----------
    path
        Of the SVG file.
    curves
        (Model, method) -> its points, coarsest first.
    firm
        Which of them are asymptotic: filled; the others are hollow.
    error, cost
        Labels of the axes.
    failed
        How many settings gave no result: told in the legend, in brackets.
    """
    with svg.style():
        legend = 0.2 * ceil((len(curves) + 1) / 2)  # inches: two columns, the front below the methods
        height = legend + 3.45
        figure = Figure(figsize=(5.56, height))
        axes = figure.add_axes((0.125, (legend + 0.55) / height, 0.845, 2.8 / height))
        axes.margins(x=0.03)
        axes.set_xscale("log")
        axes.set_yscale("log")
        count = {"reference": 0, "exudyn": 0}
        everything: list[Point] = []
        for (model, method), points in curves.items():
            number = count[model]
            count[model] += 1
            shown = [point for point in points if point.error > 0]
            everything += shown
            lost = failed.get((model, method), 0)
            label = f"{_SHORT[model]}: {method}" + (f" (-{lost})" if lost else "")
            _line(axes, shown, svg.FIRST if model == "reference" else svg.SECOND, number, label)
            solid = [p for p, good in zip(points, firm[model, method], strict=True) if good and p.error > 0]
            axes.plot(
                [p.error for p in solid],
                [p.cost for p in solid],
                _MARKS[number % len(_MARKS)],
                color=svg.FIRST if model == "reference" else svg.SECOND,
                ms=4,
            )
        best = front(everything)
        axes.plot(
            [p.error for p in best], [p.cost for p in best], color=svg.SHADE, lw=5, alpha=0.35, zorder=0,
            label="Pareto front",
        )  # fmt: skip
        axes.invert_xaxis()
        axes.set_xlabel(error)
        axes.set_ylabel(cost)
        figure.legend(
            loc="lower left",
            bbox_to_anchor=(0.09, 0),
            ncols=2,
            handlelength=2.2,
            columnspacing=0.9,
            handletextpad=0.5,
        )
        svg.write_svg(figure, path)


def _line(axes: Axes, points: Sequence[Point], colour: str, number: int, label: str) -> None:
    axes.plot(
        [point.error for point in points],
        [point.cost for point in points],
        color=colour,
        marker=_MARKS[number % len(_MARKS)],
        markerfacecolor="none",
        ms=4,
        lw=0.9,
        dashes=_DASHES[number % len(_DASHES)],
        label=label,
    )
