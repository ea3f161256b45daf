"""Maps of the classes: one square a run along the axes, one mark a point of the hypercube; and the errors."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf, log10
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from comparison.report import svg
from comparison.studies.extremes import formulations
from comparison.studies.extremes.cells import BASE_LABEL, HYPERCUBE, UNITS
from comparison.studies.extremes.verdicts import LARGER, Class

SHORT = {
    formulations.MINIMAL.name: "R minimal",
    formulations.IMPLICIT.name: "R LSODA",
    formulations.MULTIPLIERS.name: "R multipliers",
    formulations.TREE.name: "E tree",
    formulations.FULL.name: "E full",
    formulations.INDEX2.name: "E index 2",
}
"""R: reference, E: Exudyn."""
_LOOKS: dict[str, tuple[str, str, str, str]] = {
    Class.CONVERGED: ("o", svg.SERIES[0], svg.SERIES[0], ""),
    Class.ANNOUNCED: ("s", svg.SERIES[1], svg.SERIES[1], ""),
    Class.DEGRADED: ("s", svg.OUTSIDE, svg.OUTSIDE, ""),
    Class.UNCONFIRMED: ("d", svg.SERIES[2], svg.SERIES[2], "?"),
    Class.STOPPED: ("x", svg.LIMIT, svg.INK, "×"),
    Class.REFUSED: ("_", svg.GRID, svg.INK, "–"),
    Class.CRASHED: ("*", svg.INK, svg.INK, ""),
    Class.NONSENSE: ("*", svg.INK, svg.INK, ""),
}
"""Mark, colour of a square and of a mark, sign in a square; the colours of the models are not among them."""
_ROW, _AROUND = 0.135, 1.3
"""Inches: a row of squares; head and legend."""
_ERRORS = {
    formulations.MINIMAL.name: ("o", svg.FIRST),
    formulations.MULTIPLIERS.name: ("+", svg.FIRST),
    formulations.TREE.name: ("^", svg.SECOND),
    formulations.FULL.name: ("x", svg.SECOND),
}
_LEAST = 1e-6
"""Of error over bound: what a logarithmic axis shows of zero."""


def draw(runs: pd.DataFrame, laws: Sequence[str], folder: Path) -> None:
    """Write axes.svg, errors.svg and, where points of the hypercube were run, hypercube.svg."""
    on_axes = runs["axis"] != HYPERCUBE
    _axes(runs[on_axes], laws, folder / "axes.svg")
    if not on_axes.all():
        _hypercube(runs[~on_axes], folder / "hypercube.svg")
    _errors(runs, folder / "errors.svg")


def _axes(runs: pd.DataFrame, laws: Sequence[str], path: Path) -> None:
    """Draw the cells along the axes: a row a cell, a column a formulation, side by side for the laws."""
    cells = runs.loc[runs["law"].isin(laws), ["axis", "value"]].drop_duplicates(ignore_index=True)
    new = ~cells["axis"].duplicated()
    heads = cells["axis"].map(lambda axis: f"{axis} ({UNITS[axis]}):  " if axis in UNITS else f"{axis}:  ")
    runs = runs.merge(cells.assign(row=cells.index)).assign(sign=_sign)
    ran = [set(runs.loc[runs["law"] == law, "formulation"]) for law in laws]
    columns = [[name for name in SHORT if name in names] for names in ran]
    options = {"sharey": True, "width_ratios": [len(names) for names in columns]}
    with svg.panels(path, 1, len(laws), height=_AROUND + _ROW * len(cells), **options) as panels:
        for axes, law, names in zip(panels, laws, columns, strict=True):
            for run in runs[runs["law"] == law].to_dict("records"):
                x, y = names.index(run["formulation"]), run["row"]
                axes.barh(y, 0.94, 0.9, x - 0.47, color=_LOOKS[run["class"]][1], alpha=0.6)
                axes.text(x, y, run["sign"], ha="center", va="center_baseline", size=7)
            titles = [SHORT[name] for name in names]
            axes.set_xticks(range(len(names)), titles, rotation=90, size=7.5)
            axes.set_yticks(cells.index, heads.where(new, "") + cells["value"], size=7.5)
            axes.set_title(law, size=9, loc="left")
            axes.tick_params(top=True, labeltop=True, bottom=False, labelbottom=False, length=0)
            axes.grid(visible=False)
            axes.hlines(np.flatnonzero(new)[1:] - 0.5, -0.5, len(names) - 0.5, color=svg.LIMIT, lw=0.5)
        for kind, (_, colour, _, _) in _LOOKS.items():
            if (runs["class"] == kind).any():
                label = f"{kind} by 10ⁿ" if kind in LARGER else str(kind)
                panels[0].scatter([], [], marker="s", s=50, color=colour, alpha=0.6, label=label)
        panels[0].set_ylim(len(cells) - 0.5, -0.5)
        svg.legend_above(panels[0])


def _sign(runs: pd.DataFrame) -> list[str]:
    """Return what stands in the squares: of an error above its bound the power of ten of their ratio."""
    ratios = runs["error_m"] / runs["bound_m"]
    powers = [f"{round(log10(ratio))}" if 0.0 < ratio < inf else "!" for ratio in ratios]
    return [
        power if kind in LARGER else _LOOKS[kind][3]
        for kind, power in zip(runs["class"], powers, strict=True)
    ]


def _hypercube(runs: pd.DataFrame, path: Path) -> None:
    """Draw the points of the hypercube, a panel a formulation: modulus over speed."""
    look: dict[str, Any] = {"ms": 3.5, "mew": 0.9, "mfc": "none"}
    occurring = [(kind, _LOOKS[kind]) for kind in Class if (runs["class"] == kind).any()]
    with svg.panels(path, 2, 2, height=5.0, sharex=True, sharey=True) as panels:
        for axes, name in zip(panels, _ERRORS, strict=True):
            for kind, (mark, _, colour, _) in occurring:
                of = runs[(runs["formulation"] == name) & (runs["class"] == kind)]
                axes.plot(of["speed"], of["modulus"], mark, color=colour, label=str(kind), **look)
            axes.margins(0.03)
            axes.set_title(SHORT[name], size=9, loc="left")
        panels[0].set(xscale="log", yscale="log")
        for axes in panels[2:]:
            axes.set_xlabel("speed (rpm)")
        for axes in panels[::2]:
            axes.set_ylabel("Young's modulus (Pa)")
        svg.legend_above(panels[0])


def _errors(runs: pd.DataFrame, path: Path) -> None:
    """Draw error over bound against how much the scene magnifies, a mark a run."""
    ratio = runs["error_m"] / runs["bound_m"]
    known = runs.assign(ratio=ratio.clip(lower=_LEAST))[(runs["magnification"] > 0) & np.isfinite(ratio)]
    base = runs.loc[runs["value"] == BASE_LABEL, "magnification"].iloc[0] or 1.0
    with svg.panels(path, height=3.2) as (axes,):
        for name, (mark, colour) in _ERRORS.items():
            of = known[known["formulation"] == name]
            look: dict[str, Any] = {"color": colour, "ms": 3.5, "mfc": "none", "mew": 0.8}
            axes.plot(of["magnification"], of["ratio"], mark, label=SHORT[name], **look)
        axes.set(xscale="log", yscale="log", ylabel="error / error bound")
        axes.margins(x=0.03, y=0.03)
        ends = np.array(axes.get_xlim())
        line: dict[str, Any] = {"color": svg.DIFFERENCE, "dashes": (4, 2), "lw": 0.9}
        axes.plot(ends, ends / base, label="as the scene magnifies", **line)
        axes.axhline(1.0, color=svg.THRESHOLD, lw=0.8)
        axes.set_xlabel("distance of two starts after a cycle, over that at its start")
        svg.legend_above(axes, 3)
