"""The drawings of the study contact-laws."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from comparison.report import svg
from comparison.report.decimate import envelope, upper_envelope
from comparison.tables.table import Table

REVERSAL = (0.195, 0.235)
"""s; the bottom dead centre is at 0.2144 s."""
_LINES: tuple[dict[str, Any], ...] = (
    {"color": svg.FIRST, "lw": 1.6},
    {"color": svg.SECOND, "lw": 1.4, "dashes": (3.5, 1.8)},
    {"color": svg.BEYOND},
    {"color": svg.DIFFERENCE, "dashes": (1, 1)},
)
_LEAST = 1e-14
"""J: below round-off of the energies; what a logarithmic axis shows of zero."""


def draw(laws: Mapping[str, Table | None], literal: Mapping[float, Table | None], folder: Path) -> None:
    """Write energy.svg, tolerances.svg and slider_x.svg.

    Parameters
    ----------
    laws
        Law -> its run; one that stopped is not drawn.
    literal
        Tolerance -> run under paper-switching.
    folder
        Where to.
    """
    with svg.style():
        _energy(laws, folder / "energy.svg")
        _energy({f"{tolerance:.0e}": run for tolerance, run in literal.items()}, folder / "tolerances.svg")
        figure, axes = _axes()
        for (law, run), line in zip(laws.items(), _LINES, strict=False):
            if run is not None:
                inside = (run.time >= REVERSAL[0]) & (run.time <= REVERSAL[1])
                guide = run.provenance["scene"]["mechanism"]["guide_x"]
                time, x = run.time[inside], 1e3 * (run.values("slider_x")[inside] - guide)
                kept = envelope(x)
                axes.plot(time[kept], x[kept], label=law, **line)
        axes.set_ylabel("x − guide (mm)")
        _finish(axes, figure, folder / "slider_x.svg")


def _energy(runs: Mapping[str, Table | None], path: Path) -> None:
    figure, axes = _axes()
    axes.set_yscale("log")
    for (label, run), line in zip(runs.items(), _LINES, strict=False):
        if run is None:
            axes.plot([], [], label=f"{label}: stopped", **line)
            continue
        size = np.maximum(np.abs(run.values("energy_residual")), _LEAST)
        kept = upper_envelope(size)
        axes.plot(run.time[kept], size[kept], label=label, **line)
    axes.set_ylabel("|energy from nowhere| (J)")
    _finish(axes, figure, path)


def _axes() -> tuple[Figure, Axes]:
    figure = Figure(figsize=(5.56, 3.0))
    axes = figure.add_axes((0.135, 0.14, 0.83, 0.74))
    axes.spines[["top", "right"]].set_visible(False)
    axes.set_xlabel("time (s)")
    return figure, axes


def _finish(axes: Axes, figure: Figure, path: Path) -> None:
    axes.legend(loc="lower left", bbox_to_anchor=(0, 1.01), ncols=4)
    svg.write_svg(figure, path)
