"""The study extremes: its page, its figures, and the tables beside the page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from importlib.resources import files
from math import log10
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from comparison.execution.run import Progress
from comparison.files import replacing
from comparison.formatting import decade, number, quantity
from comparison.report import svg
from comparison.studies.extremes import cells as grid
from comparison.studies.extremes import limits, steps
from comparison.studies.extremes.cells import AXES, COMPARED, HYPERCUBE, LARGER, LAWS, METHODS, UNITS, Class
from comparison.studies.extremes.runs import LIMIT
from comparison.studies.extremes.steps import StepRuns, Steps
from comparison.studies.shared.benchmark_unit import BENCHMARK
from comparison.studies.shared.frames import Columns, largest, markdown, rows_table
from comparison.studies.shared.study import Study, part

NAMES = {method.name: f"{method.model}, {method.name}" for method in METHODS}
"""What a formulation is called where both models are."""
TITLES = {
    COMPARED[0].name: "reference",
    COMPARED[1].name: "Exudyn, tree",
    COMPARED[2].name: "Exudyn, five bodies",
}
COLOURS = {COMPARED[0].name: svg.FIRST, COMPARED[1].name: svg.SECOND, COMPARED[2].name: svg.SECOND}
_LOOKS: dict[str, tuple[str, str]] = {
    Class.CONVERGED: (svg.SERIES[0], "o"),
    Class.ANNOUNCED: (svg.SERIES[2], "s"),
    Class.UNCONFIRMED: (svg.SERIES[1], "d"),
    Class.STOPPED: (svg.OUTSIDE, "x"),
    Class.REFUSED: (svg.SERIES[5], "_"),
    Class.NOT_TESTED: (svg.LIMIT, "."),
    Class.DEGRADED: (svg.INK, "*"),
    Class.CRASHED: (svg.INK, "*"),
    Class.NONSENSE: (svg.INK, "*"),
}
"""Colour and mark of a class."""
_METRES, _TWO = partial(quantity, unit="m"), partial(number, digits=2)


@dataclass(frozen=True)
class Config:
    """Axes along which one number is pushed, points of the Latin hypercube, and what has a known answer."""

    axes: Sequence[str]
    points: int
    known: Steps | None


@dataclass(frozen=True)
class Results:
    """The runs of the grid (`cells.frame`); of what has a known answer, limits by name and runs of steps."""

    runs: pd.DataFrame
    limits: Mapping[str, pd.DataFrame]
    steps: StepRuns | None


def measure(config: Config, n_jobs: int, on_progress: Progress | None) -> Results:
    """Run all."""
    outcomes = grid.run_campaign(grid.cells(config.axes, config.points), n_jobs, part(on_progress, 0.0, 0.86))
    runs = grid.frame(outcomes)
    if config.known is None:
        return Results(runs, {}, None)
    frames = limits.run_limits(n_jobs, part(on_progress, 0.86, 0.93))
    return Results(runs, frames, steps.run_steps(config.known, n_jobs, part(on_progress, 0.93, 1.0)))


def page(results: Results) -> Mapping[str, object]:
    """Return what stands in the page."""
    return grid_values(results.runs) | {
        "limit": f"{LIMIT:g}",
        "short_limit": f"{grid.SHORT_LIMIT:g}",
        "long_limit": f"{grid.LONG_LIMIT:g}",
        "benchmark": BENCHMARK,
        "known": known(results),
        "bounds": bounds(results),
    }


def bounds(results: Results) -> str:
    """Return the limits that follow from what has a known answer; nothing where that was not run."""
    if results.steps is None:
        return ""
    values = steps.gain_values(results.steps.gains)
    values |= steps.contact_values(results.steps.impacts, results.steps.points)
    return (
        "**Limits.** At fixed steps a contact must last more than {either_below} steps: of {points} runs "
        "none above that stopped or was more than {wrong_by} wrong. Baumgarte's gains: at most a tenth of "
        "one over the largest step, {gain_fine}/s here. Tolerance of the reference: at most 1 % of the angle "
        "by which a rod crosses the clearance; a coarser one is refused. Clearance, stiffness, losses and "
        "speed may go to their limits: both models converge to the known solutions (appendix)."
    ).format(**values)


def known(results: Results) -> str:
    """Return the part of the page about what has a known answer; nothing where that was not run."""
    if results.steps is None:
        return ""
    template = files("comparison.studies.extremes").joinpath("known.md").read_text("utf-8")
    values = limits.values(results.limits) | steps.gain_values(results.steps.gains)
    return template.format(**values | steps.contact_values(results.steps.impacts, results.steps.points))


def draw(results: Results, folder: Path) -> None:
    """Write the figures, and every run as a row of a CSV file."""
    draw_axes(results.runs, folder)
    draw_hypercube(results.runs, folder)
    draw_errors(results.runs, folder)
    _csv(results.runs.drop(columns="cell"), folder / "cells.csv")
    _csv(together(results.runs), folder / "classes.csv")
    write_known(results, folder)


def write_known(results: Results, folder: Path) -> None:
    """Write figures and rows of what has a known answer."""
    for name, frame in results.limits.items():
        limits.draw(name, frame, folder)
        _csv(frame, folder / f"limit_{name}.csv", "%.6g")
    if results.steps is not None:
        steps.draw(results.steps, folder)
        _csv(results.steps.gains, folder / "gains.csv", "%.6g")
        _csv(results.steps.impacts, folder / "impacts.csv", "%.6g")
        _csv(results.steps.points, folder / "step_and_modulus.csv", "%.6g")


def _csv(frame: pd.DataFrame, path: Path, digits: str | None = None) -> None:
    with replacing(path) as file:
        frame.to_csv(file, index=False, float_format=digits)


# ---- the grid: tables


def grid_values(runs: pd.DataFrame) -> dict[str, object]:
    """Return what stands in the page about the grid, from `cells.frame`."""
    return {
        "finding": finding(runs),
        "points": runs.loc[runs["axis"] == HYPERCUBE, "value"].nunique(),
        "counts": counts(runs, "formulation"),
        "by_law": counts(runs, "law"),
        "announced": announced(runs),
        "causes": causes(runs),
        "others": others(runs),
        "drifts": drifts(runs),
        "cycles": cycles(runs),
        "stops": stops(runs),
        "unexplained": where(runs[runs["cause"] == grid.Cause.UNEXPLAINED]) or "none",
    }


def where(runs: pd.DataFrame) -> str:
    """Return the cells of runs, the values of each axis together; other laws than the first are named."""
    named = runs.assign(law=runs["law"].map(lambda each: "" if each == LAWS[0] else f", {each}"))
    cells = named.drop_duplicates(["axis", "value", "law"])
    return "; ".join(
        f"{axis} {', '.join(group['value'])}{law}"
        for (axis, law), group in cells.groupby(["axis", "law"], sort=False)
    )


def finding(runs: pd.DataFrame) -> str:
    """Return how many runs are in each class, and where the compared formulations stop."""
    counted = {kind: int((runs["class"] == kind).sum()) for kind in Class}
    late = counted.pop(Class.NOT_TESTED)
    tested = ", ".join(f"{count} {kind}" for kind, count in counted.items())
    single = runs[(runs["class"] == Class.STOPPED) & (runs["law"] == LAWS[0]) & (runs["axis"] != HYPERCUBE)]
    stopped = [
        f"{title} ({where(single[single['formulation'] == name]) or 'nowhere'})"
        for name, title in TITLES.items()
    ]
    return (
        f"Of {len(runs)} runs {late} ended at the study's own limit of time and are not tested. Of the other "
        f"{len(runs) - late}: {tested}. With one parameter pushed, under {LAWS[0]}, runs stop by "
        f"themselves at: {'; '.join(stopped)}."
    )


def counts(runs: pd.DataFrame, by: str) -> str:
    """Return how many runs of each formulation, or under each law, ended in each class."""
    kinds = [kind for kind in Class if kind in (*list(Class)[:6], *runs["class"])]
    total = pd.crosstab(runs[by], runs["class"]).reindex(columns=kinds, fill_value=0)
    total = total.reindex([name for name in (*LAWS, *NAMES) if name in total.index]).rename(index=NAMES)
    return markdown(total.assign(runs=total.sum(axis=1)).rename_axis(by).reset_index())


def announced(runs: pd.DataFrame) -> str:
    """Return how many runs that err more than their bound were told of, and how many errors are covered."""
    larger = runs[runs["class"].isin(LARGER)]
    told = larger[larger["class"] == Class.ANNOUNCED]
    estimated = told[told["estimate_m"].notna() & told["error_m"].notna()]
    covered = int((estimated["estimate_m"] >= estimated["error_m"]).sum())
    return (
        f"Of {len(larger)} runs that err more than their bound, {len(told)} are announced. "
        f"Of {len(estimated)} of these with an estimate it covers the error in {covered}."
    )


def causes(runs: pd.DataFrame) -> str:
    """Return how many errors above their bound have which cause, by formulation."""
    larger = runs[runs["class"].isin(LARGER)]
    names = [name for name in NAMES if name in set(larger["formulation"])]
    total = pd.crosstab(larger["cause"], larger["formulation"]).reindex(columns=names, fill_value=0)
    ordered = total.reindex([cause for cause in grid.Cause if cause in total.index])
    return markdown(ordered.rename_axis("cause").rename(columns=NAMES).reset_index())


def together(runs: pd.DataFrame) -> pd.DataFrame:
    """Return the classes of the compared formulations, a row for the cells in which they are the same."""
    kinds = runs.pivot_table("class", "cell", "formulation", aggfunc="first")
    kinds = kinds.reindex(columns=list(TITLES)).dropna()
    asked = runs.drop_duplicates("cell").set_index("cell")[["axis", "value", "law"]]
    rows = [
        {"law": key[0], **dict(zip(TITLES.values(), key[1:], strict=True))}
        | {"cells": len(group), "which": where(group.assign(law=LAWS[0]))}
        for key, group in asked.join(kinds, how="inner").groupby(["law", *TITLES], sort=False)
    ]
    table = pd.DataFrame(rows, columns=["law", *TITLES.values(), "cells", "which"])
    return table.sort_values("cells", ascending=False, kind="stable").sort_values(
        "law", key=lambda law: law.map(LAWS.index), kind="stable"
    )


def others(runs: pd.DataFrame) -> str:
    """Return the classes of the cells that no number places on an axis, under the first law."""
    named = runs[(runs["law"] == LAWS[0]) & runs["axis"].isin(AXES) & _numbers(runs).isna()]
    return markdown(together(named).drop(columns=["law", "cells"]))


def _numbers(runs: pd.DataFrame) -> pd.Series[float]:
    return pd.to_numeric(runs["value"], errors="coerce")


def drifts(runs: pd.DataFrame) -> str:
    """Return the largest spurious energy and violation of a constraint, by formulation and class."""
    rows = []
    finished = runs[runs["class"].isin([Class.CONVERGED, *LARGER])]
    written = {"energy_share": _TWO, "constraint_m": partial(_METRES, digits=2)}
    for (name, kind), group in finished.groupby(["formulation", "class"], sort=False):
        row: dict[str, str] = {"formulation": NAMES[str(name)], "class": str(kind)}
        for column, write in written.items():
            if group[column].notna().any():
                top = largest(group, column)
                row[column] = f"{write(top[column])} ({top['axis']} {top['value']}, {top['law']})"
        if len(row) > 2:
            rows.append(row)
    heads = {"energy_share": "spurious energy / dissipated", "constraint_m": "violation of a constraint"}
    table = pd.DataFrame(rows, columns=["formulation", "class", *written]).rename(columns=heads)
    return markdown(table.sort_values(["formulation", "class"], kind="stable"))


def cycles(runs: pd.DataFrame) -> str:
    """Return the long runs: what they cost and what drifts."""
    heads = {"value": "cycles", "energy_share": "spurious energy / dissipated"}
    heads["constraint_m"] = "violation of a constraint"
    columns: Columns = {"cycles": str, "formulation": NAMES.__getitem__, "class": str}
    columns |= {"steps": "{:,.0f}".format, "contacts": "{:,.0f}".format, heads["energy_share"]: _TWO}
    columns |= {heads["constraint_m"]: partial(_METRES, digits=2)}
    return markdown(runs[runs["axis"] == grid.CYCLES_AXIS].rename(columns=heads), columns)


def stops(runs: pd.DataFrame) -> str:
    """Return the statuses of what stopped by itself: how often, and where."""
    stopped = runs[runs["class"] == Class.STOPPED]
    groups = stopped.groupby(["formulation", "status"])
    return rows_table(
        {
            "formulation": NAMES[str(name)],
            "status": str(status),
            "runs": str(len(group)),
            "where": where(group),
        }
        for (name, status), group in groups
    )


# ---- the grid: figures


def draw_axes(runs: pd.DataFrame, folder: Path) -> None:
    """Write axes.svg: the classes along each parameter that is a number, a strip a formulation."""
    shown = runs[(runs["law"] == LAWS[0]) & runs["axis"].isin(AXES) & runs["formulation"].isin(TITLES)]
    shown = shown.assign(at=_numbers(shown)).dropna(subset="at")
    axes_of = list(dict.fromkeys(shown["axis"]))
    rows = -(-len(axes_of) // 2)
    with svg.panels(folder / "axes.svg", rows, 2, height=0.75 + 0.74 * rows, sharey=True) as panels:
        for axes in panels[len(axes_of) :]:
            axes.set_visible(False)
        for axes, axis in zip(panels, axes_of, strict=False):
            mine = shown[shown["axis"] == axis]
            values = sorted(set(mine["at"]))
            for run in mine.to_dict("records"):
                x, y = values.index(run["at"]), list(TITLES).index(run["formulation"])
                axes.barh(y, 0.94, 0.88, x - 0.47, color=_LOOKS[run["class"]][0], alpha=0.75)
            axes.set_xticks(range(len(values)), map(_short, values), size=7)
            axes.set_yticks(range(len(TITLES)), list(TITLES.values()), size=7)
            for label, colour in zip(axes.get_yticklabels(), COLOURS.values(), strict=False):
                label.set_color(colour)
            axes.set_title(f"{axis} ({UNITS.get(axis, '1')})", size=8, loc="left", pad=3)
            axes.set(xlim=(-0.5, 7.5), ylim=(2.5, -0.5))
            axes.tick_params(length=0)
            axes.spines[:].set_visible(False)
            axes.grid(visible=False)
        for kind in Class:
            if (shown["class"] == kind).any():
                panels[0].scatter(
                    [], [], marker="s", s=50, color=_LOOKS[kind][0], alpha=0.75, label=str(kind)
                )
        svg.legend_above(panels[0], 3)


def _short(value: float) -> str:
    """Return a value as short as it can be: a power of ten where it is one outside 0.1 to 1000."""
    tenth = log10(value) if value > 0 else 0.5
    return decade(value) if tenth == round(tenth) and not -1 <= tenth <= 3 else f"{value:g}".replace("-", "−")


def draw_hypercube(runs: pd.DataFrame, folder: Path) -> None:
    """Write hypercube.svg: the class of each point, modulus over speed, a panel a compared formulation."""
    points = runs[runs["axis"] == HYPERCUBE]
    look: dict[str, Any] = {"ms": 3.2, "mew": 0.9, "mfc": "none", "ls": ""}
    kinds = [kind for kind in Class if (points["class"] == kind).any()]
    with svg.panels(folder / "hypercube.svg", 1, 3, height=2.6, sharey=True) as panels:
        for axes, (name, title) in zip(panels, TITLES.items(), strict=True):
            for kind in kinds:
                mine = points[(points["formulation"] == name) & (points["class"] == kind)]
                colour, mark = _LOOKS[kind]
                at = mine["speed_rpm"], mine["modulus_Pa"]
                axes.plot(*at, marker=mark, color=colour, label=str(kind), **look)
            axes.margins(0.05)
            axes.set(xscale="log", yscale="log", xlabel="speed (rpm)")
            axes.set_title(title, size=8, loc="left", color=COLOURS[name])
        panels[0].set_ylabel("Young's modulus (Pa)")
        svg.legend_above(panels[0], 6)


def draw_errors(runs: pd.DataFrame, folder: Path) -> None:
    """Write errors.svg: error over bound against how much the scene magnifies, with medians by decade."""
    ratio = (runs["error_m"] / runs["bound_m"]).clip(lower=1e-6)
    known = runs.assign(ratio=ratio)[(runs["magnification"] > 0) & np.isfinite(ratio)]
    known = known.assign(decade=np.floor(np.log10(known["magnification"])))
    with svg.panels(folder / "errors.svg", height=3.0) as (axes,):
        for method, mark in zip(COMPARED[:2], ("o", "^"), strict=True):
            mine, colour = known[known["formulation"] == method.name], COLOURS[method.name]
            axes.plot(
                mine["magnification"], mine["ratio"], mark, color=colour, ms=2.5, mfc="none", alpha=0.45
            )
            middle = mine.groupby("decade")["ratio"].agg(["median", "size"]).query("size > 3")
            label = f"{TITLES[method.name]}: runs, and their median by decade"
            axes.plot(
                10 ** (middle.index + 0.5), middle["median"], mark, ls="-", lw=2, color=colour, label=label
            )
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
    full=Config(axes=AXES, points=200, known=steps.FULL),
    measure=measure,
    page=page,
    draw=draw,
)
