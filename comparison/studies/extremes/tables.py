"""The runs of the grid as one frame, and the tables of the page that follow from it."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import pandas as pd

from comparison.execution.ledger import Row
from comparison.formatting import number, quantity, table
from comparison.studies.extremes.campaign import CellOutcome
from comparison.studies.extremes.causes import kind
from comparison.studies.extremes.cells import CYCLES_AXIS
from comparison.studies.extremes.formulations import METHODS
from comparison.studies.extremes.reasons import bases, reasons
from comparison.studies.extremes.runs import out_of_time
from comparison.studies.extremes.verdicts import Class
from comparison.studies.shared.frames import Columns, largest, markdown

STUDY_LIMIT = "(the study's limit of time)"
NAMES = {method.name: f"{method.model}, {method.name}" for method in METHODS}
"""What a formulation is called in a table of both models."""
_MEASURED = (
    "energy_share",
    "constraint_m",
    "steps_per_contact",
    "contacts",
    "largest_force_N",
    "steps",
    "work",
)
"""Of a row of `runs.measure`."""
_SHOWN = (
    "axis", "value", "law", "model", "formulation", "class", "error_m", "bound_m", "lasted_cycles",
    "magnification", *_MEASURED, "status", "reason", "scene",
)  # fmt: skip
"""Columns of ``cells.csv``."""
_ROUNDED = (
    "error_m",
    "magnification",
    "energy_share",
    "constraint_m",
    "steps_per_contact",
    "largest_force_N",
)
"""To three digits: what the machine's last bits do not change."""


def frame(outcomes: Sequence[CellOutcome]) -> pd.DataFrame:
    """Return every run as a row, by cell and formulation.

    What was asked, of the hypercube also ``speed`` (rpm) and ``modulus`` (Pa); class, error, drifts and work
    in SI units; its reason, the ``kind`` of that, and ``try``: what the status of a run that stopped says to
    try.
    """
    by_law, rows = bases(outcomes), []
    for position, of in enumerate(outcomes):
        for method in of.cell.methods:
            verdict, row = of.verdicts[method.name], of.rows[method.name]
            why = reasons(of, method.name, by_law[of.cell.law])
            rows.append(
                {
                    "cell": position,
                    "speed": of.cell.changes.get("drive.speed_rpm"),
                    "modulus": of.cell.changes.get("contact.youngs_modulus"),
                    "axis": of.cell.axis,
                    "value": of.cell.label,
                    "law": of.cell.law,
                    "model": method.model,
                    "formulation": method.name,
                    "class": verdict.kind.value,
                    "error_m": verdict.error,
                    "bound_m": verdict.bound,
                    "lasted_cycles": verdict.lasted,
                    "magnification": of.magnification,
                    **{name: row.get(name) for name in _MEASURED},
                    "status": row["status"],
                    "reason": "; ".join(map(str, why)),
                    "kind": kind(why),
                    "try": _remedy(row),
                    "scene": " ".join(f"{key}={value}" for key, value in of.cell.changes.items()),
                }
            )
    runs = pd.DataFrame(rows).astype(dict.fromkeys(_MEASURED, float))
    ordered = {"formulation": list(NAMES), "class": [each.value for each in Class]}
    return runs.assign(**{name: pd.Categorical(runs[name], values) for name, values in ordered.items()})


def _remedy(row: Row) -> str:
    return STUDY_LIMIT if "expected" in row or out_of_time(row) else row["message"] or STUDY_LIMIT


def csv(runs: pd.DataFrame) -> pd.DataFrame:
    """Return what goes into ``cells.csv``."""
    rounded = {name: [float(f"{value:.3g}") for value in runs[name]] for name in _ROUNDED}
    return runs.assign(**rounded)[list(_SHOWN)]


def counts(runs: pd.DataFrame) -> str:
    """Return how many runs of each formulation ended in each class."""
    total = pd.crosstab(runs["formulation"], runs["class"], dropna=False).assign(
        runs=lambda of: of.sum(axis=1)
    )
    rows = [
        [NAMES[str(name)], *map(str, row)] for name, row in zip(total.index, total.to_numpy(), strict=True)
    ]
    return table(("formulation", *map(str, total.columns)), rows)


def stops(runs: pd.DataFrame) -> str:
    """Return the statuses of what stopped: how often by which formulation, and what they say to try."""
    stopped = runs[runs["class"] == Class.STOPPED]
    by = {"formulation": [NAMES[str(name)] for name in stopped["formulation"]]}
    named = stopped.assign(**by).rename(columns={"try": "what it says to try"})
    total = named.groupby(["formulation", "status", "what it says to try"]).size()
    return markdown(total.reset_index(name="runs"))


def drifts(runs: pd.DataFrame) -> str:
    """Return the largest spurious energy and violation of a constraint, by formulation and class."""
    rows = []
    finished = runs[runs["class"].isin([Class.CONVERGED, Class.DEGRADED])]
    for (name, _), group in finished.groupby(["formulation", "class"], observed=True):
        row = {"formulation": NAMES[str(name)], "class": group["class"].iloc[0]}
        for column, (heading, where, write) in _DRIFTS.items():
            known = group.dropna(subset=[column])
            if len(known):
                top = largest(known, column)
                row |= {heading: write(top[column]), where: f"{top['axis']} {top['value']}, {top['law']}"}
        if len(row) > 2:
            rows.append(row)
    headings = ["formulation", "class", *(each for of in _DRIFTS.values() for each in of[:2])]
    return markdown(pd.DataFrame(rows), dict.fromkeys(headings, str))


def cycles(runs: pd.DataFrame) -> str:
    """Return the long runs: what they cost and what drifts."""
    shown = runs[runs["axis"] == CYCLES_AXIS]
    renamed = {"value": "cycles"} | {name: of[0] for name, of in _DRIFTS.items()}
    columns: Columns = {
        "cycles": str,
        "formulation": NAMES.__getitem__,
        "status": str,
        "steps": "{:.0f}".format,
    }
    columns |= {heading: write for heading, _, write in _DRIFTS.values()}
    return markdown(shown.rename(columns=renamed), columns | {"contacts": "{:.0f}".format})


_DRIFTS = {
    "energy_share": ("spurious energy over the dissipated", "where most", partial(number, digits=2)),
    "constraint_m": ("constraint's violation", "where largest", partial(quantity, unit="m", digits=2)),
}
"""Column of the frame -> heading, heading of where it is largest, and what writes it."""
