"""The paper's clearance at the crank pin A, beside its published peaks (Figs. 7 and 8)."""

from __future__ import annotations

import numpy as np

from comparison.formatting import quantity
from comparison.studies.crank_pin.figures import draw
from comparison.studies.crank_pin.peaks import PRINTED, WORDS, met, peaks_table, powers, summarise
from comparison.studies.crank_pin.runs import MODULUS, NUDGE, RADIUS, TOLERANCE, Config, Runs, measure, scene
from comparison.studies.shared.errors import error, second_cycle
from comparison.studies.shared.study import Study
from comparison.tables.table import Table

BUILT = 20e-3
"""m; a larger journal would reach beyond the pivot of a 45 mm crank."""
SOFT = 50e9
"""Pa; between the moduli that the exponents of soft and of hard contacts are fitted to."""


def page(runs: Runs) -> dict[str, object]:
    """Return what stands in the page."""
    config = runs.config
    still, period = runs.still[config.samples], scene({}).period
    radius, modulus, tolerance = (runs.by_value(key) for key in (RADIUS, MODULUS, TOLERANCE))
    printed_d, printed_v = PRINTED["slider_y"], PRINTED["slider_vy"]
    exudyn = {r: summarise([outcome], still, period) for r, outcome in runs.exudyn.items()}
    sampled = {n: summarise([outcome], runs.still[n], period) for n, outcome in runs.sampled.items()}
    smooth = summarise([runs.smooth], still, period)
    velocity = np.interp(printed_v.time, still.time, error(runs.shown, still, "slider_vy"))
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
        "contact": _contact_at(runs.shown, PRINTED["slider_ay"].time),
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
    draw=draw,
)
