"""Speed to 0: the slider comes to hang on rod 4 against one wall, and forces become the static ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import nan

import numpy as np

from comparison.execution.run import Job, Outcome
from comparison.formatting import MISSING, number, quantity, table
from comparison.scene import Scene, load_scene
from comparison.studies.shared.rates import rate
from comparison.studies.shared.switches import corner_stiffness
from comparison.tables.table import Table

SPEEDS = (60.0, 30.0, 15.0, 7.5, 3.75, 1.9, 1.0)
"""rpm."""
SLOWEST_TREE = 3.75
"""rpm: an explicit method takes steps of one length however slow the press is, see `text`."""
FRICTIONS = (0.0, 0.15)
_STATIC = 1e-6
"""rpm of the ideal mechanism that stands for the press at rest."""
_SAMPLES = 360
_SIDES = {"ll": 1.0, "ul": 1.0, "lr": -1.0, "ur": -1.0}
_PLACES = [
    (friction, model, speed)
    for friction in FRICTIONS
    for model in ("reference", "exudyn")
    for speed in SPEEDS
    if model == "reference" or speed >= SLOWEST_TREE
]


@dataclass(frozen=True)
class Row:
    """One speed; all but the first three over the second half of the turn, when the first hits are over.

    Attributes
    ----------
    contacts, last_touch, mean_step
        Over the turn: their number; when the last began, s; s.
    force, torque
        Largest difference of the walls' force (N) and of the motor's torque (N m) from the static ones.
    depth
        Largest difference of the slider's depth in the wall from the static one, m.
    kinetic
        Largest kinetic energy, J.
    """

    friction: float
    model: str
    speed: float
    status: str
    contacts: int
    last_touch: float
    mean_step: float
    force: float
    torque: float
    depth: float
    kinetic: float


def scene(friction: float, model: str, speed: float) -> Scene:
    """Return one turn at a speed."""
    groups = ["corners"] if model == "exudyn" else ["corners", "joints", "energy"]
    return load_scene(
        "150rpm-0.2mm",
        {
            "drive.speed_rpm": speed,
            "drive.cycles": 1.0,
            "friction.coefficient": friction,
            "output.groups": groups,
            "output.samples_per_cycle": _SAMPLES,
            # At 1 rpm the last hits are 1e-11 m deep: what a looser tolerance leaves of them never settles.
            "solver.reference.tolerance": 1e-12,
            "solver.exudyn.formulation": "tree",
            "solver.exudyn.step": 60.0 / speed / 500,
        },
    )


def _static_scene() -> Scene:
    """Return the ideal mechanism, all but at rest, its slider on the line of the right wall."""
    clearance = load_scene("150rpm-0.2mm").data["clearance"]["slider"]
    return load_scene(
        "ideal",
        {
            "drive.speed_rpm": _STATIC,
            "drive.cycles": 1.0,
            "mechanism.reference_offset": clearance,
            "output.groups": ["joints"],
            "output.samples_per_cycle": _SAMPLES,
        },
    )


def jobs() -> list[Job]:
    """Return the static mechanism and then one job a row."""
    return [Job(_static_scene(), "reference"), *(Job(scene(*place), place[1]) for place in _PLACES)]


def rows(outcomes: Sequence[Outcome]) -> list[Row]:
    """Return what was measured, from the outcomes of `jobs`."""
    static, *rest = outcomes
    return [_row(*place, outcome, static.table) for place, outcome in zip(_PLACES, rest, strict=True)]


def _row(friction: float, model: str, speed: float, outcome: Outcome, static: Table | None) -> Row:
    run = outcome.table
    if run is None or static is None or run.events is None:
        return Row(friction, model, speed, outcome.status, 0, *[nan] * 6)
    data = scene(friction, model, speed).data
    late = slice(_SAMPLES // 2, None)
    held = static.values("guide_force")[late]
    walls = sum(sign * run.values(f"corner_{corner}_normal")[late] for corner, sign in _SIDES.items())
    # Upright and at rest, each corner of the side bears half.
    depth = (np.abs(held) / 2 / corner_stiffness(data["contact"])) ** (1 / data["contact"]["exponent"])
    x = run.values("slider_x")[late] - data["mechanism"]["guide_x"] - data["clearance"]["slider"]
    torque = kinetic = nan
    if model == "reference":
        torque = float(np.abs(run.values("crank_torque") - static.values("crank_torque"))[late].max())
        kinetic = float(run.values("energy_kinetic")[late].max())
    return Row(
        friction,
        model,
        speed,
        "success",
        len(run.events),
        float(run.events["start"].max()),
        float(run.time[-1]) / run.provenance["counters"]["steps"],
        float(np.abs(walls - held).max()),
        torque,
        float(np.abs(x - depth).max()),
        kinetic,
    )


_MEASURED = ("force", "torque", "depth", "kinetic", "last_touch", "mean_step")


def rates(found: Sequence[Row], friction: float, model: str) -> dict[str, float]:
    """Return the rates in the speed of all that was measured."""
    mine = [row for row in found if (row.friction, row.model) == (friction, model)]
    return {
        name: rate([row.speed for row in mine], [getattr(row, name) for row in mine]) for name in _MEASURED
    }


def _disagreements(found: Sequence[Row]) -> list[float]:
    """Return how far the models' largest wall forces with friction differ, in the reference's."""
    force = {(row.model, row.speed): row.force for row in found if row.friction}
    return [
        abs(value / force["reference", speed] - 1)
        for (model, speed), value in force.items()
        if model == "exudyn"
    ]


def text(found: Sequence[Row]) -> str:
    """Return the tables and what they say."""
    units = {"force": "N", "torque": "N m", "depth": "m", "kinetic": "J", "last_touch": "s", "mean_step": "s"}
    lines = [
        [
            f"{row.friction:g}",
            row.model if row.status == "success" else f"{row.model}: {row.status}",
            f"{row.speed:g}",
            str(row.contacts) if row.status == "success" else MISSING,
            *(quantity(getattr(row, name), units[name]) for name in _MEASURED),
        ]
        for row in found
    ]
    names = ("wall force", "torque", "depth", "kinetic energy", "last touch", "mean step")
    slopes = [
        [f"{friction:g}", model, *(number(value) for value in rates(found, friction, model).values())]
        for friction in FRICTIONS
        for model in ("reference", "exudyn")
    ]
    slow = min((row for row in found if row.friction and row.model == "reference"), key=lambda row: row.speed)
    apart = max(_disagreements(found))
    return "\n\n".join(
        (
            "One turn with gravity. Wall force, torque and depth: the largest difference, over the second "
            "half of the turn, from those of the press at rest with its slider against the right wall, on "
            "which rod 4 lets it hang at every crank angle:",
            table(("friction", "model", "speed (rpm)", "contacts", *names), lines),
            "Observed rates in the speed:",
            table(("friction", "model", *names), slopes),
            "Without friction all tends to the static equilibrium as the speed squared, the rate of "
            "inertia. The hits do not vanish: the slider starts between the walls, falls to one and comes "
            "to rest on it in a time that has nothing to do with the speed, so that their number and the "
            "time of the last tend to constants; as a share of the turn they vanish with the first power. "
            "With friction force and torque do not tend to those of the frictionless press: the slider "
            f"slides, and what remains ({quantity(slow.torque, 'N m')} and {quantity(slow.force, 'N')} at "
            f"{slow.speed:g} rpm) is Coulomb's force, which does not depend on the speed until the slip "
            "falls below the transition speed of Eq. 13; only a press that slow would lose it. Nor does the "
            "work of an explicit method per turn converge: once the slider rests on the wall, its step is "
            "held by the stability of that contact to a length that does not depend on the speed.",
            f"Nor do the models agree on the largest wall force with friction, by up to {number(apart, 2)} "
            "of it: the damping of a contact refers to the speed at which it began, and the contact that "
            "lasts to the end of the run began with the last of many small hits, whose speed no tolerance "
            "makes predictable. Where the slip turns, the slider rocks on its two corners and dies down as "
            "that speed has it.",
        )
    )
