"""Work against precision: one drawing a scene and measure of work."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from textwrap import fill

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.ticker import LogLocator

from comparison.execution.tasks import SUCCESS
from comparison.models import MODELS
from comparison.report import svg
from comparison.studies.tradeoff.front import asymptotic, curve_of, front
from comparison.studies.tradeoff.measure import QUANTITIES
from comparison.studies.tradeoff.methods import CHIEF, SCENES, SWEEPS, Sweep

COSTS = {"seconds": "processor time (s)", "evaluations": "evaluations of the equations"}
"""Columns of the cost, and the names of their axes."""
_MARKS = ("o", "s", "^", "v", "D", "P", "X")
_COLOURS = (*svg.SERIES, svg.INK)
"""Of the methods of a model, each of which has a panel of its own."""
_LEGEND = 0.19
"""Inches: a line of a legend."""


def draw(rows: pd.DataFrame, folder: Path) -> None:
    """Draw cost over error, both logarithmic, for each scene and kind of cost, a panel a model."""
    for scene in SCENES:
        of_scene = rows[rows["scene"] == scene]
        methods = set(of_scene["method"])
        sweeps = {
            model: [s for s in SWEEPS if s.method.model == model and s.method.name in methods]
            for model in MODELS
        }
        words, unit = QUANTITIES[CHIEF[scene]]
        height = 2.9 + _LEGEND * (1 + max(map(len, sweeps.values())))
        for cost, cost_label in COSTS.items():
            best = front(of_scene.rename(columns={f"errors.{CHIEF[scene]}": "error", cost: "cost"}))
            path = folder / f"{scene}-{cost}.svg"
            with svg.panels(path, 1, len(MODELS), height=height, sharex=True, sharey=True) as panels:
                for axes, model in zip(panels, MODELS, strict=True):
                    axes.margins(x=0.05)
                    axes.set(xscale="log", yscale="log", xlabel=fill(f"{words} ({unit or '-'})", 34))
                    axes.plot(
                        best["error"], best["cost"], color=svg.SHADE, lw=5, label="Pareto front of both"
                    )
                    _draw_methods(axes, of_scene, sweeps[model], CHIEF[scene], cost)
                    axes.xaxis.set_major_locator(LogLocator(numticks=6))
                    axes.set_title(model, fontsize=9)
                    axes.legend(loc="upper left", bbox_to_anchor=(-0.4, 0.0), borderaxespad=5.0)
                panels[0].invert_xaxis()  # shared by both
                panels[0].set_ylabel(cost_label)


def _draw_methods(axes: Axes, rows: pd.DataFrame, sweeps: Sequence[Sweep], quantity: str, cost: str) -> None:
    """Draw a line a method, with the number of failures in its label."""
    for sweep, mark, colour in zip(sweeps, _MARKS, _COLOURS, strict=False):
        failed = ((rows["method"] == sweep.method.name) & (rows["status"] != SUCCESS)).sum()
        curve = curve_of(rows, sweep, quantity, cost)
        shown = curve[curve["error"] > 0]
        firm = curve[asymptotic(curve, sweep.order, quantity) & (curve["error"] > 0)]
        label = sweep.method.name.replace(" (five bodies)", "") + (f" (-{failed})" if failed else "")
        axes.plot(
            shown["error"], shown["cost"], color=colour, marker=mark, mfc="none", ms=4, lw=0.9, label=label
        )
        axes.plot(firm["error"], firm["cost"], mark, color=colour, ms=4)
