"""Clearance to 0: the slider's deviation from the ideal mechanism over one turn, in both models."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import nan, tau

import numpy as np

from comparison.execution.run import MODELS, Job, Outcome
from comparison.formatting import MISSING, number, quantity, table
from comparison.scene import Scene, load_scene
from comparison.studies.extremes.impact import lean
from comparison.studies.shared.errors import error
from comparison.studies.shared.rates import rate
from comparison.tables.table import Table

CLEARANCES = tuple(10.0**-power for power in range(3, 10))
"""m."""
_SMALLEST_TOLERANCE = 1e-12


@dataclass(frozen=True)
class Row:
    """One clearance in one model; the largest of each over the turn.

    Attributes
    ----------
    x, y, vx, vy
        Deviations from the ideal slider, m and m/s.
    depth, force, speed
        Into the wall (m), at a corner (N), of a touch across the guide (m/s).
    """

    model: str
    clearance: float
    status: str
    contacts: int
    x: float
    y: float
    vx: float
    vy: float
    depth: float
    force: float
    speed: float


def _scene(name: str, clearance: float) -> Scene:
    return load_scene(
        name,
        {
            "mechanism.reference_offset": 0.0,
            "initial.slider_offset": 0.0,
            "clearance.slider": clearance,
            "drive.cycles": 1.0,
            "output.groups": [],
            "solver.exudyn.formulation": "tree",
            # The tolerance is one of the rod's angle; a thousandth of the angle that crosses the clearance.
            "solver.reference.tolerance": max(_SMALLEST_TOLERANCE, min(1e-10, clearance / 240)),
        },
    )


def jobs() -> list[Job]:
    """Return the ideal mechanism and then each clearance by each model."""
    ideal = load_scene("ideal", {"mechanism.reference_offset": 0.0, "drive.cycles": 1.0, "output.groups": []})
    found = [Job(ideal, "reference")]
    return found + [Job(_scene("150rpm-0.2mm", c), model) for model in MODELS for c in CLEARANCES]


def rows(outcomes: Sequence[Outcome]) -> list[Row]:
    """Return what was measured, from the outcomes of `jobs`."""
    ideal, *rest = outcomes
    keys = [(model, c) for model in MODELS for c in CLEARANCES]
    return [_row(*key, outcome, ideal.table) for key, outcome in zip(keys, rest, strict=True)]


def _row(model: str, clearance: float, outcome: Outcome, ideal: Table | None) -> Row:
    run = outcome.table
    if run is None or ideal is None or run.events is None:
        return Row(model, clearance, outcome.status, 0, *[nan] * 7)
    largest = [float(np.abs(error(run, ideal, f"slider_{name}")).max()) for name in ("x", "y", "vx", "vy")]
    events = run.events
    peaks = [float(events[name].max()) for name in ("largest_depth", "peak_force", "normal_speed")]
    return Row(model, clearance, "success", len(events), *largest, *peaks)


def rates(found: Sequence[Row], model: str) -> dict[str, tuple[float, float]]:
    """Return the rates in the clearance of each quantity: where it is larger than the depth, and below."""
    mine = [row for row in found if row.model == model and row.status == "success"]
    wide = [row for row in mine if row.clearance > 3 * row.depth]
    tight = [row for row in mine if row.clearance < row.depth / 3]
    return {
        name: (
            rate([row.clearance for row in wide], [getattr(row, name) for row in wide]),
            rate([row.clearance for row in tight], [getattr(row, name) for row in tight]),
        )
        for name in ("x", "y", "vx", "vy", "force", "depth")
    }


def text(found: Sequence[Row]) -> str:
    """Return the tables and what they say."""
    headings = ("clearance", "model", "x", "y", "y / x", "vx", "vy", "deepest", "largest force", "contacts")
    lines = [
        [
            quantity(row.clearance, "m"),
            row.model if row.status == "success" else f"{row.model}: {row.status}",
            quantity(row.x, "m"),
            quantity(row.y, "m"),
            number(row.y / row.x, 4),
            quantity(row.vx, "m/s"),
            quantity(row.vy, "m/s"),
            quantity(row.depth, "m"),
            quantity(row.force, "N"),
            str(row.contacts) if row.status == "success" else MISSING,
        ]
        for row in sorted(found, key=lambda row: -row.clearance)
    ]
    slopes = [
        [model, part, *(number(pair[k]) for pair in rates(found, model).values())]
        for model in MODELS
        for k, part in enumerate(("clearance > 3 depths", "clearance < depth / 3"))
    ]
    surplus = [row.x - row.clearance - row.depth for row in found if row.status == "success"]
    tangent = lean(_scene("150rpm-0.2mm", CLEARANCES[0]).data, 0.0, np.linspace(0.0, tau, 3601)).max()
    return "\n\n".join(
        (
            "Largest deviation from the ideal slider over one turn, the guide centred on its line.",
            table(headings, lines),
            "Observed rate in the clearance:",
            table(("model", "where", "x", "y", "vx", "vy", "force", "depth"), slopes),
            "Theory: a corner lies within its wall or as deep in it as it dips, so |x| is at most clearance "
            "plus depth but for the slider's turn; measured, x less that sum is "
            f"{quantity(min(surplus), 'm')} to {quantity(max(surplus), 'm')}. x and y are of first order in "
            "the clearance while it is larger than the depth. Below, they end at the depth in walls of the "
            "given stiffness, which is no part of this limit: without clearance and with rigid walls the "
            f"mechanism is the ideal one. y follows x by the tangent of rod 4's lean, {number(tangent, 4)} "
            "at most.",
            "Velocities converge more slowly. A slider that the drive presses against one wall and then the "
            "other crosses a clearance c with an acceleration a that does not depend on c, and arrives with "
            "(2 a · 2c)^(1/2): theory says 1/2. The largest force of a hit follows its speed to the power "
            "1.2, so 0.6, down to the force that holds the ideal slider on its line, below which it cannot "
            "fall. With less clearance than depth the slider is a spring between two springs; what it does "
            "then is the matter of their stiffness, and no rate in the clearance is expected.",
        )
    )
