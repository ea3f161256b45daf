"""The three contact laws on the paper's central case, and what the literal switch of Eqs. 7-8 does there."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from math import nan
from pathlib import Path

import numpy as np
import pandas as pd

from comparison.execution.run import Job, Outcome, Progress, run_all
from comparison.report import svg
from comparison.report.svg import upper_envelope
from comparison.scene import load_scene
from comparison.studies.shared.frames import Quantities, quantities, write_csv
from comparison.studies.shared.study import Study
from comparison.studies.shared.switches import created, depths, surplus, switches
from comparison.tables.table import Table

LAWS = ("hertz-corners", "foundation", "paper-switching")
LITERAL = LAWS[-1]
TOLERANCES = (1e-9, 1e-10, 1e-11, 1e-12)
SHOWN = 1e-10
"""Of the figure."""
APART = 1e-6
"""m, half a hundredth of the clearance: closer runs follow each other."""
LEAST = 1e-14
"""J: below round-off of the energies; what a logarithmic axis shows of zero."""
RUNS: Quantities = {
    "law": "law",
    "model": "model",
    "spurious energy": ("spurious_energy_J", "J"),
    "largest speed of x": ("speed_of_x_m/s", "m/s"),
    "largest force": ("force_N", "N"),
    "deepest": ("depth_m", "m"),
    "end": "end",
}
SWITCHES: Quantities = {
    "tolerance": "tolerance",
    "switches": "switches",
    "closest two": ("closest", "s"),
    "median energy": ("median", "J"),
    "largest": ("largest", "J"),
    "sum of all": ("sum", "J", 6),
    "total residual": ("total", "J", 6),
    "largest deviation": ("deviation", "", 2),
}
"""Columns of both tables of the page."""


@dataclass(frozen=True)
class Config:
    """Samples a cycle."""

    dense: int  # of the reference under paper-switching
    sparse: int  # of all other runs


Results = Mapping[tuple[str, str, float], Outcome]
"""The runs by law, model and tolerance of the reference (nan: Exudyn)."""


def measure(config: Config, n_jobs: int, on_progress: Progress | None) -> Results:
    """Run one cycle of the central case by both models, by the reference at several tolerances."""
    which = [(law, "reference", tolerance) for law in LAWS for tolerance in TOLERANCES]
    which += [(law, "exudyn", nan) for law in LAWS]
    jobs = []
    for law, model, tolerance in which:
        reference = model == "reference"
        values: dict[str, object] = {
            "contact.law": law,
            "drive.cycles": 1.0,
            "output.groups": ["energy"],
            "output.samples_per_cycle": config.dense if reference and law == LITERAL else config.sparse,
        } | ({"solver.reference.tolerance": tolerance} if reference else {})
        jobs.append(Job(load_scene("150rpm-0.2mm", values), model))
    return dict(zip(which, run_all(jobs, n_jobs, on_progress), strict=True))


def recorded(outcome: Outcome) -> Table | None:
    """Return the table of a run; of one that stopped, what it had come to, if anything."""
    table = outcome.table or outcome.partial
    return None if table is None or table.events is None or not len(table.frame) else table


# ---- tables


def run_row(outcome: Outcome, law: str, best: Table | None) -> dict[str, object]:
    """Return what a run under a law came to, in SI units.

    ``follows_until_s``: until when its x is within `APART` of the most accurate run's.
    """
    row: dict[str, object] = {"status": outcome.status, "message": outcome.message}
    run = recorded(outcome)
    if run is None or run.events is None:
        return row | {"end_s": nan, "largest_spurious_energy_J": nan}
    speed, rotation = (
        max(abs(run.extrema[name]["min"]), abs(run.extrema[name]["max"]))
        for name in ("slider_vx", "slider_omega")
    )
    return row | {
        "end_s": run.time[-1],
        "steps": run.provenance["counters"]["steps"],
        # Of a foundation the rows are contacts of sides.
        "switches": nan if law == "foundation" else len(switches(run.events)),
        "spurious_energy_J": -run.values("energy_residual")[-1],
        "largest_spurious_energy_J": np.abs(run.values("energy_residual")).max(),
        "speed_of_x_m/s": speed,
        "rotation_rad/s": rotation,
        "force_N": run.events["peak_force"].max(),
        "depth_m": run.events["largest_depth"].max(),
        "follows_until_s": nan if best is None else _follows(run, best),
    }


def _follows(run: Table, best: Table) -> float:
    time = run.time[run.time <= best.time[-1]]
    x = np.interp(time, best.time, best.values("slider_x"))
    off = np.abs(run.values("slider_x")[: time.size] - x) > APART
    return float(time[np.argmax(off)] if off.any() else time[-1])


def runs_frame(results: Results) -> pd.DataFrame:
    """Return a row a run, by law."""
    best = {law: recorded(results[law, "reference", min(TOLERANCES)]) for law in LAWS}
    return pd.DataFrame(
        {"law": law, "model": model, "tolerance": tolerance} | run_row(outcome, law, best[law])
        for (law, model, tolerance), outcome in results.items()
    )


def switches_frame(results: Results) -> pd.DataFrame:
    """Return the literal law's switches: depth of the other corner (m), energy created, by theory (J).

    Of the reference's complete runs, where their samples separate the switches.
    """
    frames, columns = [], ["tolerance", "time", "to_surface", "depth", "energy", "theory"]
    for tolerance in TOLERANCES:
        run = results[LITERAL, "reference", tolerance].table
        if run is not None and run.events is not None:
            found, data = switches(run.events), run.provenance["scene"]
            depth = depths(found, run, data)
            theory = np.where(found["to_surface"], 1.0, -1.0) * surplus(depth, data)
            with suppress(ValueError):
                energy = created(found, run)
                frames.append(found.assign(tolerance=tolerance, depth=depth, energy=energy, theory=theory))
    return pd.concat(frames)[columns] if frames else pd.DataFrame(columns=columns)


# ---- page


def page(results: Results) -> dict[str, object]:
    """Return what stands in the page."""
    runs = runs_frame(results)
    best = runs[(runs["model"] == "exudyn") | (runs["tolerance"] == min(TOLERANCES))]
    return {
        "largest": best[best["model"] == "reference"].dropna(subset=["largest_spurious_energy_J"]),
        "runs": quantities(shown_runs(best), RUNS),
        "switches": quantities(
            shown_switches(switches_frame(results), runs[runs["law"] == LITERAL]), SWITCHES
        ),
        "tolerance": f"{min(TOLERANCES):.0e}",
    }


def shown_runs(runs: pd.DataFrame) -> pd.DataFrame:
    """Return the lines of the page's first table: how a run ended, or why it is not there."""
    stopped = runs["status"] + runs["end_s"].map(" at {:.4f} s".format)
    ends = stopped.where(runs["end_s"] >= 0.0, "not simulated: " + runs["message"])
    ends = ends.mask(runs["status"] == "success", "1 cycle")
    return runs.assign(end=ends).sort_values("law", key=lambda laws: laws.map(LAWS.index), kind="stable")


def shown_switches(switched: pd.DataFrame, runs: pd.DataFrame) -> pd.DataFrame:
    """Return a line for each tolerance with the energies that the switches of its run created."""
    sizes = switched.assign(
        size=switched["energy"].abs(),
        expected=switched["theory"].abs(),
        off=(switched["energy"] - switched["theory"]).abs(),
    ).groupby("tolerance")
    lines = pd.DataFrame(
        {
            "closest": sizes["time"].agg(lambda times: times.diff().min()),
            "median": sizes["size"].median(),
            "largest": sizes["size"].max(),
            "sum": sizes["energy"].sum(),
            # Of the largest, since a switch with both corners at the wall creates nothing measurable.
            "deviation": sizes["off"].max() / sizes["expected"].max(),
        },
        index=TOLERANCES,
    )
    found = runs.set_index("tolerance").reindex(columns=["spurious_energy_J", "switches"])
    lines["total"], lines["switches"] = found["spurious_energy_J"], found["switches"].astype("Int64")
    return lines.reset_index(names="tolerance")


def draw(results: Results, folder: Path) -> None:
    """Write runs and switches as tables, and draw the energy by law, and by tolerance."""
    write_csv({"runs": runs_frame(results), "switches": switches_frame(results)}, folder, "%.6g")
    laws = {law: results[law, "reference", SHOWN] for law in LAWS}
    literal = {f"{t:.0e}": results[LITERAL, "reference", t] for t in TOLERANCES}
    for name, outcomes in (("energy", laws), ("tolerances", literal)):
        with svg.panels(folder / f"{name}.svg") as (axes,):
            for (label, outcome), line in zip(outcomes.items(), svg.SERIES_LINES, strict=False):
                if (run := recorded(outcome)) is None:
                    axes.plot([], [], label=f"{label}: stopped", **line)
                    continue
                size = np.maximum(np.abs(run.values("energy_residual")), LEAST)
                kept = upper_envelope(size)
                axes.plot(run.time[kept], size[kept], label=label, **line)
            axes.set(xlabel="time (s)", ylabel="|spurious energy| (J)", yscale="log")
            svg.legend_above(axes)


STUDY = Study(
    "contact-laws",
    small=Config(dense=1000, sparse=200),
    # 1 us apart, to separate the switches.
    full=Config(dense=400_000, sparse=4000),
    measure=measure,
    page=page,
    draw=draw,
)
