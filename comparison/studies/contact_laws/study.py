"""The three contact laws on the paper's central case, and what the literal switch of Eqs. 7-8 does there."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from comparison.execution.run import Job, Outcome, Progress, run_all
from comparison.formatting import MISSING, number, quantity, table
from comparison.scene import Scene, load_scene
from comparison.studies.contact_laws.figures import draw
from comparison.studies.shared.study import Study
from comparison.studies.shared.switches import closest, contacts, created, depths, surplus, switches
from comparison.tables.table import Table

LAWS = ("hertz-corners", "foundation", "paper-switching")
TOLERANCES = (1e-9, 1e-10, 1e-11, 1e-12)
SHOWN = 1e-10
"""Of the figures."""
LISTED = 12


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
    dense = law == "paper-switching" and tolerance is not None
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
    outcomes = run_all([*jobs, *(Job(scene(law, config), "exudyn") for law in LAWS)], n_jobs, on_progress)
    return Results(
        dict(zip(which, outcomes, strict=False)), dict(zip(LAWS, outcomes[len(which) :], strict=True))
    )


def figures(results: Results, folder: Path) -> None:
    """Draw energies and x."""
    draw(
        {law: recorded(results.reference[law, SHOWN]) for law in LAWS},
        {t: recorded(results.reference[LAWS[-1], t]) for t in TOLERANCES},
        folder,
    )


def recorded(outcome: Outcome) -> Table | None:
    """Return the table of a run; of one that stopped, what it had come to."""
    return outcome.table or outcome.partial


def _finding(best: Mapping[str, Table | None]) -> str:
    """Return the largest spurious energy under each law, of its most accurate run."""
    found = [
        f"{law} {quantity(float(run.frame['energy_residual'].abs().max()), 'J')}"
        for law, run in best.items()
        if run is not None
    ]
    return f"Largest spurious energy, by law: {', '.join(found)}."


def page(results: Results) -> dict[str, str]:
    """Return what stands in the page."""
    reference, exudyn = results.reference, results.exudyn
    best = {law: recorded(reference[law, min(TOLERANCES)]) for law in LAWS}
    rows = [
        [law, f"reference, tolerance {tolerance:.0e}", *of_run(outcome, law), follows(outcome, best[law])]
        for (law, tolerance), outcome in reference.items()
    ]
    rows += [
        [law, "exudyn", *of_run(outcome, law), follows(outcome, best[law])] for law, outcome in exudyn.items()
    ]
    literal = {tolerance: outcome for (law, tolerance), outcome in reference.items() if law == LAWS[-1]}
    statistics = [[f"{tolerance:.0e}", *of_switches(outcome)] for tolerance, outcome in literal.items()]
    stopped = [tolerance for tolerance, outcome in literal.items() if outcome.table is None]
    # Of the runs that came to the end, the most accurate whose samples separate the switches.
    separated = {t: run for t, outcome in literal.items() if (run := outcome.table) and _separated(run)}
    listed_at = min(separated, default=SHOWN)
    listed = listing(separated[listed_at]) if separated else []
    return {
        "finding": _finding(best),
        "runs": table(("law", "run", *RUN_HEADINGS, "x within 1 µm of the most accurate run until"), rows),
        "switches": table(("tolerance", *SWITCH_HEADINGS), statistics),
        "tolerance": f"{listed_at:.0e}",
        "listed": table(LIST_HEADINGS, listed[:LISTED]),
        "stopped": f"At {', '.join(f'{t:.0e}' for t in stopped)} the run had to be stopped.\n"
        if stopped
        else "",
        "more": f"\n{len(listed) - LISTED} more are not shown.\n" if len(listed) > LISTED else "",
    }


RUN_HEADINGS = (
    "status",
    "steps",
    "switches to or from two corners of a side",
    "spurious energy",
    "largest speed of x",
    "largest rate of rotation",
    "largest force",
    "deepest",
)


def of_run(outcome: Outcome, law: str) -> list[str]:
    """Return the cells of one run under a law; of one that stopped, what it had come to."""
    result = recorded(outcome)
    if result is None or result.events is None or len(result.frame) == 0:
        return [f"not simulated: {outcome.message}", *[MISSING] * (len(RUN_HEADINGS) - 1)]
    status = outcome.status
    if outcome.table is None:
        status += f" at {result.time[-1]:.4f} s; {outcome.message}"
    events, peaks = result.events, result.extrema
    return [
        status,
        f"{result.provenance['counters']['steps']:,}",
        # Of a foundation the rows are contacts of sides.
        MISSING if law == "foundation" else str(len(switches(events))),
        quantity(-result.values("energy_residual")[-1], "J"),
        quantity(_largest(peaks["slider_vx"]), "m/s"),
        quantity(_largest(peaks["slider_omega"]), "rad/s"),
        quantity(float(events["peak_force"].max()), "N"),
        quantity(float(events["largest_depth"].max()), "m"),
    ]


def follows(outcome: Outcome, best: Table | None) -> str:
    """Return until when a run's x is within 1 µm, half a hundredth of the clearance, of another one's."""
    result = recorded(outcome)
    if result is None or best is None or len(result.frame) == 0 or len(best.frame) == 0:
        return MISSING
    time = result.time[result.time <= best.time[-1]]
    x = np.interp(time, best.time, best.values("slider_x"))
    off = np.abs(result.values("slider_x")[: time.size] - x) > 1e-6
    return f"{time[np.argmax(off)]:.4f} s" if off.any() else "its end"


SWITCH_HEADINGS = (
    "switches",
    "closest two",
    "median of the energy of a switch",
    "nine in ten below",
    "largest",
    "sum of all switches",
    "total residual",
    "largest deviation from theory",
)


def of_switches(outcome: Outcome) -> list[str]:
    """Return the cells of the energies that the switches of one run created."""
    result = outcome.table
    if result is None or result.events is None:
        return [f"not measured: {outcome.status}", *[MISSING] * (len(SWITCH_HEADINGS) - 1)]
    found = switches(result.events)
    start = [str(len(found)), quantity(closest(found), "s")]
    try:
        energies = created(found, result)
    except ValueError as error:
        return [*start, f"not measured: {error}", *[MISSING] * (len(SWITCH_HEADINGS) - 3)]
    expected = _theory(found, result)
    # Of the largest, since a switch with both corners at the wall creates nothing that could be measured.
    deviation = np.abs(energies - expected).max(initial=0.0) / np.abs(expected).max(initial=1e-300)
    low, high, top = np.quantile(np.abs(energies), (0.5, 0.9, 1.0)) if len(found) else (0.0, 0.0, 0.0)
    return [
        *start,
        quantity(low, "J"),
        quantity(high, "J"),
        quantity(top, "J"),
        quantity(float(energies.sum()), "J", 6),
        quantity(-result.values("energy_residual")[-1], "J", 6),
        f"{number(deviation, 2)} of the largest",
    ]


def _separated(run: Table) -> bool:
    """Return whether no two switches of a run lie between the same two samples."""
    after = np.searchsorted(run.time, switches(contacts(run))["time"])
    return bool(np.unique(after).size == after.size)


LIST_HEADINGS = ("time", "law after it", "depth of the other corner", "energy created", "by theory")


def listing(result: Table) -> list[list[str]]:
    """Return one row a switch."""
    found = switches(contacts(result))
    columns = (
        depths(found, result, scene(LAWS[-1], STUDY.full).data),
        created(found, result),
        _theory(found, result),
    )
    return [
        [
            f"{time:.6f} s",
            "surface" if to_surface else "corner",
            quantity(depth, "m"),
            quantity(energy, "J", 4),
            quantity(expected, "J", 4),
        ]
        for time, to_surface, depth, energy, expected in zip(
            found["time"], found["to_surface"], *columns, strict=True
        )
    ]


def _theory(found: pd.DataFrame, result: Table) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    data = result.provenance["scene"]
    return np.where(found["to_surface"], 1.0, -1.0) * surplus(depths(found, result, data), data)


def _largest(peak: dict[str, float]) -> float:
    return max(abs(peak["min"]), abs(peak["max"]))


STUDY = Study(
    "contact-laws",
    small=Config(dense=1000, sparse=200),
    # 1 us apart, to separate the switches.
    full=Config(dense=400_000, sparse=4000),
    measure=measure,
    page=page,
    draw=figures,
)
