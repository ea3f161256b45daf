"""The three contact laws on the paper's central case, and what the literal switch of Eqs. 7-8 does there."""

from collections.abc import Mapping
from contextlib import suppress
from math import nan
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from comparison.execution.run import Job, Outcome, Progress, run_all
from comparison.report import svg
from comparison.report.svg import upper_envelope
from comparison.scene import load_scene
from comparison.studies.shared.study import Quantities, Study, quantities, write_csv
from comparison.studies.shared.switches import contacts, created, depths, surplus, switches
from comparison.tables.table import Table

LAWS = ("hertz-corners", "foundation", "paper-switching")
LITERAL = LAWS[-1]
TOLERANCES = (1e-9, 1e-10, 1e-11, 1e-12)
SHOWN = 1e-10  # of the figure
APART = 1e-6  # m, half a hundredth of the clearance: closer runs follow each other
LEAST = 1e-14  # J: below round-off of the energies; what a logarithmic axis shows of zero
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


class Config(NamedTuple):
    """Samples a cycle."""

    dense: int  # of the reference under paper-switching
    sparse: int  # of all other runs


Results = Mapping[tuple[str, str, float], Outcome]
"""The runs by law, model and tolerance of the reference (nan: Exudyn)."""


def measure(config: Config, n_jobs: int, on_progress: Progress | None) -> Results:
    """Run one cycle of the central case by both models, by the reference at several tolerances."""
    by_model = {"reference": TOLERANCES, "exudyn": (nan,)}
    which = [(law, model, tol) for model, tols in by_model.items() for law in LAWS for tol in tols]
    jobs = []
    for law, model, tolerance in which:
        dense = model == "reference" and law == LITERAL
        values: dict[str, object] = {
            "contact.law": law,
            "drive.cycles": 1.0,
            "output.groups": ["energy"],
            "output.samples_per_cycle": config.dense if dense else config.sparse,
        } | ({"solver.reference.tolerance": tolerance} if model == "reference" else {})
        jobs.append(Job(load_scene("150rpm-0.2mm", values), model))
    return dict(zip(which, run_all(jobs, n_jobs, on_progress), strict=True))


def _recorded(outcome: Outcome) -> Table | None:
    """Return the table of a run; of one that stopped, what it had come to, if anything."""
    table = outcome.table or outcome.partial
    return None if table is None or table.events is None or not len(table.frame) else table


# ---- tables


def runs_frame(results: Results) -> pd.DataFrame:
    """Return what each run came to, a row each, in SI units.

    ``follows_until_s``: until when its x is within `APART` of that of the law's most accurate run.
    """
    rows = []
    for (law, model, tolerance), outcome in results.items():
        row: dict[str, object] = {"law": law, "model": model, "tolerance": tolerance}
        row |= {"status": outcome.status, "message": outcome.message}
        if (run := _recorded(outcome)) is None:
            rows.append(row | {"end_s": nan, "largest_spurious_energy_J": nan})
            continue
        best = _recorded(results[law, "reference", min(TOLERANCES)])
        speed, rotation = (
            max(abs(run.extrema[name]["min"]), abs(run.extrema[name]["max"]))
            for name in ("slider_vx", "slider_omega")
        )
        touches, energy = contacts(run), run.values("energy_residual")
        row |= {
            "end_s": run.time[-1],
            "steps": run.provenance["counters"]["steps"],
            # Of a foundation the rows are contacts of sides.
            "switches": nan if law == "foundation" else len(switches(touches)),
            "spurious_energy_J": -energy[-1],
            "largest_spurious_energy_J": np.abs(energy).max(),
            "speed_of_x_m/s": speed,
            "rotation_rad/s": rotation,
            "force_N": touches["peak_force"].max(),
            "depth_m": touches["largest_depth"].max(),
            "follows_until_s": nan if best is None else _follows(run, best),
        }
        rows.append(row)
    return pd.DataFrame(rows)


def _follows(run: Table, best: Table) -> float:
    time = run.time[run.time <= best.time[-1]]
    x = np.interp(time, best.time, best.values("slider_x"))
    off = np.abs(run.values("slider_x")[: time.size] - x) > APART
    return float(time[np.argmax(off)] if off.any() else time[-1])


def switches_frame(results: Results) -> pd.DataFrame:
    """Return the literal law's switches: depth of the other corner (m), energy created, by theory (J).

    Of the reference's complete runs, where their samples separate the switches.
    """
    frames, columns = [], ["tolerance", "time", "to_surface", "depth", "energy", "theory"]
    for tolerance in TOLERANCES:
        if (run := results[LITERAL, "reference", tolerance].table) is not None:
            jumps, data = switches(contacts(run)), run.provenance["scene"]
            depth = depths(jumps, run, data)
            theory = np.where(jumps["to_surface"], 1.0, -1.0) * surplus(depth, data)
            with suppress(ValueError):
                energy = created(jumps, run)
                frames.append(jumps.assign(tolerance=tolerance, depth=depth, energy=energy, theory=theory))
    return pd.concat(frames)[columns] if frames else pd.DataFrame(columns=columns)


# ---- page


def page(results: Results) -> dict[str, object]:
    """Return what stands in the page."""
    runs, switched = runs_frame(results), switches_frame(results)
    best = runs[(runs["model"] == "exudyn") | (runs["tolerance"] == min(TOLERANCES))]
    stopped = best["status"] + best["end_s"].map(" at {:.4f} s".format)
    end = stopped.where(best["end_s"] >= 0.0, "not simulated: " + best["message"])
    shown = best.assign(end=end.mask(best["status"] == "success", "1 cycle"))
    literal = runs[runs["law"] == LITERAL].set_index("tolerance")
    sizes = switched.assign(
        size=switched["energy"].abs(),
        expected=switched["theory"].abs(),
        off=(switched["energy"] - switched["theory"]).abs(),
    ).groupby("tolerance")
    by_tolerance = pd.DataFrame(
        {
            "closest": sizes["time"].agg(lambda times: times.diff().min()),
            "median": sizes["size"].median(),
            "largest": sizes["size"].max(),
            "sum": sizes["energy"].sum(),
            # Of the largest, since a switch with both corners at the wall creates nothing measurable.
            "deviation": sizes["off"].max() / sizes["expected"].max(),
        },
        index=TOLERANCES,
    ).join(literal.reindex(columns=["spurious_energy_J", "switches"]))
    by_tolerance["switches"] = by_tolerance["switches"].astype("Int64")
    named = by_tolerance.rename(columns={"spurious_energy_J": "total"}).reset_index(names="tolerance")
    return {
        "largest": best[best["model"] == "reference"].dropna(subset=["largest_spurious_energy_J"]),
        "runs": quantities(
            shown.sort_values("law", key=lambda laws: laws.map(LAWS.index), kind="stable"), RUNS
        ),
        "switches": quantities(named, SWITCHES),
        "tolerance": f"{min(TOLERANCES):.0e}",
        "surplus": float(surplus(np.array(1e-6), load_scene("150rpm-0.2mm").data)),
    }


def draw(results: Results, folder: Path) -> None:
    """Write runs and switches as tables, and draw the energy by law, and by tolerance."""
    write_csv({"runs": runs_frame(results), "switches": switches_frame(results)}, folder, "%.6g")
    laws = {law: results[law, "reference", SHOWN] for law in LAWS}
    literal = {f"{t:.0e}": results[LITERAL, "reference", t] for t in TOLERANCES}
    for name, outcomes in (("energy", laws), ("tolerances", literal)):
        with svg.panels(folder / f"{name}.svg") as (axes,):
            for (label, outcome), line in zip(outcomes.items(), svg.SERIES_LINES, strict=False):
                if (run := _recorded(outcome)) is None:
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
    full=Config(dense=400_000, sparse=4000),  # 1 us apart, to separate the switches
    measure=measure,
    page=page,
    draw=draw,
)
