"""Work against precision: one drawing a scene and measure of work."""

from __future__ import annotations

from math import ceil
from pathlib import Path

import pandas as pd

from comparison.execution.task_store import SUCCESS
from comparison.report import svg
from comparison.studies.tradeoff.front import asymptotic, curve_of, front
from comparison.studies.tradeoff.methods import SWEEPS

_MARKS = ("o", "s", "^", "v", "D", "P", "X")
_DASHES = ((None, None), (4, 1.5), (1, 1.5), (5, 1.5, 1, 1.5))
_COLOURS = {"reference": svg.FIRST, "exudyn": svg.SECOND}


def draw(path: Path, rows: pd.DataFrame, quantity: str, label: str, cost: str, cost_label: str) -> None:
    """Draw cost over error, both logarithmic, a line a method; the number of failures in its label.

    Parameters
    ----------
    path
        Of the SVG file.
    rows
        Of one scene, as `comparison.studies.tradeoff.study.Results` has them.
    quantity, label
        Whose error, and the name of its axis.
    cost, cost_label
        Column of the cost, and the name of its axis.
    """
    sweeps = [sweep for sweep in SWEEPS if sweep.method.name in set(rows["method"])]
    height = 2.9 + 0.17 * ceil((len(sweeps) + 1) / 2)  # a line of the legend is 0.17 inches high
    with svg.panels(path, height=height) as (axes,):
        axes.margins(x=0.03)
        axes.set(xscale="log", yscale="log", xlabel=label, ylabel=cost_label)
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
        axes.invert_xaxis()
        svg.legend_above(axes, 2)
