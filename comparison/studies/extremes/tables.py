"""The runs of the grid as one frame, and the tables of the page that follow from it."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from functools import partial
from math import nan
from typing import Any

import pandas as pd

from comparison.execution.store import Row
from comparison.formatting import number, quantity
from comparison.studies.extremes.campaign import CellOutcome
from comparison.studies.extremes.causes import Cause, kind
from comparison.studies.extremes.cells import CYCLES_AXIS, HYPERCUBE
from comparison.studies.extremes.formulations import COMPARED, METHODS
from comparison.studies.extremes.reasons import bases, reasons
from comparison.studies.extremes.runs import out_of_time
from comparison.studies.extremes.verdicts import LARGER, Class
from comparison.studies.shared.frames import Columns, largest, markdown

STUDY_LIMIT = "(the study's limit of time)"
NAMES = {method.name: f"{method.model}, {method.name}" for method in METHODS}
"""What a formulation is called in a table of both models."""
_COMPARED = [method.name for method in COMPARED]
_MEASURED = (
    "energy_share", "constraint_m", "steps_per_contact", "contacts", "largest_force_N", "steps", "work",
)  # fmt: skip
"""Of a row of `runs.measure`."""
_SHOWN = (
    "axis", "value", "law", "model", "formulation", "class", "error_m", "bound_m", "estimate_m",
    "lasted_cycles", "magnification", *_MEASURED, "status", "reason", "scene",
)  # fmt: skip
"""Columns of ``cells.csv``."""
_ROUNDED = (
    "error_m", "estimate_m", "magnification", "energy_share", "constraint_m", "steps_per_contact",
    "largest_force_N",
)  # fmt: skip
"""To three digits: what the machine's last bits do not change."""
_DRIFTS = {
    "energy_share": ("spurious energy over the dissipated", "where most", partial(number, digits=2)),
    "constraint_m": ("constraint's violation", "where largest", partial(quantity, unit="m", digits=2)),
}
"""Column of the frame -> heading, heading of where it is largest, and what writes it."""


def frame(outcomes: Sequence[CellOutcome]) -> pd.DataFrame:
    """Return every run as a row, by cell and formulation.

    What was asked, of the hypercube also ``speed`` (rpm) and ``modulus`` (Pa); class, error, drifts and work
    in SI units; its reason, the ``kind`` of that, and ``try``: what the status of a run that stopped says to
    try.
    """
    by_law, rows = bases(outcomes), []
    for position, of in enumerate(outcomes):
        cell = {
            "cell": position,
            "speed": of.cell.changes.get("drive.speed_rpm"),
            "modulus": of.cell.changes.get("contact.youngs_modulus"),
            "axis": of.cell.axis,
            "value": of.cell.label,
            "law": of.cell.law,
            "magnification": of.magnification,
            "scene": " ".join(f"{key}={value}" for key, value in of.cell.changes.items()),
        }
        for method in of.cell.methods:
            verdict, row = of.verdicts[method.name], of.rows[method.name]
            why = reasons(of, method.name, by_law[of.cell.law])
            run = {
                "model": method.model,
                "formulation": method.name,
                "class": verdict.kind.value,
                "error_m": verdict.error,
                "bound_m": verdict.bound,
                "estimate_m": of.estimates.get(method.name, nan),
                "lasted_cycles": verdict.lasted,
                "status": row["status"],
                "reason": "; ".join(map(str, why)),
                "kind": kind(why),
                "try": _remedy(row),
            }
            rows.append(cell | run | {name: row.get(name) for name in _MEASURED})
    runs = pd.DataFrame(rows).astype(dict.fromkeys(_MEASURED, float))
    ordered = {"formulation": list(NAMES), "class": [each.value for each in Class]}
    return runs.assign(**{name: pd.Categorical(runs[name], values) for name, values in ordered.items()})


def _remedy(row: Row) -> str:
    return STUDY_LIMIT if out_of_time(row) else row["message"] or STUDY_LIMIT


def csv(runs: pd.DataFrame) -> pd.DataFrame:
    """Return what goes into ``cells.csv``."""
    rounded = {name: [float(f"{value:.3g}") for value in runs[name]] for name in _ROUNDED}
    return runs.assign(**rounded)[list(_SHOWN)]


def finding(runs: pd.DataFrame) -> str:
    """Return how many runs are in each class."""
    counts = ", ".join(f"{count} {kind}" for kind, count in runs["class"].value_counts().items())
    return f"Of {len(runs)} runs: {counts}."


def counts(runs: pd.DataFrame) -> str:
    """Return how many runs of each formulation ended in each class."""
    total = pd.crosstab(runs["formulation"], runs["class"], dropna=False).assign(
        runs=lambda of: of.sum(axis=1)
    )
    return markdown(total.rename(index=NAMES).reset_index())


def stops(runs: pd.DataFrame) -> str:
    """Return the statuses of what stopped: how often by which formulation, and what they say to try."""
    stopped = runs[runs["class"] == Class.STOPPED].rename(columns={"try": "what it says to try"})
    named = stopped.assign(formulation=stopped["formulation"].astype(str).map(NAMES))
    total = named.groupby(["formulation", "status", "what it says to try"]).size()
    return markdown(total.reset_index(name="runs"))


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


def drifts(runs: pd.DataFrame) -> str:
    """Return the largest spurious energy and violation of a constraint, by formulation and class."""
    rows = []
    finished = runs[runs["class"].isin([Class.CONVERGED, *LARGER])]
    for (name, ended), group in finished.groupby(["formulation", "class"], observed=True):
        row = {"formulation": NAMES[str(name)], "class": ended}
        for column, (heading, where, write) in _DRIFTS.items():
            if group[column].notna().any():
                top = largest(group, column)
                row |= {heading: write(top[column]), where: f"{top['axis']} {top['value']}, {top['law']}"}
        if len(row) > 2:
            rows.append(row)
    headings = ["formulation", "class", *(each for of in _DRIFTS.values() for each in of[:2])]
    return markdown(pd.DataFrame(rows), dict.fromkeys(headings, str))


def cycles(runs: pd.DataFrame) -> str:
    """Return the long runs: what they cost and what drifts."""
    columns: Columns = {"cycles": str, "formulation": NAMES.__getitem__, "status": str}
    columns |= {"steps": "{:.0f}".format} | {heading: write for heading, _, write in _DRIFTS.values()}
    renamed = {"value": "cycles"} | {name: of[0] for name, of in _DRIFTS.items()}
    shown = runs[runs["axis"] == CYCLES_AXIS].rename(columns=renamed)
    return markdown(shown, columns | {"contacts": "{:.0f}".format})


def differing(runs: pd.DataFrame) -> pd.DataFrame:
    """Return a row for each cell whose classes differ between the formulations that are compared.

    ``axis``, ``value``, ``law``; by each formulation's name its class, and by its name in tables the class
    with the error; ``why`` and ``kinds``: reasons of all, and their kinds.
    """
    ran = runs[runs["formulation"].isin(_COMPARED)].astype({"formulation": str, "class": str})
    ran = ran[ran.groupby("cell")["class"].transform("nunique") > 1]
    ran = ran.assign(short=[short(run) for run in ran.to_dict("records")])
    classes, shorts = (
        ran.pivot_table(of, "cell", "formulation", aggfunc="first").reindex(columns=_COMPARED)
        for of in ("class", "short")
    )
    told = {
        heading: (ran["formulation"] + ": " + ran[of])[ran[of] != ""].groupby(ran["cell"]).agg(mark.join)
        for heading, of, mark in (("why", "reason", ". "), ("kinds", "kind", "; "))
    }
    asked = ran.groupby("cell")[["axis", "value", "law"]].first()
    return asked.join([classes, shorts.rename(columns=NAMES)]).assign(**told).fillna("")


def along_the_axes(cells: pd.DataFrame) -> str:
    """Return a table of the cells along the axes whose classes differ, with all reasons."""
    headings = ["axis", "value", "law", *(NAMES[name] for name in _COMPARED), "why"]
    return markdown(cells[cells["axis"] != HYPERCUBE], dict.fromkeys(headings, str))


def in_the_hypercube(cells: pd.DataFrame) -> str:
    """Return the same of the hypercube, points with the same classes and kinds of reasons together."""
    by = ["law", *_COMPARED, "kinds"]
    points = cells[cells["axis"] == HYPERCUBE].groupby(by, sort=False)["value"].agg(["size", " ".join])
    rows = points.reset_index().sort_values(["law", "size"], ascending=[True, False], kind="stable")
    return markdown(rows.rename(columns=NAMES | {"kinds": "why", "size": "points", "join": "which"}))


def unexplained(runs: pd.DataFrame) -> str:
    """Return a line for each run whose class nothing explains."""
    left = runs[runs["kind"] == Cause.UNEXPLAINED.kind].to_dict("records")
    lines = [
        f"- {run['axis']} {run['value']}, {run['law']}, {run['formulation']}: {short(run)}" for run in left
    ]
    return "\n".join(lines) or "None."


def short(run: Mapping[Hashable, Any]) -> str:
    """Return the class of a run; where it errs more than its bound, with its error."""
    kind, error = str(run["class"]), run["error_m"]
    return f"{kind}, {quantity(error, 'm', 2)}" if kind in LARGER else kind
