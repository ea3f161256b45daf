"""The drawing of the study ensembles."""

from __future__ import annotations

from pathlib import Path

from matplotlib.figure import Figure

from comparison.report import svg
from comparison.verdict import Array


def draw(folder: Path, turns: Array, a: Array, b: Array, clearance: float) -> None:
    """Write slider_x.svg: medians of both ensembles, and nine tenths of their runs.

    Parameters
    ----------
    folder
        Where to.
    turns
        Crank turns, shape (n,).
    a, b
        5, 50 and 95 % quantiles of x, m, shape (3, n).
    clearance
        Of the slider, m: the unit of the drawing.
    """
    middle = 0.5 * float(a.max() + a.min())
    with svg.style():
        figure = Figure(figsize=(5.56, 3.75))
        axes_of_both = figure.subplots(2, sharex=True)
        for axes, bands, colour, label in zip(
            axes_of_both, (a, b), (svg.FIRST, svg.SECOND), ("reference", "Exudyn"), strict=True
        ):
            low, median, high = (1e3 * (band - middle) for band in bands)
            axes.fill_between(turns, low, high, color=svg.SHADE, linewidth=0, label="nine tenths of the runs")
            axes.plot(turns, median, color=colour, label=f"{label}, median")
            axes.set_ylabel("x (mm)")
            axes.set_ylim(-1.15e3 * clearance, 1.15e3 * clearance)
            axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2)
        axes_of_both[1].set_xlabel("crank turns")
        figure.subplots_adjust(left=0.12, right=0.97, bottom=0.12, top=0.92, hspace=0.3)
        svg.write_svg(figure, folder / "slider_x.svg")
