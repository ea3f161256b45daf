"""The figure of the study ensembles."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from comparison.report import svg
from comparison.tables.arrays import Array

ROUND_OFF = 1e-16
"""m; of a coordinate of 0.55 m."""


def draw(path: Path, cycles: Array, a: Array, b: Array, predictable: float) -> None:
    """Draw the medians of both ensembles, and how far their runs scatter.

    Parameters
    ----------
    cycles
        Time in crank cycles, shape (n,).
    a, b
        5, 50 and 95 % quantiles of x, m, shape (3, n), of the reference and of Exudyn.
    predictable
        The scatter, m, below which single runs can be compared.
    """
    middle = 0.5 * float(a.max() + a.min())
    with svg.panels(path, 2, height=4.4, sharex=True) as (upper, lower):
        for bands, colour, dashes, label in (
            (a, svg.FIRST, (None, None), "reference"),
            (b, svg.SECOND, (4, 2), "Exudyn"),
        ):
            upper.plot(cycles, 1e3 * (bands[1] - middle), color=colour, dashes=dashes, label=label)
            width = np.maximum(bands[2] - bands[0], ROUND_OFF)  # zero has no logarithm
            lower.semilogy(cycles, 1e3 * width, color=colour, dashes=dashes)
        lower.axhline(1e3 * predictable, color=svg.LIMIT, dashes=(1, 2))
        upper.plot([], [], label="predictable below", color=svg.LIMIT, dashes=(1, 2))
        upper.set_ylabel("median of x (mm)")
        lower.set(xlabel="time (cycles)", ylabel="95 % − 5 % quantile of x (mm)")
        svg.legend_above(upper)
