"""Speed against accuracy of every formulation and integrator: page, figures and tables."""

from functools import partial
from itertools import product
from math import isnan, log10, nan
from pathlib import Path
from textwrap import fill
from typing import NamedTuple

import numpy as np
import pandas as pd

from comparison.accuracy.levels import NAMES, expected, solver_values
from comparison.accuracy.work_precision import pareto
from comparison.execution.run import Progress
from comparison.execution.store import Row
from comparison.execution.tasks import SUCCESS, measure_all, on_processes
from comparison.formatting import MISSING, number, quantity
from comparison.models import MODELS, platform_name
from comparison.report import svg
from comparison.studies.shared import scenes as catalogue
from comparison.studies.shared.scenes import Method
from comparison.studies.shared.study import Columns, Study, markdown, rate
from comparison.studies.tradeoff.measure import (
    CHIEF,
    LONG,
    SWEEPS,
    TRUTH,
    WITH_CLEARANCE,
    Sweep,
    Timed,
    confirmations,
    growing,
    measure,
)
from comparison.tables.channels import BoolArray

TITLES = {
    "ideal": "ideal mechanism with its joint reactions, 150 rpm",
    "150rpm-0.2mm": "150 rpm, 0.2 mm",
    "300rpm-0.2mm": "300 rpm, 0.2 mm",
}
QUANTITIES = {
    "slider_x": "maximum error of x (m)",
    "crank_torque": "maximum error of the crank torque relative to its range (-)",
}
LARGEST = {"slider_x": 2e-6, "crank_torque": 1e-2}
"""Above such an error (a hundredth of the clearance, of the range) nothing is asymptotic."""
COSTS = {"seconds": "processor time (s)", "evaluations": "evaluations of the equations (-)"}
EQUAL = {quantity(error, "m", 1): error for error in (1e-5, 1e-6, 1e-7, 1e-8, 1e-9)}
"""Errors of x at which costs are compared, m, by their headings."""
RATIOS: tuple[tuple[Method, str, tuple[Method, ...]], ...] = (
    (catalogue.MULTIPLIERS_BDF, "minimal, DOP853", (catalogue.MINIMAL,)),
    (catalogue.MULTIPLIERS, "minimal, DOP853", (catalogue.MINIMAL,)),
    (catalogue.FULL, "the cheaper of the two trees", (catalogue.TREE, catalogue.TREE_LONG_STEPS)),
    (catalogue.TREE, "tree, DOPRI5, steps up to 1 ms", (catalogue.TREE_LONG_STEPS,)),
    (catalogue.TREE, "minimal, DOP853", (catalogue.MINIMAL,)),
)
"""Method, what it is compared with in words, and the methods of which the cheapest counts."""
# By formulation, a model's own colour being that of its smallest; by integrator of either model.
_COLOURS = {
    "minimal": svg.FIRST,
    "multipliers": svg.SERIES[0],
    "tree": svg.SECOND,
    "full (five bodies)": svg.SERIES[1],
}
_MARKS = {"DOP853": "o", "scipy's DOP853": "s", "LSODA": "^", "Radau": "v", "BDF": "D"}
_MARKS |= {"DOPRI5": "o", "DOPRI5, steps up to 1 ms": "s"}
_MARKS |= {"generalized alpha": "^", "trapezoidal index 2": "v"}


class Config(NamedTuple):
    """How much is measured."""

    settings: int  # of each method, from the coarsest, at most
    rounds: int
    busy: float  # runs of each, and s that they take together, at least
    cycles: float  # of the longest run


class Results(NamedTuple):
    """Rows of every setting, and of the runs whose cost grows."""

    config: Config
    rows: list[Row]  # ``method``, ``model``, ``scene``, ``setting``, and what `measure` returns
    grown: list[Row]  # the labels of `growing`, and what `measure` returns
    confirmed: list[float]  # distance of the models' most accurate runs, m of x, of each of `WITH_CLEARANCE`


def measured(config: Config, n_jobs: int, on_progress: Progress | None) -> Results:
    """Measure in one process, whatever ``n_jobs`` says, since it is timed."""
    timing = config.rounds, config.busy
    asked: list[tuple[Row, Timed]] = []
    for sweep in SWEEPS:
        method = sweep.method
        for name, setting in product(sweep.scenes, sweep.settings[: config.settings]):
            labels = {"method": method.name, "model": method.model, "scene": name, "setting": setting}
            asked.append((labels, Timed(method.model, sweep.scene(name, setting), *timing, name)))
    swept = len(asked)
    asked += [(labels, Timed(each.model, scene, *timing)) for labels, each, scene in growing(config.cycles)]
    timed = measure_all(measure, [task for _, task in asked], on_processes(1), on_progress)
    rows = [row | labels for (labels, _), row in zip(asked, timed, strict=True)]
    return Results(config, rows[:swept], rows[swept:], confirmations(WITH_CLEARANCE, n_jobs))


# ---- curves: a row a setting, coarsest first; an error of 0 or nan is no point of one


def curve_of(rows: pd.DataFrame, sweep: Sweep, scene: str, cost: str = "seconds") -> pd.DataFrame:
    """Return ``setting``, ``error`` and ``cost`` of a method's settings with a result on a scene."""
    chosen = (rows["method"] == sweep.method.name) & (rows["scene"] == scene) & (rows["status"] == SUCCESS)
    names = {"setting": "setting", f"errors.{CHIEF[scene]}": "error", cost: "cost"}
    return rows[chosen].dropna(subset=[cost]).rename(columns=names)[[*names.values()]].astype(np.float64)


def asymptotic(curve: pd.DataFrame, order: float, largest: float = LARGEST["slider_x"]) -> BoolArray:
    """Return where the error falls with the setting: the next finer point gains at least half of the order.

    Errors above the largest do not count; the finest point does if the one before it does.
    """
    if len(curve) < 2:
        return np.zeros(len(curve), dtype=bool)
    error, setting = curve["error"].to_numpy(), curve["setting"].to_numpy()
    with np.errstate(divide="ignore", invalid="ignore"):
        gain, refined = (np.log10(values[:-1] / values[1:]) for values in (error, setting))
    falls = (error[:-1] <= largest) & (error[1:] > 0) & (gain >= 0.5 * order * refined)
    return np.append(falls, falls[-1])


def front(curve: pd.DataFrame) -> pd.DataFrame:
    """Return the points that no other one beats in error and in cost, the cheapest first."""
    points = curve[curve["error"] > 0].sort_values(["cost", "error"])
    return points[pareto(points["error"].to_numpy(np.float64), points["cost"].to_numpy(np.float64))]


def cost_at(curve: pd.DataFrame, error: float) -> float:
    """Return the cost of a curve at an error, interpolated in logarithms along its front.

    If all settings are more accurate, the cheapest of them; nan if none is: nothing is extrapolated.
    """
    best = front(curve)[::-1]
    if best.empty or error < best["error"].iloc[0]:
        return nan
    return float(10 ** np.interp(log10(error), np.log10(best["error"]), np.log10(best["cost"])))


# ---- tables


def costs(rows: pd.DataFrame, scene: str) -> pd.DataFrame:
    """Return the processor time, s, of each method at each of `EQUAL`; nan where it is not known."""
    curves = {sweep.method.title: curve_of(rows, sweep, scene) for sweep in SWEEPS}
    at = {words: [cost_at(curve, error) for curve in curves.values()] for words, error in EQUAL.items()}
    return pd.DataFrame(at, list(curves)).rename_axis("method")


def ratios(rows: pd.DataFrame) -> pd.DataFrame:
    """Return how many times the cost of another method some methods have at equal error."""
    lines = []
    for (method, words, bases), scene in product(RATIOS, WITH_CLEARANCE):
        cost = costs(rows, scene)
        ratio = cost.T[method.title] / cost.loc[[base.title for base in bases]].min()
        names = {"cost of": method.title, "over that of": words, "scene": TITLES[scene]}
        lines.append(names | ratio.to_dict())
    return pd.DataFrame(lines)


def cheapest(rows: pd.DataFrame) -> list[dict[str, str]]:
    """Return the cheapest method of each scene at the smallest of the equal errors that any reaches."""
    lines = []
    for scene in WITH_CLEARANCE:
        reached = costs(rows, scene).dropna(axis="columns", how="all")
        if not reached.empty:
            error, least = reached.columns[-1], reached.iloc[:, -1]
            seconds = quantity(least.min(), "s")
            lines.append(
                {"scene": TITLES[scene], "method": str(least.idxmin()), "error": error, "time": seconds}
            )
    return lines


def orders(rows: pd.DataFrame) -> pd.DataFrame:
    """Return the observed order of each method on its scenes, by least squares over the asymptotic points."""
    lines = []
    for sweep, scene in ((each, scene) for each in SWEEPS for scene in each.scenes):
        curve = curve_of(rows, sweep, scene)
        good = curve[asymptotic(curve, sweep.order, LARGEST[CHIEF[scene]])]
        order = rate(good["setting"].tolist(), good["error"].tolist()) if len(good) >= 3 else nan
        line = {"method": sweep.method.title, "scene": scene, "expected": sweep.order, "observed": order}
        lines.append(line | {"asymptotic": len(good), "settings": len(curve)})
    return pd.DataFrame(lines)


def settings(rows: pd.DataFrame) -> pd.DataFrame:
    """Return every setting measured; of those that an accuracy names, that and the error bound on record."""
    lines = []
    named = [each for each in SWEEPS if each.method in (catalogue.MINIMAL, catalogue.TREE, catalogue.FULL)]
    for sweep, name, scene in product(named, NAMES, WITH_CLEARANCE):
        model, coarsest = sweep.method.model, sweep.scene(scene, sweep.settings[0])
        chosen = coarsest.with_values(solver_values(model, name, coarsest))
        setting = chosen.data["solver"][model][sweep.key.rpartition(".")[2]]
        line = {"method": sweep.method.name, "scene": scene, "setting": setting, "accuracy": name}
        lines.append(line | {"bound_of_x_m": expected(chosen, model).error})
    return rows.merge(pd.DataFrame(lines), "left", ["method", "scene", "setting"])


def ratio_in_long_runs(grown: pd.DataFrame) -> tuple[float, float]:
    """Return how many times the minimal formulation's cost multipliers have in the longest run of both.

    And the cycles of that run; both nan where they have none in common.
    """
    cost = grown[grown["table"] == "cycles"].pivot_table("seconds", "cycles", "method")
    both = cost.reindex(columns=[catalogue.MINIMAL.title, catalogue.MULTIPLIERS.title]).dropna()
    minimal, multipliers = both.iloc[-1] if len(both) else (nan, nan)
    return multipliers / minimal, max(both.index, default=nan)


def page(results: Results) -> dict[str, object]:
    """Return what stands in the page."""
    config, rows = results.config, pd.json_normalize(results.rows)
    grown = pd.DataFrame(results.grown)
    grown["processor time a cycle (ms)"] = 1e3 * grown["seconds"] / grown["cycles"]
    grown["contacts a cycle"] = grown["contacts"] / grown["cycles"]
    ratio, cycles = ratio_in_long_runs(grown)
    two = partial(number, digits=2)
    words: Columns = dict.fromkeys(("cost of", "over that of", "scene"), str)
    shown: Columns = dict.fromkeys(("method", "scene", "channels"), str) | {"cycles": "{:.0f}".format}
    shown |= dict.fromkeys(("processor time a cycle (ms)", "contacts a cycle"), number)
    return {
        "cheapest": cheapest(rows),
        "titles": TITLES,
        "chief": {scene: QUANTITIES[chief] for scene, chief in CHIEF.items()},
        "costs": COSTS,
        "ratios": markdown(ratios(rows), words | dict.fromkeys(EQUAL, two)),
        "rounds": config.rounds,
        "busy": f"{config.busy:g}",
        "long": f"{LONG:g}",
        "machine": platform_name(),
        "truth": f"{TRUTH:.0e}",
        "confirmed": " and ".join(quantity(apart, "m", 1) for apart in results.confirmed),
        "long_cycles": MISSING if isnan(cycles) else f"{cycles:.0f}",
        "long_ratio": two(ratio),
        "grown": markdown(grown, shown),
        "failed": [row for row in results.rows if row["status"] != SUCCESS],
    }


def draw(results: Results, folder: Path) -> None:
    """Write the tables, and draw cost over error for each scene and kind of cost, a panel a model."""
    rows = pd.json_normalize(results.rows)
    at_equal = pd.concat({scene: costs(rows, scene) for scene in WITH_CLEARANCE}, names=["scene"])
    tables = {"settings": settings(rows), "costs": at_equal.reset_index(), "orders": orders(rows)}
    for name, frame in tables.items():
        frame.to_csv(folder / f"{name}.csv", index=False)
    for scene, cost in product(CHIEF, COSTS):
        _draw(rows, scene, cost, folder / f"{scene}-{cost}.svg")


def _draw(rows: pd.DataFrame, scene: str, cost: str, path: Path) -> None:
    """Draw a line a method: its colour is that of the formulation, its mark the integrator's."""
    sweeps = [sweep for sweep in SWEEPS if scene in sweep.scenes and sweep.method.name in set(rows["method"])]
    curves = {sweep: curve_of(rows, sweep, scene, cost) for sweep in sweeps}
    best = front(pd.concat(curves.values()))
    failed = rows[(rows["scene"] == scene) & (rows["status"] != SUCCESS)]["method"].value_counts()
    lines = max(sum(sweep.method.model == model for sweep in sweeps) for model in MODELS)
    with svg.panels(path, 1, len(MODELS), height=3.3 + 0.19 * lines, sharex=True, sharey=True) as panels:
        for axes, model in zip(panels, MODELS, strict=True):
            axes.set(xscale="log", yscale="log", xlabel=fill(QUANTITIES[CHIEF[scene]], 34))
            axes.plot(best["error"], best["cost"], color=svg.SHADE, lw=5, label="Pareto front of both models")
            for sweep in (each for each in sweeps if each.method.model == model):
                name, curve = sweep.method.name, curves[sweep]
                formulation, _, integrator = name.partition(", ")
                firm = curve[asymptotic(curve, sweep.order, LARGEST[CHIEF[scene]]) & (curve["error"] > 0)]
                curve = curve[curve["error"] > 0]
                style: Row = {"color": _COLOURS[formulation], "marker": _MARKS[integrator], "ms": 4}
                label = f"{formulation.removesuffix(' (five bodies)')}, {integrator}"
                label += f" (-{failed[name]})" if name in failed else ""
                axes.plot(curve["error"], curve["cost"], mfc="none", lw=0.9, label=label, **style)
                axes.plot(firm["error"], firm["cost"], lw=0.0, **style)
            axes.margins(x=0.05)
            axes.set_title(model, fontsize=9)
        marks = {"filled: error falls at the method's order": svg.INK, "open: it does not": "none"}
        for words, inside in marks.items():
            panels[-1].plot([], [], "o", color=svg.INK, mfc=inside, ms=4, label=words)
        for axes in panels:
            axes.legend(loc="upper left", bbox_to_anchor=(-0.4, 0.0), borderaxespad=5.0)
        panels[0].set_ylabel(COSTS[cost])


STUDY = Study(
    "tradeoff",
    small=Config(settings=2, rounds=1, busy=0.0, cycles=3.0),
    full=Config(settings=8, rounds=3, busy=0.5, cycles=1000.0),
    measure=measured,
    page=page,
    draw=draw,
    data=lambda results: {"machine": platform_name(), "rows": results.rows},
)
