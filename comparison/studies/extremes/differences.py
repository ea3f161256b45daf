"""Where the models' classes differ, and why."""

from __future__ import annotations

import pandas as pd

from comparison.formatting import quantity, table
from comparison.studies.extremes.cells import HYPERCUBE
from comparison.studies.extremes.formulations import COMPARED
from comparison.studies.extremes.tables import NAMES
from comparison.studies.extremes.verdicts import Class

_COMPARED = [method.name for method in COMPARED]
_HEADINGS = [NAMES[name] for name in _COMPARED]


def differing(runs: pd.DataFrame) -> pd.DataFrame:
    """Return a row for each cell whose classes differ between the formulations that are compared.

    ``axis``, ``value``, ``law``; by each formulation's name its class, and followed by ``: short`` the class
    with the error; ``reasons`` and ``kinds`` of all.
    """
    rows = []
    for _, cell in runs[runs["formulation"].isin(_COMPARED)].groupby("cell"):
        if cell["class"].nunique() < 2:
            continue
        row = {name: cell[name].iloc[0] for name in ("axis", "value", "law")} | dict.fromkeys(_COMPARED, "")
        reasons, kinds = [], []
        for run in cell.to_dict("records"):
            name = run["formulation"]
            row |= {name: run["class"], f"{name}: short": short(run["class"], run["error_m"])}
            reasons += [f"{name}: {run['reason']}"] if run["reason"] else []
            kinds += [f"{name}: {run['kind']}"] if run["kind"] else []
        rows.append(row | {"reasons": ". ".join(reasons), "kinds": "; ".join(kinds)})
    shown = [f"{name}: short" for name in _COMPARED]
    return pd.DataFrame(rows, columns=["axis", "value", "law", *_COMPARED, *shown, "reasons", "kinds"])


def along_the_axes(cells: pd.DataFrame) -> str:
    """Return a table of the cells along the axes, with all reasons."""
    rows = cells.loc[cells["axis"] != HYPERCUBE].drop(columns=[*_COMPARED, "kinds"]).fillna("")
    return table(("axis", "value", "law", *_HEADINGS, "why"), rows.to_numpy().tolist())


def in_the_hypercube(cells: pd.DataFrame) -> str:
    """Return the same of the hypercube, points with the same classes and kinds of reasons together."""
    by = ["law", *_COMPARED, "kinds"]
    points = cells[cells["axis"] == HYPERCUBE].groupby(by, sort=False)["value"].agg(["size", " ".join])
    rows = points.reset_index().sort_values(["law", "size"], ascending=[True, False], kind="stable")
    return table(("law", *_HEADINGS, "why", "points", "which"), rows.astype(str).to_numpy().tolist())


def short(kind: str, error: float) -> str:
    """Return a class, of a degraded run with its error (m)."""
    return f"{kind}, {quantity(error, 'm', 2)}" if kind == Class.DEGRADED else kind
