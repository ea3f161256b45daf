"""The drawing of the study detection."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from comparison.report import svg
from comparison.studies.detection.limits import LEAST, MOST, PLACES
from comparison.studies.detection.results import Results

_MARKS = (("o", svg.FIRST), ("x", svg.SECOND), ("s", svg.DIFFERENCE))


def draw(results: Results, folder: Path) -> None:
    """Draw the smallest detectable change of each number, from the top; none where nothing was detected."""
    smallest = results.smallest
    changes = np.array(list(smallest.values()), dtype=np.float64).T
    with svg.panels(folder / "smallest.svg", height=0.9 + 0.26 * len(smallest)) as (axes,):
        axes.set(xscale="log", xlim=(LEAST, 2.0 * MOST), ylim=(len(smallest) - 0.5, -0.5))
        axes.set_yticks(range(len(smallest)), list(smallest))
        axes.set_xlabel("smallest detectable relative change")
        for place, (mark, colour), x in zip(PLACES, _MARKS, changes, strict=True):
            axes.plot(
                x, range(x.size), mark,
                color=colour, markerfacecolor="none", markersize=5, label=", ".join(place),
            )  # fmt: skip
        svg.legend_above(axes)
