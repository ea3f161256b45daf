"""The drawing of the study detection."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from matplotlib.figure import Figure

from comparison.report import svg
from comparison.studies.detection.limits import LEAST, MOST

_MARKS = (("o", svg.FIRST), ("x", svg.SECOND), ("s", svg.DIFFERENCE))


def draw(
    names: Sequence[str], places: Sequence[str], smallest: Sequence[Sequence[float | None]], path: Path
) -> None:
    """Draw the smallest detectable change of each number.

    Parameters
    ----------
    names
        Of the numbers, from the top.
    places
        Where the change was made.
    smallest
        By number and place, relative; None: not even the largest that was tried.
    path
        Of the SVG file.
    """
    with svg.style():
        figure = Figure(figsize=(5.56, 0.9 + 0.26 * len(names)))
        height = 0.26 * len(names) / (0.9 + 0.26 * len(names))
        axes = figure.add_axes((0.33, 0.5 / (0.9 + 0.26 * len(names)), 0.64, height))
        axes.set_xscale("log")
        axes.set_xlim(LEAST, 2.0 * MOST)
        axes.set_ylim(len(names) - 0.5, -0.5)
        axes.set_yticks(range(len(names)), names)
        axes.set_xlabel("smallest detectable relative change")
        for column, (place, (mark, colour)) in enumerate(zip(places, _MARKS, strict=True)):
            known = [(value, at) for at, row in enumerate(smallest) if (value := row[column]) is not None]
            axes.plot(
                [value for value, _ in known],
                [at for _, at in known],
                mark,
                color=colour,
                markerfacecolor="none",
                markersize=5,
                label=place,
            )
        axes.legend(
            loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3, handlelength=1.0, title="change in"
        )
        svg.write_svg(figure, path)
