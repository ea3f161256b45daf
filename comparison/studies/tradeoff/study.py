"""Speed against accuracy of every formulation and integrator."""

from __future__ import annotations

from dataclasses import dataclass

import pandas as pd

from comparison.execution.run import Progress
from comparison.execution.store import Row
from comparison.execution.tasks import SUCCESS, measure_all, on_processes
from comparison.formatting import quantity
from comparison.models import platform_name
from comparison.studies.shared.study import Study
from comparison.studies.tradeoff import growth, tables
from comparison.studies.tradeoff.figures import COSTS, draw
from comparison.studies.tradeoff.measure import LONG, QUANTITIES, TRUTH, Timed, confirmations, measure
from comparison.studies.tradeoff.methods import CHIEF, SCENES, SWEEPS, TITLES, WITH_CLEARANCE


@dataclass(frozen=True)
class Config:
    """How much is measured."""

    settings: int
    """Of each method, from the coarsest, at most."""
    rounds: int
    busy: float
    """Runs of each, and s that they take together, at least."""
    cycles: float
    """Of the longest run."""


@dataclass(frozen=True)
class Results:
    """What was measured."""

    config: Config
    rows: list[Row]
    """Of every setting of every method: ``method``, ``model``, ``scene``, ``setting`` and what
    `comparison.studies.tradeoff.measure` returns of it."""
    grown: list[Row]
    """The same of each run of `comparison.studies.tradeoff.growth`."""
    confirmed: list[float]
    """Distance of the models' most accurate runs, m of x, of each of `WITH_CLEARANCE`."""


def measured(config: Config, n_jobs: int, on_progress: Progress | None) -> Results:
    """Measure in one process, whatever ``n_jobs`` says, since it is timed."""
    asked = [
        (
            {"method": of.method.name, "model": of.method.model, "scene": name, "setting": setting},
            Timed(of.method.model, of.scene(name, setting), config.rounds, config.busy, name),
        )
        for of in SWEEPS
        for name in of.scenes
        for setting in of.settings[: config.settings]
    ]
    swept = len(asked)
    asked += [
        (labels | {"method": method.title}, Timed(method.model, scene, config.rounds, config.busy))
        for labels, method, scene in growth.growing(config.cycles)
    ]
    found = measure_all(measure, [task for _, task in asked], on_processes(1), on_progress)
    rows = [row | labels for (labels, _), row in zip(asked, found, strict=True)]
    return Results(config, rows[:swept], rows[swept:], confirmations(WITH_CLEARANCE, n_jobs))


def page(results: Results) -> dict[str, object]:
    """Return what stands in the page."""
    rows, config = pd.json_normalize(results.rows), results.config
    lost = [
        f"- {row['model']}, {row['method']}, {row['scene']}, {row['setting']:g}: {row['status']}"
        for row in results.rows
        if row["status"] != SUCCESS
    ]
    return {
        "finding": tables.finding(rows),
        "rounds": config.rounds,
        "busy": f"{config.busy:g}",
        "long": f"{LONG:g}",
        "machine": platform_name(),
        "truth": f"{TRUTH:.0e}",
        "confirmed": " and ".join(quantity(apart, "m", 1) for apart in results.confirmed),
        "ratios": tables.ratios(rows),
        "equal": "\n\n".join(
            f"{TITLES[scene]}:\n\n{tables.equal_error(rows, scene)}" for scene in WITH_CLEARANCE
        ),
        "figures": "\n\n".join(
            f"![{TITLES[scene]}: {label} over {QUANTITIES[CHIEF[scene]][0]}]({scene}-{cost}.svg)"
            for scene in SCENES
            for cost, label in COSTS.items()
        ),
        "bounds": tables.bounds(rows),
        "orders": tables.orders(rows),
        **growth.tables(pd.DataFrame(results.grown)),
        "failed": "\n".join(lost) or "None.",
    }


STUDY = Study(
    "tradeoff",
    small=Config(settings=2, rounds=1, busy=0.0, cycles=3.0),
    full=Config(settings=8, rounds=3, busy=0.5, cycles=1000.0),
    measure=measured,
    page=page,
    draw=lambda results, folder: draw(pd.json_normalize(results.rows), folder),
    data=lambda results: {"machine": platform_name(), "rows": results.rows},
)
