"""The drawings of the study contact-laws."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from comparison.report import svg
from comparison.report.svg import envelope, upper_envelope
from comparison.tables.table import Table

REVERSAL = (0.195, 0.235)
"""s; the bottom dead centre is at 0.2144 s."""
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
    _energy(laws, folder / "energy.svg")
    _energy({f"{tolerance:.0e}": run for tolerance, run in literal.items()}, folder / "tolerances.svg")
    with svg.panels(folder / "slider_x.svg") as (axes,):
        for (law, run), line in zip(laws.items(), svg.SERIES_LINES, strict=False):
            if run is not None:
                inside = (run.time >= REVERSAL[0]) & (run.time <= REVERSAL[1])
                guide = run.provenance["scene"]["mechanism"]["guide_x"]
                time, x = run.time[inside], 1e3 * (run.values("slider_x")[inside] - guide)
                kept = envelope(x)
                axes.plot(time[kept], x[kept], label=law, **line)
        axes.set(xlabel="time (s)", ylabel="slider x − guide (mm)")
        svg.legend_above(axes)


def _energy(runs: Mapping[str, Table | None], path: Path) -> None:
    with svg.panels(path) as (axes,):
        for (label, run), line in zip(runs.items(), svg.SERIES_LINES, strict=False):
            if run is None:
                axes.plot([], [], label=f"{label}: stopped", **line)
                continue
            size = np.maximum(np.abs(run.values("energy_residual")), _LEAST)
            kept = upper_envelope(size)
            axes.plot(run.time[kept], size[kept], label=label, **line)
        axes.set(xlabel="time (s)", ylabel="|spurious energy| (J)", yscale="log")
        svg.legend_above(axes)
