"""Work against precision: one drawing a scene and measure of work."""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil
from pathlib import Path

import pandas as pd
from matplotlib.axes import Axes

from comparison.execution.task_store import SUCCESS
from comparison.report import svg
from comparison.studies.tradeoff.front import asymptotic, curve_of, front
from comparison.studies.tradeoff.measure import QUANTITIES
from comparison.studies.tradeoff.methods import CHIEF, SCENES, SWEEPS, Sweep

COSTS = {"seconds": "processor time (s)", "evaluations": "evaluations of the equations"}
"""Columns of the cost, and the names of their axes."""
_MARKS = ("o", "s", "^", "v", "D", "P", "X")
_DASHES = ((None, None), (4, 1.5), (1, 1.5), (5, 1.5, 1, 1.5))
_COLOURS = {"reference": svg.FIRST, "exudyn": svg.SECOND}


def draw(rows: pd.DataFrame, folder: Path) -> None:
    """Draw cost over error, both logarithmic, for each scene and kind of cost."""
    for scene in SCENES:
        of_scene = rows[rows["scene"] == scene]
        sweeps = [sweep for sweep in SWEEPS if sweep.method.name in set(of_scene["method"])]
        height = 2.9 + 0.17 * ceil((len(sweeps) + 1) / 2)  # a line of the legend is 0.17 inches high
        words, unit = QUANTITIES[CHIEF[scene]]
        for cost, cost_label in COSTS.items():
            with svg.panels(folder / f"{scene}-{cost}.svg", height=height) as (axes,):
                axes.margins(x=0.03)
                axes.set(xscale="log", yscale="log", xlabel=f"{words} ({unit})" if unit else words)
                axes.set_ylabel(cost_label)
                _draw_methods(axes, of_scene, sweeps, CHIEF[scene], cost)
                axes.invert_xaxis()
                svg.legend_above(axes, 2)


def _draw_methods(axes: Axes, rows: pd.DataFrame, sweeps: Sequence[Sweep], quantity: str, cost: str) -> None:
    """Draw a line a method, with the number of failures in its label, and the Pareto front."""
    count = dict.fromkeys(_COLOURS, 0)
    for sweep in sweeps:
        model, name = sweep.method.model, sweep.method.name.replace(" (five bodies)", "")
        failed = ((rows["method"] == sweep.method.name) & (rows["status"] != SUCCESS)).sum()
        curve = curve_of(rows, sweep, quantity, cost)
        shown = curve[curve["error"] > 0]
        firm = curve[asymptotic(curve, sweep.order, quantity) & (curve["error"] > 0)]
        mark = _MARKS[count[model] % len(_MARKS)]
        axes.plot(
            shown["error"], shown["cost"], color=_COLOURS[model], marker=mark, mfc="none", ms=4, lw=0.9,
            dashes=_DASHES[count[model] % len(_DASHES)],
            label=f"{model[0].upper()}: {name}" + (f" (-{failed})" if failed else ""),
        )  # fmt: skip
        axes.plot(firm["error"], firm["cost"], mark, color=_COLOURS[model], ms=4)
        count[model] += 1
    best = front(rows.rename(columns={f"errors.{quantity}": "error", cost: "cost"}))
    axes.plot(best["error"], best["cost"], color=svg.SHADE, lw=5, zorder=0, label="Pareto front")
