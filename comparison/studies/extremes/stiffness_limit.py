"""Stiffness to infinity: the first hit of the scene, what it returns, and the motion after it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import nan

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from comparison.execution.run import MODELS, Job, Outcome
from comparison.formatting import number, quantity, table
from comparison.scene import Scene, load_scene
from comparison.studies.extremes.impact import depth, effective_mass, restitution
from comparison.studies.shared.rates import rate
from comparison.studies.shared.switches import corner_stiffness
from comparison.tables.arrays import Array
from comparison.tables.table import Table

MODULI = tuple(10.0**power for power in range(8, 16))
"""Pa."""
TILTS = {2: 0.0, 1: 2e-3}
"""Corners that hit at once -> the slider's angle, rad: upright, or so that one corner comes alone."""
ASYMPTOTIC = 1e11
"""Pa, from which on rates are taken: softer contacts last milliseconds, in which the press moves."""
FLIGHTS = 3
_PLACES = [(corners, model, young) for corners in TILTS for model in MODELS for young in MODULI]


@dataclass(frozen=True)
class Row:
    """The first hit at one modulus.

    Attributes
    ----------
    deepest, exact_depth
        Of the first contact, and of a point mass without other forces, m.
    duration
        s.
    returned
        Impulse over momentum, less 1.
    x
        Of the slider (m) in the middle of the first flights of the stiffest run, shape (FLIGHTS,).
    """

    corners: int
    model: str
    modulus: float
    status: str
    deepest: float
    exact_depth: float
    duration: float
    returned: float
    x: Array


def scene(corners: int, young: float) -> Scene:
    """Return a quarter of a turn without friction."""
    return load_scene(
        "150rpm-0.2mm",
        {
            "contact.youngs_modulus": young,
            "friction.coefficient": 0.0,
            "initial.slider_angle": TILTS[corners],
            "drive.cycles": 0.25,
            "output.groups": [],
            "output.samples_per_cycle": 4000,
            "solver.reference.tolerance": 1e-12,
            "solver.exudyn.formulation": "tree",
            "solver.exudyn.tolerance": 1e-12,
        },
    )


def jobs() -> list[Job]:
    """Return one job a row."""
    return [Job(scene(corners, young), model) for corners, model, young in _PLACES]


def rows(outcomes: Sequence[Outcome]) -> list[Row]:
    """Return what was measured, from the outcomes of `jobs`."""
    runs = dict(zip(_PLACES, outcomes, strict=True))
    times = {corners: _flights(runs[corners, MODELS[0], MODULI[-1]].table) for corners in TILTS}
    return [_row(*place, outcome, times[place[0]]) for place, outcome in runs.items()]


def _flights(run: Table | None) -> Array:
    """Return the middles (s) of the first flights between contacts, shape (FLIGHTS,); nan for what lacks."""
    found = np.full(FLIGHTS, nan)
    if run is None or run.events is None:
        return found
    starts, ends = (run.events[name].to_numpy(np.float64) for name in ("start", "end"))
    last = np.maximum.accumulate(ends)[:-1]
    gaps = np.flatnonzero(starts[1:] > last)[:FLIGHTS]
    found[: gaps.size] = 0.5 * (last[gaps] + starts[1:][gaps])
    return found


def _row(corners: int, model: str, young: float, outcome: Outcome, times: Array) -> Row:
    run = outcome.table
    if run is None or run.events is None:
        return Row(corners, model, young, outcome.status, nan, nan, nan, nan, np.full(FLIGHTS, nan))
    data, first = scene(corners, young).data, run.events.iloc[0]
    m = effective_mass(data, corners, float(first["start"]))
    v, contact = float(first["normal_speed"]), data["contact"]
    x = CubicHermiteSpline(run.time, run.values("slider_x"), run.values("slider_vx"))(times)
    return Row(
        corners,
        model,
        young,
        "success",
        float(first["largest_depth"]),
        depth(m, corner_stiffness(contact), v, contact["restitution"]),
        float(first["end"] - first["start"]),
        float(first["impulse"]) / (m * v) - 1.0,
        np.asarray(x),
    )


def exact() -> float:
    """Return the restitution of the law with the scene's c_e."""
    return restitution(scene(2, MODULI[0]).data["contact"]["restitution"])


def rates(found: Sequence[Row], corners: int, model: str) -> dict[str, float]:
    """Return the rates in the modulus of depth, duration, error of the restitution, and x in each flight.

    x has no known limit: the rate is that of the last two changes from one modulus to the next.
    """
    of = [row for row in found if (row.corners, row.model) == (corners, model)]
    mine = [row for row in of if row.modulus >= ASYMPTOTIC]
    moduli = [row.modulus for row in mine]
    slopes = {
        "depth": rate(moduli, [row.deepest for row in mine]),
        "duration": rate(moduli, [row.duration for row in mine]),
        "restitution": rate(moduli, [abs(row.returned - exact()) for row in mine]),
    }
    last = mine[-3:]
    changes = np.abs(np.diff([row.x for row in last], axis=0))
    at = [row.modulus for row in last[:-1]]
    return slopes | {f"x in flight {k + 1}": rate(at, changes[:, k].tolist()) for k in range(FLIGHTS)}


def text(found: Sequence[Row]) -> str:
    """Return the tables and what they say."""
    lines = [
        [
            "two" if row.corners == 2 else "one",
            f"{row.modulus:.0e}",
            row.model if row.status == "success" else f"{row.model}: {row.status}",
            quantity(row.deepest, "m", 4),
            number(row.deepest / row.exact_depth, 5),
            quantity(row.duration, "s", 4),
            f"{row.returned:.7f}",
            number(row.returned - exact(), 2),
        ]
        for row in sorted(found, key=lambda row: (-row.corners, row.modulus))
    ]
    headings = (
        "corners", "modulus (Pa)", "model", "depth", "in that of a point mass", "duration", "restitution",
        "less the law's",
    )  # fmt: skip
    slopes = [
        [
            "two" if corners == 2 else "one",
            model,
            *(number(value) for value in rates(found, corners, model).values()),
        ]
        for corners in TILTS
        for model in MODELS
    ]
    names = list(rates(found, 2, MODELS[0]))
    return "\n\n".join(
        (
            "First hit without friction, by both corners of a side (the slider starts upright) and by one "
            f"(it starts turned by {quantity(TILTS[1], 'rad')}); the law's own restitution is "
            f"{exact():.10f}:",
            table(headings, lines),
            f"Observed rates in the modulus, from {ASYMPTOTIC:.0e} Pa:",
            table(("corners", "model", *names), slopes),
            "Theory: depth and duration go with K^−0.4. What else a hit feels (weight, drive, the turn of "
            "the slider) acts as long as it lasts, so the restitution comes to the law's at the same rate, "
            "and so does the motion after the first hits, the later ones at a larger modulus. Where walls "
            "are soft the restitution so measured means nothing: the press pushes the slider through all of "
            "the contact.",
        )
    )
