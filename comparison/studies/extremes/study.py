"""The study extremes: class of each comparison, page, figures, and the table beside the page."""

from collections.abc import Mapping, Sequence
from enum import StrEnum
from math import log10
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd

from comparison.execution.run import Progress
from comparison.execution.store import Row
from comparison.execution.tasks import CRASHED, SUCCESS
from comparison.formatting import decade
from comparison.models import MODELS
from comparison.report import svg
from comparison.scene import SceneError
from comparison.studies.extremes.cells import (
    AXES,
    HYPERCUBE,
    LONG_LIMIT,
    PAIRS,
    SHORT_LIMIT,
    UNITS,
    USUAL,
    Cell,
    cells,
)
from comparison.studies.extremes.runs import CUT_OFF, LIMIT, PairRun, both, run_pairs
from comparison.studies.shared.study import Study, curves, markdown, part, write_csv


class Class(StrEnum):
    """Classes of a comparison, as the page explains them; of the last two there must be none."""

    AGREE = "agree"
    INDETERMINATE = "indeterminate"
    DIFFER = "differ"
    REFERENCE_STOPS = "reference stops"
    EXUDYN_STOPS = "Exudyn stops"
    BOTH_STOP = "both stop"
    REFUSED = "refused"
    NOT_TESTED = "not tested"
    CRASHED = "crashed"
    NONSENSE = "nonsense"


FORMULATIONS = {
    ("smallest", "reference"): "reference, minimal",
    ("smallest", "exudyn"): "Exudyn, tree",
    ("largest", "reference"): "reference, multipliers",
    ("largest", "exudyn"): "Exudyn, five bodies",
}
"""Formulations that run in a pair."""
_SIDE = ("status", "message", "steps", "contacts", "steps_per_contact", "constraint_m")
COLUMNS = (
    *("axis", "value", "law", "pair", "class", "coverage", "apart_m", "reason"),
    *(f"{model}_{name}" for model in MODELS for name in _SIDE),
    *("speed_rpm", "modulus_Pa", "scene"),
)
"""Of ``cells.csv``."""
_COLOURS = {
    Class.AGREE: svg.SERIES[0],
    Class.INDETERMINATE: svg.SERIES[2],
    Class.DIFFER: svg.SECOND,
    Class.REFERENCE_STOPS: svg.SERIES[1],
    Class.EXUDYN_STOPS: svg.SERIES[3],
    Class.BOTH_STOP: svg.OUTSIDE,
    Class.REFUSED: svg.SERIES[5],
    Class.NOT_TESTED: svg.LIMIT,
    Class.CRASHED: svg.INK,
    Class.NONSENSE: svg.INK,
}
_MARKS = dict(zip(Class, "os^><x_.**", strict=True))
_STRIPS = {"smallest": "minimal, tree", "largest": "multipliers, five bodies"}


class Config(NamedTuple):
    """Axes along which one parameter is pushed, and points of the Latin hypercube."""

    axes: Sequence[str]
    points: int


def measure(config: Config, n_jobs: int, on_progress: Progress | None) -> pd.DataFrame:
    """Run all cells by their pairs; a row for each comparison, with `COLUMNS` (SI units)."""
    asked = [(cell, pair) for cell in cells(config.axes, config.points) for pair in cell.pairs]
    rows: dict[int, Row] = {}
    tasks: dict[int, PairRun] = {}
    for number, (cell, pair) in enumerate(asked):
        try:
            tasks[number] = PairRun(cell.scene.with_values(PAIRS[pair]), cell.limit)
        except SceneError as error:
            rows[number] = both("bad input", str(error))
    for limit in sorted({task.limit for task in tasks.values()}):  # a process that hangs is ended by it
        some = {number: task for number, task in tasks.items() if task.limit == limit}
        done = len(rows), len(rows) + len(some)
        share = part(on_progress, *(count / len(asked) for count in done))
        rows |= zip(some, run_pairs(list(some.values()), n_jobs, share), strict=True)
    table = [_columns(cell, pair, rows[number]) for number, (cell, pair) in enumerate(asked)]
    return pd.DataFrame(table, columns=list(COLUMNS))


def _columns(cell: Cell, pair: str, row: Row) -> dict[str, Any]:
    sides = {f"{model}_{name}": row[model].get(name) for model in MODELS for name in _SIDE}
    return {
        "axis": cell.axis,
        "value": cell.label,
        "law": cell.law,
        "pair": pair,
        "class": str(classify(row)),
        **{name: row[name] for name in ("coverage", "apart_m", "reason")},
        **sides,
        "speed_rpm": cell.changes.get("drive.speed_rpm"),
        "modulus_Pa": cell.changes.get("contact.youngs_modulus"),
        "scene": " ".join(f"{key}={value}" for key, value in cell.changes.items()),
    }


def classify(row: Row) -> Class:
    """Return the class of a row of `runs.run_pairs`: the worst of both runs, or the verdict on them."""
    statuses = [row[model]["status"] for model in MODELS]
    named = {CRASHED: Class.CRASHED, "unusable": Class.NONSENSE, "bad input": Class.REFUSED}
    for status, worst in named.items():
        if status in statuses:
            return worst
    first, second = (status not in (SUCCESS, CUT_OFF) for status in statuses)
    if first and second:
        return Class.BOTH_STOP
    if first or second:
        return Class.REFERENCE_STOPS if first else Class.EXUDYN_STOPS
    return Class.NOT_TESTED if CUT_OFF in statuses else Class(row["verdict"])


def page(runs: pd.DataFrame) -> Mapping[str, object]:
    """Return the values of the template."""
    columns, stops = ["axis", "value", "law"], []
    for (pair, model), name in FORMULATIONS.items():
        own = runs[runs["pair"] == pair].rename(columns={f"{model}_status": "status"})
        ended = own[~own["status"].isin([SUCCESS, CUT_OFF, "bad input"])]
        stops.append(ended[[*columns, "status"]].assign(formulation=name))
    stopped = pd.concat(stops)
    single = runs[(runs["law"] == USUAL) & (runs["axis"] != HYPERCUBE)]
    alone = stopped[(stopped["law"] == USUAL) & (stopped["axis"] != HYPERCUBE)]
    there = [kind for kind in Class if kind in set(runs["class"])]
    return {
        "runs": runs,
        "count": {kind: int((runs["class"] == kind).sum()) for kind in Class},
        "law": USUAL,
        "stopped": "; ".join(
            f"{name} ({where(alone[alone['formulation'] == name]) or 'nowhere'})"
            for name in FORMULATIONS.values()
        ),
        "points": runs.loc[runs["axis"] == HYPERCUBE, "value"].nunique(),
        "limits": [f"{limit:g}" for limit in (LIMIT, SHORT_LIMIT, LONG_LIMIT)],
        "classes": counted(runs, ["pair", "law"], "class", there),
        "stops": counted(stopped, ["formulation"], "status") if len(stopped) else "None did.",
        "differ": "; ".join(
            f"{pair}: {where(mine)}" for pair, mine in single[single["class"] == Class.DIFFER].groupby("pair")
        ),
    }


def where(runs: pd.DataFrame) -> str:
    """Return the cells of runs, the values of each axis together."""
    groups = runs.drop_duplicates(["axis", "value"]).groupby("axis", sort=False)["value"]
    return "; ".join(f"{axis} {', '.join(values)}" for axis, values in groups)


def counted(runs: pd.DataFrame, by: list[str], over: str, columns: Sequence[str] = ()) -> str:
    """Return a table of how many rows have each value of a column, in an order, and of how many there are."""
    total = pd.crosstab([runs[name] for name in by], runs[over])
    rows = list(dict.fromkeys(zip(*(runs[name] for name in by), strict=True)))
    total = total.loc[rows if len(by) > 1 else [row for (row,) in rows]]
    if columns:
        total = total[list(columns)]
    return markdown(total.assign(all=total.sum(axis=1)).reset_index())


# ---- figures and the table beside the page


def draw(runs: pd.DataFrame, folder: Path) -> None:
    """Write both figures, and every comparison as a row of ``cells.csv``."""
    _draw_axes(runs, folder / "axes.svg")
    _draw_hypercube(runs, folder / "hypercube.svg")
    write_csv({"cells": runs}, folder, "%.6g")


def _draw_axes(runs: pd.DataFrame, path: Path) -> None:
    """Draw the classes along each parameter that is a number, a strip a pair of formulations."""
    shown = runs[(runs["law"] == USUAL) & (runs["axis"] != HYPERCUBE)]
    shown = shown.assign(at=pd.to_numeric(shown["value"], errors="coerce")).dropna(subset="at")
    groups = shown.groupby("axis", sort=False)
    rows = -(-len(groups) // 2)
    with svg.panels(path, rows, 2, height=0.75 + 0.65 * rows, sharey=True) as panels:
        for axes in panels[len(groups) :]:
            axes.set_visible(False)
        for axes, (axis, mine) in zip(panels, groups, strict=False):
            values = sorted(set(mine["at"]))
            for run in mine.to_dict("records"):
                x, y = values.index(run["at"]), list(_STRIPS).index(run["pair"])
                axes.barh(y, 0.94, 0.88, x - 0.47, color=_COLOURS[run["class"]], alpha=0.75)
            axes.set_xticks(range(len(values)), map(_short, values), size=7)
            axes.set_yticks(range(len(_STRIPS)), list(_STRIPS.values()), size=7)
            axes.set_title(f"{axis} ({UNITS.get(str(axis), '1')})", size=8, loc="left", pad=3)
            axes.set(xlim=(-0.5, 7.5), ylim=(1.5, -0.5))
            axes.tick_params(length=0)
            axes.spines[:].set_visible(False)
            axes.grid(visible=False)
        for kind in [kind for kind in Class if kind in set(shown["class"])]:
            panels[0].scatter([], [], marker="s", s=50, color=_COLOURS[kind], alpha=0.75, label=str(kind))
        svg.legend_above(panels[0], 4)


def _short(value: float) -> str:
    """Return a value as short as it can be: a power of ten where it is one outside 0.1 to 1000."""
    tenth = log10(value) if value > 0 else 0.5
    return decade(value) if tenth == round(tenth) and not -1 <= tenth <= 3 else f"{value:g}".replace("-", "−")


def _draw_hypercube(runs: pd.DataFrame, path: Path) -> None:
    """Draw the class of each point, modulus over speed, a panel a pair of formulations."""
    points = runs[runs["axis"] == HYPERCUBE]
    looks = {
        kind: {"color": _COLOURS[kind], "marker": _MARKS[kind], "ms": 3.5, "mfc": "none", "ls": ""}
        for kind in Class
        if kind in set(points["class"])
    }
    with svg.panels(path, 1, 2, height=3.0, sharey=True) as panels:
        for axes, (pair, title) in zip(panels, _STRIPS.items(), strict=True):
            mine = points[points["pair"] == pair]
            settings = {"xscale": "log", "yscale": "log", "xlabel": "speed (rpm)"}
            curves(axes, mine, "speed_rpm", "modulus_Pa", "class", looks, **settings)
            axes.margins(0.05)
            axes.set_title(title, size=8, loc="left")
        panels[0].set_ylabel("Young's modulus (Pa)")
        svg.legend_above(panels[0], 4)


STUDY = Study(
    "extremes",
    small=Config(axes=("base", "restitution"), points=5),
    full=Config(axes=AXES, points=200),
    measure=measure,
    page=page,
    draw=draw,
)
