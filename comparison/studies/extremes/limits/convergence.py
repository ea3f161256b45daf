"""A convergence study: one setting goes to its limit in both models, and what is measured goes with it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import pandas as pd

from comparison.execution.run import Job, Outcome, Progress, run_all
from comparison.formatting import number
from comparison.scene import Scene
from comparison.studies.shared.frames import Columns, markdown, rows_table
from comparison.studies.shared.rates import rate
from comparison.tables.table import Table

Case = Mapping[str, Any]
"""A model (``"model"``), the value of what goes to its limit, and what else distinguishes a run."""


@dataclass(frozen=True)
class Panel:
    """One of the two panels of a limit's figure, with logarithmic axes."""

    x: str
    y: str
    """Labels of its axes, with units."""
    quantities: tuple[str, ...]
    """Columns that it shows, a line each and for each model."""
    guide: tuple[float, float, float, float]
    """A line of the expected order: from and to which abscissa, its first ordinate, the order."""
    by: str = "variable"
    """With one quantity: the column whose values have a line each."""
    label: str = ""
    """Of a line, with ``{0}`` for quantity or value and ``{1}`` for the model; empty: no legend."""
    rows: str = ""
    """The rows that are shown, as `pandas.DataFrame.query` takes them; empty: all."""


@dataclass(frozen=True)
class Limit:
    """A limit as data: its runs, what is measured of them, and how that is shown."""

    name: str
    """Of what stands in the template and, after ``limit_``, of its figure."""
    variable: str
    """The entry of a case that goes to its limit."""
    cases: Sequence[Case]
    scene: Callable[[Case], Scene]
    measure: Callable[[Case, Table, Table], Mapping[str, float]]
    """From a case, its run and the run that it is held against to columns of a row."""
    values: Callable[[pd.DataFrame], Mapping[str, object]]
    """From the frame of all runs to what else stands in the template."""
    columns: Columns
    """Of the table of all runs; ``"run"`` is the model, with the status of a run that did not succeed."""
    orders: Sequence[str]
    """Columns whose order in the variable is measured."""
    by: tuple[str, ...]
    """Columns whose combinations have an order each; a row without one of them belongs to none."""
    theory: Mapping[tuple[object, ...], Mapping[str, float]]
    """Combination -> column -> expected order."""
    panels: tuple[Panel, Panel]
    asymptotic: str = ""
    """The rows that orders are taken of, as `pandas.DataFrame.query` takes them; empty: all."""
    held_against: Callable[[Case], Job] | None = None
    """The run that a case is held against; by default its own."""
    derive: Callable[[pd.DataFrame], pd.DataFrame] = pd.DataFrame.copy
    """Adds columns to the frame of all runs."""


def jobs(limit: Limit) -> list[Job]:
    """Return the runs of the cases and, in their order, those that they are held against."""
    own = [Job(limit.scene(case), case["model"]) for case in limit.cases]
    return own + ([limit.held_against(case) for case in limit.cases] if limit.held_against else [])


def runs(limit: Limit, outcomes: Sequence[Outcome]) -> pd.DataFrame:
    """Return a row for each case, from the outcomes of `jobs`; one without a result has nothing measured."""
    rows = []
    against = outcomes[-len(limit.cases) :]
    for case, outcome, other in zip(limit.cases, outcomes, against, strict=False):
        row = {**case, "run": case["model"]}
        if outcome.table is None:
            row["run"] += f": {outcome.status}"
        elif other.table is None:
            row["run"] += f", held against: {other.status}"
        else:
            row |= limit.measure(case, outcome.table, other.table)
        rows.append(row)
    return limit.derive(pd.DataFrame(rows))


def measured(
    limits: Sequence[Limit], n_jobs: int, on_progress: Progress | None
) -> list[tuple[Limit, pd.DataFrame]]:
    """Run all limits in one go."""
    parts = [jobs(limit) for limit in limits]
    outcomes = iter(run_all([job for part in parts for job in part], n_jobs, on_progress))
    return [
        (limit, runs(limit, [next(outcomes) for _ in part]))
        for limit, part in zip(limits, parts, strict=True)
    ]


def orders(limit: Limit, frame: pd.DataFrame) -> pd.DataFrame:
    """Return the observed orders in the variable, a row for each combination of `Limit.by`."""
    rows = []
    taken = frame.query(limit.asymptotic) if limit.asymptotic else frame
    for key, group in taken.groupby(list(limit.by), sort=False):
        observed = {name: rate(group[limit.variable].tolist(), group[name].tolist()) for name in limit.orders}
        rows.append(dict(zip(limit.by, key, strict=True)) | observed)
    return pd.DataFrame(rows)


def values(limit: Limit, frame: pd.DataFrame) -> dict[str, object]:
    """Return what stands in the template, after the limit's name: its runs, its orders and its own values."""

    def line(row: Mapping[Any, Any]) -> dict[str, str]:
        theory = limit.theory.get(tuple(row[name] for name in limit.by), {})
        expected = {name: f" ({number(order)})" for name, order in theory.items()}
        key = {
            name: f"{row[name]:g}" if isinstance(row[name], float) else str(row[name]) for name in limit.by
        }
        return key | {name: number(row[name]) + expected.get(name, "") for name in limit.orders}

    observed = rows_table(line(row) for row in orders(limit, frame).to_dict("records"))
    found = {"runs": markdown(frame, limit.columns), "orders": observed, **limit.values(frame)}
    return {f"{limit.name}_{key}": value for key, value in found.items()}
