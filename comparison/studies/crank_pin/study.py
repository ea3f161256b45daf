"""The paper's clearance at the crank pin A, beside its published peaks (Figs. 7 and 8)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from math import degrees
from pathlib import Path

import numpy as np

from comparison.execution.run import Job, Outcome, Progress, run_all, successful
from comparison.formatting import quantity
from comparison.scene import Scene, load_scene
from comparison.studies.crank_pin.figures import draw
from comparison.studies.crank_pin.peaks import PRINTED, WORDS, Case, met, peaks_table, powers, summarise
from comparison.studies.shared.errors import error, second_cycle, shift_bound
from comparison.studies.shared.study import Study
from comparison.tables.arrays import Array
from comparison.tables.table import Table

Values = dict[str, object]

BASE = "150rpm-0.2mm"
RADIUS, MODULUS = "clearance.journal_radius", "contact.youngs_modulus"
TOLERANCE = "solver.reference.tolerance"
SHOWN = (RADIUS, 10e-3)
BUILT = 20e-3
"""m; a larger journal would reach beyond the pivot of a 45 mm crank."""
SOFT = 50e9
"""Pa; between the moduli that the exponents of soft and of hard contacts are fitted to."""
NUDGE = 1e-7
"""Degrees of the crank from one member to the next: less than 1e-9 m of the ideal slider in all of them."""


@dataclass(frozen=True)
class Config:
    """What is varied and how often it runs."""

    varied: Mapping[str, Sequence[float]]
    """Key -> its values; each is run as an ensemble."""
    members: int
    """Runs in an ensemble."""
    samples: int
    """A cycle, of all runs but those of `samplings`."""
    samplings: tuple[int, ...]
    """Samples a cycle of one run each."""


@dataclass(frozen=True)
class Runs:
    """What was run."""

    config: Config
    members: dict[tuple[str, float], list[Outcome]]
    """(key, value) of what is varied -> the runs of its ensemble."""
    sampled: dict[int, Outcome]
    """Samples a cycle -> the run of the scene as it is."""
    exudyn: dict[float, Outcome]
    """Journal radius (m) -> Exudyn's run."""
    smooth: Outcome
    """The largest journal without friction."""
    still: dict[int, Table]
    """Samples a cycle -> the ideal mechanism's run."""
    bound: Array
    """What a rigid shift of the pin by its clearance moves the slider by, m."""


def scene(values: Values, samples: int = 1000, member: int = 0) -> Scene:
    """Return two cycles with clearance at A only."""
    fixed: Values = {
        "joints.slider": "ideal",
        "joints.crank_pin": "clearance",
        "mechanism.crank_angle_deg": load_scene(BASE).data["mechanism"]["crank_angle_deg"] + member * NUDGE,
        "output.groups": ["accelerations"],
        "output.samples_per_cycle": samples,
    }
    return load_scene(BASE, fixed | values)


def measure(config: Config, n_jobs: int, on_progress: Progress | None) -> Runs:
    """Run the ensembles, the ideal mechanism and Exudyn in one go.

    Raises
    ------
    RunError
        If the ideal mechanism, of which nothing can fail, does.
    """
    varied, count, samples, samplings = config.varied, config.members, config.samples, config.samplings
    which = [(key, value) for key, values in varied.items() for value in values]
    radii = varied[RADIUS]
    jobs = [Job(scene({key: value}, samples, k), "reference") for key, value in which for k in range(count)]
    jobs += [Job(scene({}, each), "reference") for each in samplings]
    jobs += [Job(scene({RADIUS: radius}, samples), "exudyn") for radius in radii]
    jobs += [Job(scene({RADIUS: radii[-1], "friction.coefficient": 0.0}, samples), "reference")]
    still: Values = {"joints.crank_pin": "ideal"}
    ideal = [Job(scene(still, each), "reference") for each in samplings]
    ideal += [Job(scene(still | values, samples), "reference") for values in _shifts()]
    outcomes = iter(run_all([*jobs, *ideal], n_jobs, on_progress))
    members = {key: list(islice(outcomes, count)) for key in which}
    sampled = dict(zip(samplings, islice(outcomes, len(samplings)), strict=True))
    exudyn = dict(zip(radii, islice(outcomes, len(radii)), strict=True))
    smooth = next(outcomes)
    tables = list(map(successful, outcomes, ideal))
    *_, longer, shorter, ahead, behind = (run.values("slider_y") for run in tables)
    clearance = float(scene({}).data["clearance"]["crank_pin"])
    bound = shift_bound((longer, shorter), (ahead, behind), clearance / 10, clearance)
    return Runs(config, members, sampled, exudyn, smooth, dict(zip(samplings, tables, strict=False)), bound)


def figures(runs: Runs, folder: Path) -> None:
    """Draw the errors of the shown run, and the peaks over the modulus."""
    still, shown = runs.still[runs.config.samples], _first(runs.members[SHOWN])
    draw(
        folder,
        still.time,
        {channel: error(shown, still, channel) for channel in WORDS},
        runs.bound,
        {E: case.peaks["slider_ay", True] for E, case in _varied(runs, MODULUS).items()},
    )


def page(runs: Runs) -> dict[str, object]:
    """Return what stands in the page."""
    config = runs.config
    still, period = runs.still[config.samples], scene({}).period
    radius, modulus, tolerance = (_varied(runs, key) for key in (RADIUS, MODULUS, TOLERANCE))
    printed_d, printed_v = PRINTED["slider_y"], PRINTED["slider_vy"]
    exudyn = {r: summarise([outcome], still, period) for r, outcome in runs.exudyn.items()}
    sampled = {n: summarise([outcome], runs.still[n], period) for n, outcome in runs.sampled.items()}
    smooth = summarise([runs.smooth], still, period)
    shown = _first(runs.members[SHOWN])
    velocity = np.interp(printed_v.time, still.time, error(shown, still, "slider_vy"))
    return {
        "members": config.members,
        "nudge": f"{NUDGE:g}",
        "radii": peaks_table({f"R_j = {r * 1e3:g} mm": case for r, case in radius.items()}),
        "radius_powers": powers({r: case for r, case in radius.items() if r <= BUILT}),
        "smooth": peaks_table({f"R_j = {max(radius) * 1e3:g} mm, no friction": smooth}),
        "bound": quantity(float(runs.bound[second_cycle(still.time, period)].max()), "m"),
        "bound_there": quantity(float(np.interp(printed_d.time, still.time, runs.bound)), "m"),
        "instant": printed_d.time,
        "velocity": quantity(printed_v.value, "m/s"),
        "velocity_instant": printed_v.time,
        "velocity_there": quantity(float(velocity), "m/s"),
        "contact": _contact_at(shown, PRINTED["slider_ay"].time),
        "exudyn": peaks_table({f"R_j = {r * 1e3:g} mm": case for r, case in exudyn.items()}),
        "tolerances": peaks_table({f"{value:.0e}": case for value, case in tolerance.items()}),
        "samplings": peaks_table({f"{n:,} samples": case for n, case in sampled.items()}),
        "moduli": peaks_table({f"{E / 1e9:g} GPa": case for E, case in modulus.items()}),
        "soft_powers": powers({E: case for E, case in modulus.items() if E < SOFT}),
        "hard_powers": powers({E: case for E, case in modulus.items() if E > SOFT}),
        "met": ", ".join(f"{WORDS[name]} at {met(modulus, name)}" for name in ("slider_y", "slider_ay")),
    }


def _contact_at(run: Table, instant: float) -> str:
    """Say whether the journal touches its bearing at an instant (s), and since when."""
    if run.events is None:
        return "not known"
    closed = run.events[(run.events["start"] <= instant) & (run.events["end"] >= instant)]
    if closed.empty:
        return "open"
    return f"closed, from {closed['start'].iloc[0]:.4f} to {closed['end'].iloc[0]:.4f} s"


def _varied(runs: Runs, key: str) -> dict[float, Case]:
    """Return the ensembles in which one key is varied, by its value."""
    still, period = runs.still[runs.config.samples], scene({}).period
    return {
        value: summarise(outcomes, still, period)
        for (varied, value), outcomes in runs.members.items()
        if varied == key
    }


def _first(outcomes: Sequence[Outcome]) -> Table:
    return next(outcome.table for outcome in outcomes if outcome.table is not None)


def _shifts() -> list[Values]:
    """Return the crank longer and shorter, ahead and behind, by a tenth of the clearance."""
    data = scene({}).data
    crank, angle = data["mechanism"]["crank"]["length"], data["mechanism"]["crank_angle_deg"]
    step = data["clearance"]["crank_pin"] / 10
    return [{"mechanism.crank.length": crank + sign * step} for sign in (1, -1)] + [
        {"mechanism.crank_angle_deg": angle + sign * degrees(step / crank)} for sign in (1, -1)
    ]


STUDY = Study(
    "crank-pin",
    small=Config(
        varied={RADIUS: (2e-3, 10e-3, 50e-3), MODULUS: (10e9, 30e9, 70e9, 210e9), TOLERANCE: (1e-9, 1e-10)},
        members=2,
        samples=100,
        samplings=(50, 100),
    ),
    full=Config(
        varied={
            RADIUS: (2e-3, 5e-3, 10e-3, 20e-3, 50e-3),
            MODULUS: (1e9, 3e9, 10e9, 30e9, 100e9, 210e9, 1000e9),
            TOLERANCE: (1e-9, 1e-10, 1e-11),
        },
        members=8,
        samples=10_000,
        samplings=(1000, 5000, 10_000, 20_000, 100_000),
    ),
    measure=measure,
    page=page,
    draw=figures,
)
