"""The paper's contact laws on its central case, and the energy that the switch of Eqs. 7-8 creates."""

from collections.abc import Mapping
from math import nan
from pathlib import Path

import numpy as np
import pandas as pd

from comparison.execution.run import Job, Outcome, Progress, run_all
from comparison.formatting import quantity
from comparison.report import svg
from comparison.report.svg import upper_envelope
from comparison.scene import load_scene
from comparison.studies.paper.runs import CENTRAL
from comparison.studies.shared.study import Study, markdown, write_csv
from comparison.tables.table import Table

SWITCHING = "paper-switching"
TOLERANCES = {"hertz-corners": (1e-12,), "foundation": (1e-12,), SWITCHING: (1e-9, 1e-10, 1e-11, 1e-12)}
"""Law -> tolerances of the reference."""
STARTS = (0.0, 1e-9, -1e-9, 2e-9, 1e-8, 1e-5, -1e-5, -1e-4)
"""m, beside the scene's own, of the reference's most accurate runs of the literal law."""
DENSITY = 10
"""Times as many samples of the literal law by the reference: its runs stop, known to their last sample."""
ENERGY_FLOOR = 1e-14  # J: below round-off of the energies; stands for zero on a logarithmic axis
HEADINGS = {
    "energy created": ("spurious_energy_J", "J"),
    "largest speed of x": ("speed_of_x_m/s", "m/s"),
    "largest force": ("force_N", "N"),
    "deepest": ("depth_m", "m"),
}
"""Heading -> column of the runs, and its unit."""

Results = Mapping[tuple[str, str, float, float], Outcome]
"""The runs by law, model, tolerance of the reference (nan: Exudyn) and one of `STARTS`."""


def measure(samples: int, n_jobs: int, on_progress: Progress | None) -> Results:
    """Run one cycle of the central case by both models, with so many samples."""
    keys = [(law, "reference", tolerance, 0.0) for law, each in TOLERANCES.items() for tolerance in each]
    keys += [(law, "exudyn", nan, 0.0) for law in TOLERANCES]
    keys += [(SWITCHING, "reference", min(TOLERANCES[SWITCHING]), start) for start in STARTS[1:]]
    jobs, offset = [], load_scene(CENTRAL).data["mechanism"]["reference_offset"]
    for law, model, tolerance, start in keys:
        values: dict[str, object] = {"contact.law": law, "drive.cycles": 1.0, "output.groups": ["energy"]}
        factor = DENSITY if (law, model) == (SWITCHING, "reference") else 1
        values["output.samples_per_cycle"] = factor * samples
        if model == "reference":
            values["solver.reference.tolerance"] = tolerance
        if start:
            values["initial.slider_offset"] = offset + start
        jobs.append(Job(load_scene(CENTRAL, values), model))
    return dict(zip(keys, run_all(jobs, n_jobs, on_progress), strict=True))


def _table_of(outcome: Outcome) -> Table | None:
    """Return the table of a run, or its part up to where it stopped."""
    table = outcome.table or outcome.partial
    return table if table and len(table.frame) else None


def runs_frame(results: Results) -> pd.DataFrame:
    """Return a row a run in SI units; nan where it recorded nothing. ``end`` in words."""
    rows = []
    for (law, model, tolerance, start), outcome in results.items():
        row: dict[str, object] = {"law": law, "model": model, "tolerance": tolerance, "start_m": start}
        row |= {"status": outcome.status, "end_s": nan}
        row["end"] = f"not simulated: {outcome.message}"
        if run := _table_of(outcome):
            energy, speed = run.values("energy_residual"), run.extrema["slider_vx"]
            touches = (
                pd.DataFrame(columns=["peak_force", "largest_depth"]) if run.events is None else run.events
            )
            row |= {
                "end_s": float(run.time[-1]),
                "end": "1 cycle" if outcome.table else f"{outcome.status} at {run.time[-1]:.4f} s",
                # Minus the residual of the balance: created where it is above zero.
                "spurious_energy_J": -float(energy[-1]),
                "largest_spurious_energy_J": float(np.abs(energy).max()),
                "speed_of_x_m/s": max(abs(speed["min"]), abs(speed["max"])),
                "force_N": touches["peak_force"].max(),
                "depth_m": touches["largest_depth"].max(),
            }
        rows.append(row)
    frame = pd.DataFrame(rows)
    return frame.sort_values("law", key=lambda laws: laws.map(list(TOLERANCES).index), kind="stable")


def page(results: Results) -> dict[str, object]:
    """Return the variables of the template."""
    frame = runs_frame(results)
    finest = frame[(frame["model"] == "reference") & (frame["tolerance"] == min(TOLERANCES[SWITCHING]))]
    largest = finest.groupby("law", sort=False)["largest_spurious_energy_J"].agg(["min", "median", "max"])
    frame = frame[frame["start_m"] == 0]
    tolerance = frame["tolerance"].map("{:.0e}".format).where(frame["tolerance"].notna(), "")
    cells: dict[str, list[str]] = {
        heading: [quantity(value, unit) for value in frame.get(name, nan * frame["end_s"])]
        for heading, (name, unit) in HEADINGS.items()
    }
    return {
        "largest": largest.dropna(),
        "starts": len(STARTS),
        "tolerance": f"{min(TOLERANCES[SWITCHING]):.0e}",
        "runs": markdown(frame[["law", "model"]].assign(tolerance=tolerance, **cells, end=frame["end"])),
    }


def draw(results: Results, folder: Path) -> None:
    """Write the runs as a table, and draw the energy of the reference's most accurate run of each law."""
    write_csv({"runs": runs_frame(results)}, folder, "%.6g")
    with svg.panels(folder / "energy.svg") as (axes,):
        for law, line in zip(TOLERANCES, svg.SERIES_LINES, strict=False):
            if run := _table_of(results[law, "reference", min(TOLERANCES[law]), 0.0]):
                size = np.maximum(np.abs(run.values("energy_residual")), ENERGY_FLOOR)
                points = upper_envelope(size)
                axes.plot(run.time[points], size[points], label=law, **line)
        axes.set(xlabel="time (s)", ylabel="|energy created| (J)", yscale="log")
        svg.legend_above(axes)


STUDY = Study("laws", small=200, full=4000, measure=measure, page=page, draw=draw, part_of="paper")
