"""Maps of the classes: one square a run along the axes, one mark a point of the hypercube; and the errors."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from math import inf, log10
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from comparison.report import svg
from comparison.studies.extremes.cells import BASE_LABEL, HYPERCUBE
from comparison.studies.extremes.formulations import (
    FULL,
    IMPLICIT,
    INDEX2,
    MINIMAL,
    MULTIPLIERS,
    NATIVE,
    TREE,
)
from comparison.studies.extremes.verdicts import Class

SHORT = {
    MINIMAL.name: "R minimal",
    IMPLICIT.name: "R LSODA",
    MULTIPLIERS.name: "R multipliers",
    TREE.name: "E tree",
    FULL.name: "E full",
    INDEX2.name: "E index 2",
    NATIVE.name: "E own contact",
}
"""R: reference, E: Exudyn."""
_LOOKS = {
    Class.CONVERGED: ("o", svg.SHADE, svg.LIMIT, ""),
    Class.DEGRADED: ("s", svg.BEYOND, svg.BEYOND, ""),
    Class.UNCONFIRMED: ("d", svg.GRID, svg.THRESHOLD, "?"),
    Class.STOPPED: ("x", svg.LIMIT, svg.INK, "×"),
    Class.REFUSED: ("_", svg.GRID, svg.INK, "–"),
    Class.CRASHED: ("*", svg.INK, svg.INK, ""),
    Class.NONSENSE: ("*", svg.INK, svg.INK, ""),
}
"""Mark, colour of a square and of a mark, sign in a square; the colours of the models are not among them."""
_ROW, _AROUND = 0.135, 1.3
"""Inches: a row of squares; head and legend."""
_ERRORS = {
    MINIMAL.name: ("o", svg.FIRST),
    MULTIPLIERS.name: ("+", svg.FIRST),
    TREE.name: ("^", svg.SECOND),
    FULL.name: ("x", svg.SECOND),
}
_LEAST = 1e-6
"""Of error over bound: what a logarithmic axis shows of zero."""


def draw(runs: pd.DataFrame, laws: Sequence[str], folder: Path) -> None:
    """Write axes.svg, hypercube.svg and errors.svg."""
    _axes(runs[runs["axis"] != HYPERCUBE], laws, folder / "axes.svg")
    _hypercube(runs[runs["axis"] == HYPERCUBE], folder / "hypercube.svg")
    _errors(runs, folder / "errors.svg")


def _axes(runs: pd.DataFrame, laws: Sequence[str], path: Path) -> None:
    """Draw the cells along the axes: a row a cell, a column a formulation, side by side for the laws."""
    cells = runs.loc[runs["law"].isin(laws), ["axis", "value"]].drop_duplicates(ignore_index=True)
    rows = {tuple(cell): row for row, cell in enumerate(cells.to_numpy().tolist())}
    new = ~cells["axis"].duplicated()
    labels = [
        f"{axis}:  {value}" if first else value
        for axis, value, first in zip(*cells.T.to_numpy(), new, strict=True)
    ]
    columns = [
        [name for name in SHORT if name in set(runs.loc[runs["law"] == law, "formulation"])] for law in laws
    ]
    options = {"sharey": True, "width_ratios": [len(names) for names in columns]}
    with svg.panels(path, 1, len(laws), height=_AROUND + _ROW * len(rows), **options) as panels:
        for axes, law, names in zip(panels, laws, columns, strict=True):
            mine = runs[runs["law"] == law]
            x = mine["formulation"].map({name: column for column, name in enumerate(names)}).astype(int)
            y = pd.Series(
                [rows[tuple(cell)] for cell in mine[["axis", "value"]].to_numpy().tolist()], mine.index
            )
            _squares(axes, mine, x, y, set(runs["class"]))
            axes.set_xticks(
                range(len(names)), [SHORT[name] for name in names], rotation=60, ha="left", size=7
            )
            axes.set_yticks(range(len(rows)), labels, size=7.5)
            axes.set_title(law, size=9)
            axes.tick_params(top=True, labeltop=True, bottom=False, labelbottom=False, length=0)
            axes.grid(visible=False)
            axes.hlines(np.flatnonzero(new)[1:] - 0.5, -0.5, len(names) - 0.5, color=svg.LIMIT, lw=0.5)
        panels[0].set_ylim(len(rows) - 0.5, -0.5)
        svg.legend_above(panels[0], 5)


def _squares(
    axes: Axes, runs: pd.DataFrame, x: pd.Series[int], y: pd.Series[int], kinds: Collection[str]
) -> None:
    """Draw a square a run; in a degraded one the power of ten of error over bound."""
    ratio = runs["error_m"] / runs["bound_m"]
    for kind, (_, colour, _, sign) in _LOOKS.items():
        of = runs["class"] == kind
        if kind in kinds:
            label = f"{kind} by 10ⁿ" if kind is Class.DEGRADED else str(kind)
            axes.barh(y[of], 0.94, 0.9, x[of] - 0.47, color=colour, alpha=0.6, label=label)
        for at in runs.index[of]:
            power = f"{round(log10(ratio[at]))}" if 0.0 < ratio[at] < inf else "!"
            axes.text(
                x[at],
                y[at],
                power if kind is Class.DEGRADED else sign,
                ha="center",
                va="center_baseline",
                size=7,
            )


def _hypercube(runs: pd.DataFrame, path: Path) -> None:
    """Draw the points of the hypercube, a panel a formulation: modulus over speed."""
    keys = runs["scene"].str.extract(r"drive\.speed_rpm=(?P<speed>\S+).*youngs_modulus=(?P<modulus>\S+)")
    points = pd.concat([runs, keys.astype(float)], axis=1)
    with svg.panels(path, 2, 2, height=5.0, sharex=True, sharey=True) as panels:
        for axes, name in zip(panels, _ERRORS, strict=True):
            for kind, (mark, _, colour, _) in _LOOKS.items():
                of = points[(points["formulation"] == name) & (points["class"] == kind)]
                if (points["class"] == kind).any():
                    axes.plot(
                        of["speed"],
                        of["modulus"],
                        mark,
                        color=colour,
                        ms=3.5,
                        mew=0.9,
                        mfc="none",
                        label=str(kind),
                    )
            axes.set_title(SHORT[name], size=9, loc="left")
        panels[0].set(xscale="log", yscale="log")
        panels[0].margins(0.03)
        for axes in panels[2:]:
            axes.set_xlabel("speed (rpm)")
        for axes in panels[::2]:
            axes.set_ylabel("modulus (Pa)")
        svg.legend_above(panels[0], 5)


def _errors(runs: pd.DataFrame, path: Path) -> None:
    """Draw error over bound against how much the scene magnifies, a mark a run."""
    ratio = runs["error_m"] / runs["bound_m"]
    known = runs.assign(ratio=ratio.clip(lower=_LEAST))[(runs["magnification"] > 0) & np.isfinite(ratio)]
    base = runs.loc[runs["value"] == BASE_LABEL, "magnification"].iloc[0] or 1.0
    with svg.panels(path, height=3.2) as (axes,):
        for name, (mark, colour) in _ERRORS.items():
            of = known[known["formulation"] == name]
            axes.plot(
                of["magnification"],
                of["ratio"],
                mark,
                color=colour,
                ms=3.5,
                mfc="none",
                mew=0.8,
                label=SHORT[name],
            )
        axes.set(xscale="log", yscale="log")
        axes.margins(x=0.03, y=0.03)
        ends = np.array(axes.get_xlim())
        axes.plot(
            ends, ends / base, color=svg.DIFFERENCE, dashes=(4, 2), lw=0.9, label="as the scene magnifies"
        )
        axes.axhline(1.0, color=svg.THRESHOLD, lw=0.8)
        axes.set_xlabel("distance of two starts after a cycle, over that at its start")
        axes.set_ylabel("error / error bound")
        svg.legend_above(axes, 3)
