"""The three contact laws on the paper's central case, and what the literal switch of Eqs. 7-8 does there.

Under ``paper-switching`` the potential of a side jumps whenever its second corner touches or one of two
leaves. The motion does not jump there, so the energy residual does: by what was created, and nowhere else.
"""

from collections.abc import Mapping
from contextlib import suppress
from math import nan
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from comparison.execution.run import Job, Outcome, Progress, run_all
from comparison.report import svg
from comparison.report.svg import upper_envelope
from comparison.scene import load_scene
from comparison.studies.shared.study import Quantities, Study, quantities, write_csv
from comparison.tables.channels import Array
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


# ---- where the law changes from corners to surface and back, and the energy that each change creates

SIDES = (("ll", "ul"), ("lr", "ur"))


def contacts(run: Table) -> pd.DataFrame:
    """Return the contacts of a run with clearance, which has them always; a row each, by their start."""
    return pd.DataFrame() if run.events is None else run.events


def switches(events: pd.DataFrame) -> pd.DataFrame:
    """Return the instants at which the number of touching corners of a side becomes or ceases to be two.

    Columns ``time`` (s), ascending; ``to_surface``; ``corner``: the one that touches on both sides of the
    instant, whose depth decides how much energy is created.
    """
    rows = []
    for side in SIDES:
        touching = [events[events["corner"] == corner] for corner in side]
        # Both at once: from the later start to the earlier end, for each pair that overlaps.
        starts, ends = ([each[name].to_numpy(np.float64) for each in touching] for name in ("start", "end"))
        start, end = np.maximum.outer(*starts), np.minimum.outer(*ends)
        for i, j in np.argwhere(start < end):
            first = side[0] if starts[0][i] < starts[1][j] else side[1]
            last = side[0] if ends[0][i] > ends[1][j] else side[1]
            rows += [(start[i, j], True, first), (end[i, j], False, last)]
    frame = pd.DataFrame(rows, columns=["time", "to_surface", "corner"])
    return frame.sort_values("time", kind="stable", ignore_index=True)


def created(changes: pd.DataFrame, table: Table) -> Array:
    """Return the energy that each of `switches` created, J: minus the jump of the residual across it.

    Raises ValueError if two switches lie between the same two samples: their jumps cannot be separated.
    """
    after = np.searchsorted(table.time, changes["time"])
    if np.unique(after).size < after.size:
        closest, apart = np.diff(changes["time"]).min(), table.time[1]
        raise ValueError(f"samples {apart:.2g} s apart do not separate switches {closest:.2g} s apart")
    residual = table.values("energy_residual")
    return np.asarray(residual[after - 1] - residual[after])


def depths(changes: pd.DataFrame, table: Table, scene: dict[str, Any]) -> Array:
    """Return the depth (m) of the touching corner at each switch, shape (n,).

    The parabola through the three samples on the side of the switch where that corner touches alone: there
    the motion is gentle, beyond it the surface force bends it within a sample.
    """
    angle, x = table.values("slider_angle"), table.values("slider_x")
    slider, guide = scene["mechanism"]["slider"], scene["mechanism"]["guide_x"]
    half = slider["width"] / 2
    after = np.searchsorted(table.time, changes["time"])
    result = np.empty(len(changes))
    for n, (time, to_surface, corner) in enumerate(changes.itertuples(index=False, name=None)):
        first = max(0, after[n] - 3) if to_surface else min(after[n], angle.size - 3)
        part = slice(first, first + 3)
        right, up = (1.0 if corner[1] == "r" else -1.0), (1.0 if corner[0] == "u" else -1.0)
        # A corner's distance from the guide's centre line towards its wall, Eqs. 2-6.
        arm = right * half * np.cos(angle[part]) - up * slider["length"] / 2 * np.sin(angle[part])
        depth = right * (x[part] - guide + arm) - half - scene["clearance"]["slider"]
        s = (time - table.time[first + 1]) / (table.time[first + 1] - table.time[first])
        result[n] = np.dot([s * (s - 1) / 2, 1 - s * s, s * (s + 1) / 2], depth)
    return result


def corner_stiffness(contact: dict[str, Any]) -> float:
    """Return K of one corner, N/m^n (Eq. 10)."""
    return float(4 / (3 * _compliance(contact)) * np.sqrt(contact["corner_radius"]))


def _compliance(contact: dict[str, Any]) -> float:
    return float(2 * (1 - contact["poisson"] ** 2) / contact["youngs_modulus"])  # sigma_m + sigma_n, 1/Pa


def surplus(depth: Array, scene: dict[str, Any]) -> Array:
    """Return what the surface law stores more than the corner law, J, where the other corner just touches.

    K_s d^2 / 6 - K d^(n+1) / (n+1), from Eqs. 7-10: created when the surface law sets in, destroyed when it
    ends.
    """
    contact, slider = scene["contact"], scene["mechanism"]["slider"]
    K, n = corner_stiffness(contact), contact["exponent"]
    Ks = (slider["thickness"] + slider["length"]) / (0.475 * _compliance(contact))
    d = np.maximum(depth, 0.0)
    return np.asarray(Ks * d**2 / 6 - K * d ** (n + 1) / (n + 1))


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
