"""The tables of the study tradeoff, from the rows of `comparison.studies.tradeoff.study.Results`."""

from __future__ import annotations

from functools import partial
from math import isnan

import pandas as pd

from comparison.accuracy.levels import NAMES, solver_values
from comparison.accuracy.measured import expected
from comparison.formatting import MISSING, number, quantity
from comparison.studies.shared import formulations as catalogue
from comparison.studies.shared.formulations import Method
from comparison.studies.shared.frames import Columns, markdown, rows_table
from comparison.studies.tradeoff.front import asymptotic, cost_at, curve_of, observed_order
from comparison.studies.tradeoff.measure import QUANTITIES
from comparison.studies.tradeoff.methods import CHIEF, SCENES, SWEEPS, TITLES, WITH_CLEARANCE

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
_two = partial(number, digits=2)


def costs(rows: pd.DataFrame, scene: str) -> pd.DataFrame:
    """Return the cost, s, of each method at each of `EQUAL`; nan where it is not known."""
    of_scene = rows[rows["scene"] == scene]
    curves = {of.method.title: curve_of(of_scene, of, "slider_x") for of in SWEEPS if scene in of.scenes}
    at = {words: [cost_at(curve, error) for curve in curves.values()] for words, error in EQUAL.items()}
    return pd.DataFrame(at, list(curves)).rename_axis("method")


def ratio_at(rows: pd.DataFrame, scene: str, method: Method, *bases: Method) -> pd.Series:
    """Return how many times the cost of the cheapest base a method's is, for each of `EQUAL`."""
    cost = costs(rows, scene)
    return cost.T[method.title] / cost.loc[[base.title for base in bases]].min()


def ratios(rows: pd.DataFrame) -> str:
    """Return how many times the cost of another method some methods have at equal error."""
    found = [
        {"cost of": method.title, "over that of": words, "scene": TITLES[scene]}
        | ratio_at(rows, scene, method, *bases).to_dict()
        for method, words, bases in RATIOS
        for scene in WITH_CLEARANCE
    ]
    words = dict.fromkeys(("cost of", "over that of", "scene"), str)
    return markdown(pd.DataFrame(found), words | dict.fromkeys(EQUAL, _two))


def finding(rows: pd.DataFrame) -> str:
    """Return which method is the cheapest at the smallest of the equal errors that any of them reaches."""
    parts = []
    for scene in WITH_CLEARANCE:
        reached = costs(rows, scene).dropna(axis="columns", how="all")
        if not reached.empty:
            least = reached[reached.columns[-1]]
            parts.append(
                f"{TITLES[scene]}: {least.idxmin()} at {reached.columns[-1]}, {quantity(least.min(), 's')}"
            )
    return f"Least processor time at equal error of x: {'; '.join(parts) or MISSING}."


def equal_error(rows: pd.DataFrame, scene: str) -> str:
    """Return costs at equal error of x, and in brackets their ratios to that of the minimal formulation."""
    cost = costs(rows, scene)
    ratio = cost / cost.loc[catalogue.MINIMAL.title]
    cells = (cost.map(_two) + " (" + ratio.map(_two) + ")").where(cost.notna(), MISSING)
    return markdown(cells.reset_index(), dict.fromkeys(("method", *EQUAL), str))


def bounds(rows: pd.DataFrame) -> str:
    """Return the errors at the settings of the accuracy names, beside the error bounds on record."""
    lines = []
    for sweep in (of for of in SWEEPS if of.method in (catalogue.MINIMAL, catalogue.TREE, catalogue.FULL)):
        method, key = sweep.method, sweep.key.rpartition(".")[2]
        for name in NAMES:
            for scene in WITH_CLEARANCE:
                coarsest = sweep.scene(scene, sweep.settings[0])
                chosen = coarsest.with_values(solver_values(method.model, name, coarsest))
                line = {
                    "method": method.name,
                    "scene": scene,
                    "setting": chosen.data["solver"][method.model][key],
                }
                line |= {"accuracy": name, "key": key, "title": method.title}
                lines.append(line | {"error bound of x": expected(chosen, method.model).error})
    timed = rows.rename(columns={"seconds": "processor time (s)"})
    found = pd.DataFrame(lines).merge(timed, "left", ["method", "scene", "setting"])
    found["setting"] = found["key"] + " = " + found["setting"].map("{:g}".format)
    found["method"] = found["title"]
    found = found.rename(columns={f"errors.{of}": words for of, (words, _) in QUANTITIES.items()})
    columns: Columns = dict.fromkeys(("accuracy", "method", "setting", "scene"), str)
    columns["error bound of x"] = partial(quantity, unit="m", digits=2)
    for of, (words, unit) in QUANTITIES.items():
        if of != "crank_torque":
            columns[words] = partial(quantity, unit=unit, digits=2)
    return markdown(found, columns | {"processor time (s)": _two})


def orders(rows: pd.DataFrame) -> str:
    """Return the observed order of each method on each scene."""
    lines = []
    for sweep in SWEEPS:
        line = {"method": sweep.method.title, "expected": f"{sweep.order:g}"}
        for scene in SCENES:
            points = curve_of(rows[rows["scene"] == scene], sweep, CHIEF[scene])
            good = points[asymptotic(points, sweep.order, CHIEF[scene])]
            slope = observed_order(good)
            cell = MISSING if isnan(slope) else f"{slope:.2f} ({len(good)} of {len(points)})"
            line[f"{scene} (points)"] = cell
        lines.append(line)
    return rows_table(lines)
