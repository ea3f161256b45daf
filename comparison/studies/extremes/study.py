"""The study extremes: its page, its figures, and the tables beside the page."""

from collections.abc import Iterable, Mapping, Sequence
from math import log10
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from comparison.execution.run import Progress
from comparison.formatting import decade, number
from comparison.models import MODELS
from comparison.report import svg
from comparison.scene import load_scene
from comparison.studies.extremes import cells as grid
from comparison.studies.extremes import limits, steps
from comparison.studies.extremes.cells import (
    AXES,
    COMPARED,
    HYPERCUBE,
    IMPACT,
    LARGER,
    LAWS,
    METHODS,
    OWN_AXES,
    Cause,
    Class,
)
from comparison.studies.extremes.runs import BENCHMARK, LIMIT
from comparison.studies.shared.study import Columns, Study, curves, markdown, part, write_csv

NAMES = {name: f"{method.model}, {name}" for name, method in METHODS.items()}
"""What a formulation is called where both models are."""
TITLES = dict(
    zip([each.name for each in COMPARED], ("reference", "Exudyn, tree", "Exudyn, five bodies"), strict=True)
)
COLOURS = dict(zip(TITLES, (svg.FIRST, svg.SECOND, svg.SECOND), strict=True))
_LOOKS: dict[str, dict[str, Any]] = {
    kind: {"color": colour, "marker": mark, "ms": 3.2, "mew": 0.9, "mfc": "none", "ls": ""}
    for kind, colour, mark in (
        (Class.CONVERGED, svg.SERIES[0], "o"),
        (Class.ANNOUNCED, svg.SERIES[2], "s"),
        (Class.UNCONFIRMED, svg.SERIES[1], "d"),
        (Class.STOPPED, svg.OUTSIDE, "x"),
        (Class.REFUSED, svg.SERIES[5], "_"),
        (Class.NOT_TESTED, svg.LIMIT, "."),
        *((kind, svg.INK, "*") for kind in (Class.DEGRADED, Class.CRASHED, Class.NONSENSE)),
    )
}


class Config(NamedTuple):
    """Axes along which one number is pushed, points of the Latin hypercube, and what has a known answer."""

    axes: Sequence[str]
    points: int
    known: steps.Config | None


class Results(NamedTuple):
    """The runs of the grid (`cells.run_campaign`); of what has a known answer, limits and runs of steps."""

    runs: pd.DataFrame
    limits: Mapping[str, pd.DataFrame]
    steps: Mapping[str, pd.DataFrame]


def measure(config: Config, n_jobs: int, on_progress: Progress | None) -> Results:
    """Run all."""
    every = grid.cells(config.axes, config.points)
    runs = grid.run_campaign(every, n_jobs, part(on_progress, 0.0, 0.86))
    if config.known is None:
        return Results(runs, {}, {})
    frames = limits.run_limits(n_jobs, part(on_progress, 0.86, 0.93))
    return Results(runs, frames, steps.run_steps(config.known, n_jobs, part(on_progress, 0.93, 1.0)))


def page(results: Results) -> Mapping[str, object]:
    """Return what the template asks."""
    runs = results.runs
    larger, stopped = runs[runs["class"].isin(LARGER)], runs[runs["class"] == Class.STOPPED]
    classes = [each for each in Class if each in (*list(Class)[:6], *runs["class"])]
    single = stopped[(stopped["law"] == LAWS[0]) & (stopped["axis"] != HYPERCUBE)]
    written: Columns = {"case": str, "quantity": str, **dict.fromkeys(("expected", *MODELS), number)}
    return {
        "runs": runs,
        "count": {kind: int((runs["class"] == kind).sum()) for kind in Class},
        "law": LAWS[0],
        "stopped": "; ".join(
            f"{title} ({where(single[single['formulation'] == name]) or 'nowhere'})"
            for name, title in TITLES.items()
        ),
        "points": runs.loc[runs["axis"] == HYPERCUBE, "value"].nunique(),
        "limits": [f"{limit:g}" for limit in (LIMIT, grid.SHORT_LIMIT, grid.LONG_LIMIT)],
        "benchmark": BENCHMARK,
        "counts": crossed(runs, "formulation", METHODS, "class", classes),
        "by_law": crossed(runs, "law", (*LAWS, IMPACT), "class", classes),
        "larger": larger,
        "causes": crossed(larger, "cause", Cause, "formulation", METHODS),
        "stops": crossed(stopped, "formulation", METHODS, "status"),
        "steps": results.steps,
        "orders": markdown(limits.orders(results.limits), written) if results.limits else "",
        "restitution": limits.law(),
        # The reference's largest step is a fiftieth of a cycle.
        "gain": 0.1 * 50.0 / load_scene("ideal").period,
        "S": steps.stable_to(),
    }


def where(runs: pd.DataFrame) -> str:
    """Return the cells of runs, the values of each axis together."""
    cells = runs.drop_duplicates(["axis", "value"]).groupby("axis", sort=False)["value"]
    return "; ".join(f"{axis} {', '.join(values)}" for axis, values in cells)


def crossed(
    runs: pd.DataFrame, by: str, order: Iterable[str], over: str, columns: Iterable[str] | None = None
) -> str:
    """Return how many runs have each pair of values of two columns, in these orders, and their sums."""
    total = pd.crosstab(runs[by], runs[over])
    if columns is not None:
        total = total.reindex(columns=list(columns), fill_value=0)
    total = total.reindex([name for name in order if name in total.index]).rename(index=NAMES, columns=NAMES)
    return markdown(total.assign(runs=total.sum(axis=1)).rename_axis(by).reset_index())


def together(runs: pd.DataFrame) -> pd.DataFrame:
    """Return the classes of the compared formulations, a row for the cells in which they are the same."""
    kinds = runs.pivot_table("class", "cell", "formulation", aggfunc="first")
    kinds = kinds.reindex(columns=list(TITLES)).dropna().rename(columns=TITLES)
    asked = runs.drop_duplicates("cell").set_index("cell")[["axis", "value", "law"]]
    groups = asked.join(kinds, how="inner").groupby(["law", *TITLES.values()], sort=False)
    rows = [[*key, len(group), where(group)] for key, group in groups]
    table = pd.DataFrame(rows, columns=["law", *TITLES.values(), "cells", "which"])
    return table.sort_values("cells", ascending=False, kind="stable").sort_values(
        "law", key=lambda law: law.map((*LAWS, IMPACT).index), kind="stable"
    )


# ---- figures and tables beside the page


def draw(results: Results, folder: Path) -> None:
    """Write the figures, and every run as a row of a CSV file."""
    draw_axes(results.runs, folder)
    draw_hypercube(results.runs, folder)
    draw_errors(results.runs, folder)
    write_csv({"cells": results.runs.drop(columns="cell"), "classes": together(results.runs)}, folder)
    for name, frame in results.limits.items():
        limits.draw(name, frame, folder)
        write_csv({f"limit_{name}": frame}, folder, "%.6g")
    if ran := results.steps:
        steps.draw(ran, folder)
        known = {"gains": ran["gains"], "impacts": ran["impacts"], "step_and_modulus": ran["points"]}
        write_csv(known, folder, "%.6g")


def draw_axes(runs: pd.DataFrame, folder: Path) -> None:
    """Write axes.svg: the classes along each parameter that is a number, a strip a formulation."""
    shown = runs[(runs["law"] == LAWS[0]) & runs["axis"].isin(AXES) & runs["formulation"].isin(TITLES)]
    shown = shown.assign(at=pd.to_numeric(shown["value"], errors="coerce")).dropna(subset="at")
    groups = shown.groupby("axis", sort=False)
    rows = -(-len(groups) // 2)
    with svg.panels(folder / "axes.svg", rows, 2, height=0.75 + 0.74 * rows, sharey=True) as panels:
        for axes in panels[len(groups) :]:
            axes.set_visible(False)
        for axes, (axis, mine) in zip(panels, groups, strict=False):
            values = sorted(set(mine["at"]))
            for run in mine.to_dict("records"):
                x, y = values.index(run["at"]), list(TITLES).index(run["formulation"])
                axes.barh(y, 0.94, 0.88, x - 0.47, color=_LOOKS[run["class"]]["color"], alpha=0.75)
            axes.set_xticks(range(len(values)), map(_short, values), size=7)
            axes.set_yticks(range(len(TITLES)), list(TITLES.values()), size=7)
            for label, colour in zip(axes.get_yticklabels(), COLOURS.values(), strict=False):
                label.set_color(colour)
            axes.set_title(f"{axis} ({grid.UNITS.get(str(axis), '1')})", size=8, loc="left", pad=3)
            axes.set(xlim=(-0.5, 7.5), ylim=(2.5, -0.5))
            axes.tick_params(length=0)
            axes.spines[:].set_visible(False)
            axes.grid(visible=False)
        for kind in [kind for kind in Class if kind in set(shown["class"])]:
            colour = _LOOKS[kind]["color"]
            panels[0].scatter([], [], marker="s", s=50, color=colour, alpha=0.75, label=str(kind))
        svg.legend_above(panels[0], 3)


def _short(value: float) -> str:
    """Return a value as short as it can be: a power of ten where it is one outside 0.1 to 1000."""
    tenth = log10(value) if value > 0 else 0.5
    return decade(value) if tenth == round(tenth) and not -1 <= tenth <= 3 else f"{value:g}".replace("-", "−")


def draw_hypercube(runs: pd.DataFrame, folder: Path) -> None:
    """Write hypercube.svg: the class of each point, modulus over speed, a panel a compared formulation."""
    points = runs[runs["axis"] == HYPERCUBE]
    looks = {kind: look for kind, look in _LOOKS.items() if kind in set(points["class"])}
    with svg.panels(folder / "hypercube.svg", 1, 3, height=2.6, sharey=True) as panels:
        for axes, (name, title) in zip(panels, TITLES.items(), strict=True):
            mine = points[points["formulation"] == name]
            settings = {"xscale": "log", "yscale": "log", "xlabel": "speed (rpm)"}
            curves(axes, mine, "speed_rpm", "modulus_Pa", "class", looks, **settings)
            axes.margins(0.05)
            axes.set_title(title, size=8, loc="left", color=COLOURS[name])
        panels[0].set_ylabel("Young's modulus (Pa)")
        svg.legend_above(panels[0], 6)


def draw_errors(runs: pd.DataFrame, folder: Path) -> None:
    """Write errors.svg: error over bound against how much the scene magnifies, with medians by decade."""
    ratio = (runs["error_m"] / runs["bound_m"]).clip(lower=1e-6)
    known = runs.assign(ratio=ratio)[(runs["magnification"] > 0) & np.isfinite(ratio)]
    known = known.assign(decade=np.floor(np.log10(known["magnification"])))
    with svg.panels(folder / "errors.svg", height=3.0) as (axes,):
        for name, mark in zip(TITLES, ("o", "^"), strict=False):
            mine, colour = known[known["formulation"] == name], COLOURS[name]
            at = mine["magnification"], mine["ratio"]
            axes.plot(*at, mark, color=colour, ms=2.5, mfc="none", alpha=0.45)
            middle = mine.groupby("decade")["ratio"].agg(["median", "size"]).query("size > 3")
            label = f"{TITLES[name]}: runs, and their median by decade"
            line = 10 ** (middle.index + 0.5), middle["median"]
            axes.plot(*line, mark, ls="-", lw=2, color=colour, label=label)
        ends = [1.0, max(10.0, known["magnification"].max()) if len(known) else 10.0]
        axes.plot(ends, [1.0, 1.0], color=svg.THRESHOLD, lw=0.9, dashes=(4, 2), label="error bound")
        axes.set(xscale="log", yscale="log", ylabel="error of x / its bound (1)")
        axes.set_xlabel("distance of two neighbouring starts after one cycle / at its start (1)")
        axes.margins(0.03)
        svg.legend_above(axes, 2)


STUDY = Study(
    "extremes",
    # What has a known answer only the models can give, not few and short runs.
    small=Config(axes=AXES[:3], points=12, known=None),
    full=Config(axes=(*AXES, *OWN_AXES), points=200, known=steps.FULL),
    measure=measure,
    page=page,
    draw=draw,
)
