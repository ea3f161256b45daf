"""The drawing of the study detection."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from comparison.report import svg
from comparison.studies.detection.limits import LEAST, MOST

_MARKS = (("o", svg.FIRST), ("x", svg.SECOND), ("s", svg.DIFFERENCE))


def draw_smallest(places: Sequence[str], smallest: Mapping[str, Sequence[float | None]], path: Path) -> None:
    """Draw the smallest detectable change of each number.

    Parameters
    ----------
    places
        Where the change was made.
    smallest
        Of each number, from the top, one a place, relative; None: not even the largest that was tried.
    path
        Of the SVG file.
    """
    with svg.panels(path, height=0.9 + 0.26 * len(smallest)) as (axes,):
        axes.set(xscale="log", xlim=(LEAST, 2.0 * MOST), ylim=(len(smallest) - 0.5, -0.5))
        axes.set_yticks(range(len(smallest)), list(smallest))
        axes.set_xlabel("smallest detectable relative change")
        for column, (place, (mark, colour)) in enumerate(zip(places, _MARKS, strict=True)):
            values = [row[column] for row in smallest.values()]
            known = [(value, at) for at, value in enumerate(values) if value is not None]
            x, y = [value for value, _ in known], [at for _, at in known]
            axes.plot(x, y, mark, color=colour, markerfacecolor="none", markersize=5, label=place)
        svg.legend_above(axes)
