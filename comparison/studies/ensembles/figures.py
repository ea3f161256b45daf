"""The drawing of the study ensembles."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from comparison.report import svg
from comparison.tables.arrays import Array

ROUND_OFF = 1e-16
"""m; of a coordinate of 0.55 m."""


def draw(folder: Path, turns: Array, a: Array, b: Array, predictable: float) -> None:
    """Write slider_x.svg: the medians of both ensembles, and how far their runs scatter.

    Parameters
    ----------
    folder
        Where to.
    turns
        Crank turns, shape (n,).
    a, b
        5, 50 and 95 % quantiles of x, m, shape (3, n).
    predictable
        The scatter, m, below which single runs can be compared.
    """
    middle = 0.5 * float(a.max() + a.min())
    with svg.style():
        figure = Figure(figsize=(5.56, 4.2))
        upper, lower = figure.subplots(2, sharex=True)
        for bands, colour, dashes, label in (
            (a, svg.FIRST, (None, None), "reference"),
            (b, svg.SECOND, (4, 2), "Exudyn"),
        ):
            upper.plot(turns, 1e3 * (bands[1] - middle), color=colour, dashes=dashes, label=label)
            width = np.maximum(bands[2] - bands[0], ROUND_OFF)  # zero has no logarithm
            lower.semilogy(turns, 1e3 * width, color=colour, dashes=dashes)
        lower.axhline(1e3 * predictable, color=svg.LIMIT, dashes=(1, 2), label="predictable below")
        upper.set_ylabel("median of x (mm)")
        lower.set_ylabel("95 % - 5 % quantile (mm)")
        lower.set_xlabel("crank turns")
        for axes in (upper, lower):
            axes.yaxis.set_label_coords(-0.11, 0.5)
            axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2)
        figure.subplots_adjust(left=0.14, right=0.97, bottom=0.11, top=0.93, hspace=0.28)
        svg.write_svg(figure, folder / "slider_x.svg")
