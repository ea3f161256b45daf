"""The drawings of Baumgarte's gains: steps against theory, and a map of the drift."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.colors import LinearSegmentedColormap, LogNorm
from matplotlib.figure import Figure

from comparison.formatting import decade
from comparison.report import svg
from comparison.studies.extremes.baumgarte import GAINS, MAPPED, SCENES, TOLERANCES, Run, pick
from comparison.studies.extremes.explicit import limit

_LOOKS = (("o", svg.FIRST), ("s", svg.SECOND))
_DASHES = ((None, None), (4, 1.5), (1, 1.5))
_SHOWN = [gain for gain in GAINS if gain]


def draw(found: Sequence[Run], folder: Path) -> None:
    """Write baumgarte_steps.svg and baumgarte_drift.svg."""
    with svg.style():
        _steps(found, folder / "baumgarte_steps.svg")
        _drift(found, folder / "baumgarte_drift.svg")


def _steps(found: Sequence[Run], path: Path) -> None:
    figure = Figure(figsize=(5.56, 3.9))
    axes = figure.add_axes((0.125, 0.115, 0.85, 0.63))
    axes.set(xscale="log", yscale="log", xlabel="alpha = beta (1/s)", ylabel="mean step (s)")
    axes.margins(x=0.03)
    for name, (mark, colour) in zip(SCENES, _LOOKS, strict=True):
        for tolerance, dashes in zip(TOLERANCES, _DASHES, strict=True):
            runs = [
                run
                for run in pick(found, scene=name, tolerance=tolerance, turns=1.0)
                if run.alpha == run.beta and run.alpha > 0
            ]
            axes.plot(
                [run.alpha for run in runs], [run.mean_step for run in runs],
                mark, ls="-", color=colour, dashes=dashes, mfc="none", ms=4,
                label=f"{name}, {tolerance:.0e}",
            )  # fmt: skip
    line = np.array([limit(-1.0) / 0.02, GAINS[-1]])
    axes.plot(
        line, limit(-1.0) / line, color=svg.LIMIT, lw=2.5, alpha=0.6, zorder=0, label="theory: S / alpha"
    )
    axes.legend(loc="lower left", bbox_to_anchor=(-0.1, 1.01), ncols=2)
    svg.write_svg(figure, path)


def _drift(found: Sequence[Run], path: Path) -> None:
    figure = Figure(figsize=(5.56, 3.2))
    shades = LinearSegmentedColormap.from_list("drift", ["#ffffff", "#5a3d8a"])
    norm = LogNorm(1e-14, 1e-4)
    labels = ["0", *(decade(gain) for gain in _SHOWN)]
    for k, name in enumerate(SCENES):
        axes = figure.add_axes((0.11 + 0.46 * k, 0.16, 0.41, 0.68))
        runs = pick(found, scene=name, tolerance=MAPPED, turns=1.0)
        values = np.reshape([run.position for run in runs], (len(GAINS), len(GAINS)))
        axes.grid(visible=False)
        for row in range(len(GAINS)):
            for column in range(len(GAINS)):
                value = float(values[row, column])
                axes.fill_between(
                    (column - 0.5, column + 0.5), row - 0.5, row + 0.5, color=shades(norm(value)), lw=0
                )
                light = value < 1e-8
                axes.text(
                    column, row, f"{np.log10(value):.0f}".replace("-", "−"), ha="center", va="center",
                    color="#000000" if light else "#ffffff", size=8,
                )  # fmt: skip
        axes.set_xticks(range(len(GAINS)), labels)
        axes.set_yticks(range(len(GAINS)), labels if k == 0 else [""] * len(GAINS))
        axes.set_xlabel("beta (1/s)")
        axes.set_title(name, size=9)
        axes.set_ylim(-0.5, len(GAINS) - 0.5)
        if k == 0:
            axes.set_ylabel("alpha (1/s)")
    figure.text(0.11, 0.945, "log₁₀ of the largest Φ (m) over one turn", size=9)
    svg.write_svg(figure, path)
