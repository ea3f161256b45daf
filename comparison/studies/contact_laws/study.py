"""The three contact laws on the paper's central case, and what the literal switch of Eqs. 7-8 does there."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from math import nan
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from comparison.execution.run import Job, Outcome, Progress, run_all
from comparison.formatting import MISSING, number, quantity
from comparison.report import svg
from comparison.report.svg import envelope, upper_envelope
from comparison.scene import Scene, load_scene
from comparison.studies.shared.frames import rows_table
from comparison.studies.shared.study import Study
from comparison.studies.shared.switches import closest, contacts, created, depths, surplus, switches
from comparison.tables.table import Table

LAWS = ("hertz-corners", "foundation", "paper-switching")
LITERAL = LAWS[-1]
TOLERANCES = (1e-9, 1e-10, 1e-11, 1e-12)
SHOWN = 1e-10
"""Of the figures."""
REVERSAL = (0.195, 0.235)
"""s; the bottom dead centre is at 0.2144 s."""
APART = 1e-6
"""m, half a hundredth of the clearance: closer runs follow each other."""
LEAST = 1e-14
"""J: below round-off of the energies; what a logarithmic axis shows of zero."""


@dataclass(frozen=True)
class Config:
    """Samples a cycle."""

    dense: int
    """Of the reference under paper-switching."""
    sparse: int
    """Of all other runs."""


@dataclass(frozen=True)
class Results:
    """The runs of the reference, by law and tolerance, and of Exudyn, by law."""

    reference: dict[tuple[str, float], Outcome]
    exudyn: dict[str, Outcome]


def scene(law: str, config: Config, tolerance: float | None = None) -> Scene:
    """Return one cycle of the central case under a law; without a tolerance: as Exudyn runs it."""
    dense = law == LITERAL and tolerance is not None
    values: dict[str, object] = {
        "contact.law": law,
        "drive.cycles": 1.0,
        "output.groups": ["energy"],
        "output.samples_per_cycle": config.dense if dense else config.sparse,
    }
    if tolerance is not None:
        values["solver.reference.tolerance"] = tolerance
    return load_scene("150rpm-0.2mm", values)


def measure(config: Config, n_jobs: int, on_progress: Progress | None) -> Results:
    """Run the laws by both models, the reference at several tolerances."""
    which = [(law, tolerance) for law in LAWS for tolerance in TOLERANCES]
    jobs = [Job(scene(law, config, tolerance), "reference") for law, tolerance in which]
    jobs += [Job(scene(law, config), "exudyn") for law in LAWS]
    outcomes = run_all(jobs, n_jobs, on_progress)
    return Results(
        dict(zip(which, outcomes, strict=False)), dict(zip(LAWS, outcomes[len(which) :], strict=True))
    )


def recorded(outcome: Outcome) -> Table | None:
    """Return the table of a run; of one that stopped, what it had come to."""
    return outcome.table or outcome.partial


# ---- runs and switches as tables


def runs_frame(results: Results) -> pd.DataFrame:
    """Return a row a run, in SI units."""
    runs = [(law, "reference", tolerance, run) for (law, tolerance), run in results.reference.items()]
    runs += [(law, "exudyn", nan, run) for law, run in results.exudyn.items()]
    best = {law: recorded(results.reference[law, min(TOLERANCES)]) for law in LAWS}
    return pd.DataFrame(
        {"law": law, "model": model, "tolerance": tolerance} | run_row(outcome, law, best[law])
        for law, model, tolerance, outcome in runs
    )


def run_row(outcome: Outcome, law: str, best: Table | None) -> dict[str, Any]:
    """Return what a run under a law came to; of one that stopped, what it had come to.

    ``follows_until_s``: until when its x is within `APART` of the most accurate run's.
    """
    row: dict[str, Any] = {"status": outcome.status, "message": outcome.message}
    result = recorded(outcome)
    if result is None or result.events is None or len(result.frame) == 0:
        return row
    events, peaks = result.events, result.extrema
    return row | {
        "end_s": result.time[-1],
        "steps": result.provenance["counters"]["steps"],
        # Of a foundation the rows are contacts of sides.
        "switches": nan if law == "foundation" else len(switches(events)),
        "spurious_energy_J": -result.values("energy_residual")[-1],
        "largest_spurious_energy_J": result.frame["energy_residual"].abs().max(),
        "speed_of_x_m/s": _largest(peaks["slider_vx"]),
        "rotation_rad/s": _largest(peaks["slider_omega"]),
        "force_N": events["peak_force"].max(),
        "depth_m": events["largest_depth"].max(),
        "follows_until_s": _follows(result, best),
    }


def _largest(peak: Mapping[str, float]) -> float:
    return max(abs(peak["min"]), abs(peak["max"]))


def _follows(result: Table, best: Table | None) -> float:
    if best is None or len(best.frame) == 0:
        return nan
    time = result.time[result.time <= best.time[-1]]
    x = np.interp(time, best.time, best.values("slider_x"))
    off = np.abs(result.values("slider_x")[: time.size] - x) > APART
    return float(time[np.argmax(off)] if off.any() else time[-1])


def switches_frame(run: Table) -> pd.DataFrame:
    """Return the switches of a run: depth of the other corner (m), energy created, the same by theory (J).

    Raises
    ------
    ValueError
        If its samples do not separate them.
    """
    instants = switches(contacts(run))
    energy, data = created(instants, run), run.provenance["scene"]
    depth = depths(instants, run, data)
    theory = np.where(instants["to_surface"], 1.0, -1.0) * surplus(depth, data)
    return instants.drop(columns="corner").assign(depth=depth, energy=energy, theory=theory)


# ---- page


def page(results: Results) -> dict[str, object]:
    """Return what stands in the page."""
    runs = runs_frame(results)
    accurate = runs[(runs["model"] == "exudyn") | (runs["tolerance"] == min(TOLERANCES))]
    largest = (
        accurate[accurate["model"] == "reference"].set_index("law")["largest_spurious_energy_J"].dropna()
    )
    by_law = ", ".join(f"{law} {quantity(energy, 'J')}" for law, energy in largest.items())
    ordered = accurate.sort_values("law", key=lambda laws: laws.map(LAWS.index), kind="stable")
    literal = {tolerance: results.reference[LITERAL, tolerance] for tolerance in TOLERANCES}
    return {
        "finding": f"Largest spurious energy, by law: {by_law}.",
        "runs": rows_table(shown_run(row) for row in ordered.to_dict("records")),
        "switches": rows_table(shown_switches(*each) for each in literal.items()),
        "tolerance": f"{min(TOLERANCES):.0e}",
    }


def shown_run(row: Mapping[Hashable, Any]) -> dict[str, str]:
    """Return a line of the page's first table."""
    reached = row.get("end_s", nan)
    if row["status"] == "success":
        end = "1 cycle"
    else:
        end = f"{row['status']} at {reached:.4f} s" if reached >= 0.0 else f"not simulated: {row['message']}"
    numbers = {
        "spurious energy": ("spurious_energy_J", "J"),
        "largest speed of x": ("speed_of_x_m/s", "m/s"),
        "largest force": ("force_N", "N"),
        "deepest": ("depth_m", "m"),
    }
    shown = {heading: quantity(row.get(key, nan), unit) for heading, (key, unit) in numbers.items()}
    return {"law": row["law"], "model": row["model"]} | shown | {"end": end}


def shown_switches(tolerance: float, outcome: Outcome) -> dict[str, str]:
    """Return a line with the energies that the switches of one run created."""
    line = {"tolerance": f"{tolerance:.0e}", "switches": f"not measured: {outcome.status}"}
    names = ("closest two", "median energy", "largest", "sum of all", "total residual", "largest deviation")
    numbers = dict.fromkeys(names, MISSING)
    if (run := outcome.table) is None:
        return line | numbers
    instants = switches(contacts(run))
    try:
        frame = switches_frame(run)
    except ValueError as error:
        return line | {"switches": f"{len(instants)}, not measured: {error}"} | numbers
    sizes, expected = frame["energy"].abs(), frame["theory"].abs().max()
    # Of the largest, since a switch with both corners at the wall creates nothing that could be measured.
    deviation = (frame["energy"] - frame["theory"]).abs().max() / expected if len(frame) else 0.0
    values = (
        quantity(closest(instants), "s"),
        quantity(sizes.median() if len(frame) else 0.0, "J"),
        quantity(sizes.max() if len(frame) else 0.0, "J"),
        quantity(float(frame["energy"].sum()), "J", 6),
        quantity(-run.values("energy_residual")[-1], "J", 6),
        number(deviation, 2),
    )
    return line | {"switches": str(len(frame))} | dict(zip(names, values, strict=True))


# ---- figures


def draw(results: Results, folder: Path) -> None:
    """Write the figures, and runs and switches as tables."""
    runs_frame(results).to_csv(folder / "runs.csv", index=False, float_format="%.6g")
    frames = []
    for tolerance in TOLERANCES:
        with suppress(ValueError):  # the page tells
            if (run := results.reference[LITERAL, tolerance].table) is not None:
                frames.append(switches_frame(run).assign(tolerance=tolerance))
    columns = ["tolerance", "time", "to_surface", "depth", "energy", "theory"]
    switched = pd.concat(frames)[columns] if frames else pd.DataFrame(columns=columns)
    switched.to_csv(folder / "switches.csv", index=False, float_format="%.6g")
    laws = {law: recorded(results.reference[law, SHOWN]) for law in LAWS}
    literal = {f"{t:.0e}": recorded(results.reference[LITERAL, t]) for t in TOLERANCES}
    for name, runs in (("energy", laws), ("tolerances", literal)):
        with svg.panels(folder / f"{name}.svg") as (axes,):
            _energy(axes, runs)
    with svg.panels(folder / "slider_x.svg") as (axes,):
        for (law, run), line in zip(laws.items(), svg.SERIES_LINES, strict=False):
            if run is not None:
                inside = (run.time >= REVERSAL[0]) & (run.time <= REVERSAL[1])
                guide = run.provenance["scene"]["mechanism"]["guide_x"]
                time, x = run.time[inside], 1e3 * (run.values("slider_x")[inside] - guide)
                kept = envelope(x)
                axes.plot(time[kept], x[kept], label=law, **line)
        axes.set(xlabel="time (s)", ylabel="slider x − guide (mm)")
        svg.legend_above(axes)


def _energy(axes: Axes, runs: Mapping[str, Table | None]) -> None:
    for (label, run), line in zip(runs.items(), svg.SERIES_LINES, strict=False):
        if run is None:
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
