"""Restitution 1 and friction 0, each alone and both: with both, the residual is all the method's."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import nan

import numpy as np

from comparison.execution.run import Job, Outcome
from comparison.formatting import number, quantity, table
from comparison.scene import Scene, load_scene
from comparison.studies.shared.rates import rate

TOLERANCES = (1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12)
"""Of the reference."""
TURNS = {"reference": 1.0, "exudyn": 0.25}
STEPS = (1e-5, 5e-6, 2.5e-6, 1.25e-6)
"""s, of the trapezoidal rule, index 2."""
BOTH, NO_FRICTION, NO_DAMPING = "restitution 1, friction 0", "friction 0", "restitution 1"
_KEYS = {
    BOTH: {"contact.restitution": 1.0, "friction.coefficient": 0.0},
    NO_FRICTION: {"friction.coefficient": 0.0},
    NO_DAMPING: {"contact.restitution": 1.0},
}
_PLACES = [
    *((BOTH, "reference", tolerance) for tolerance in TOLERANCES),
    *((BOTH, "exudyn", step) for step in STEPS),
    *((case, "reference", 1e-10) for case in (NO_FRICTION, NO_DAMPING)),
    *((case, "exudyn", STEPS[1]) for case in (NO_FRICTION, NO_DAMPING)),
]


@dataclass(frozen=True)
class Row:
    """The largest sizes over a run: losses, residual and kinetic energy, J.

    `setting` is the reference's tolerance or Exudyn's step in s.
    """

    case: str
    model: str
    setting: float
    status: str
    damping: float
    friction: float
    residual: float
    kinetic: float


def scene(case: str, model: str, setting: float) -> Scene:
    """Return some of a turn, with energies."""
    solver = "solver.reference.tolerance" if model == "reference" else "solver.exudyn.step"
    return load_scene(
        "150rpm-0.2mm",
        {
            **_KEYS[case],
            "drive.cycles": TURNS[model],
            "output.groups": ["energy"],
            "output.samples_per_cycle": 4000,
            solver: setting,
        },
    )


def jobs() -> list[Job]:
    """Return one job a row."""
    return [Job(scene(*place), place[1]) for place in _PLACES]


def rows(outcomes: Sequence[Outcome]) -> list[Row]:
    """Return what was measured, from the outcomes of `jobs`."""
    return [_row(*place, outcome) for place, outcome in zip(_PLACES, outcomes, strict=True)]


def _row(case: str, model: str, setting: float, outcome: Outcome) -> Row:
    run = outcome.table
    if run is None:
        return Row(case, model, setting, outcome.status, nan, nan, nan, nan)
    sizes = [
        float(np.abs(run.values(f"energy_{name}")).max())
        for name in ("damping", "friction", "residual", "kinetic")
    ]
    return Row(case, model, setting, "success", *sizes)


def rates(found: Sequence[Row]) -> dict[str, float]:
    """Return each model's rate of the residual in its setting, where nothing is lost."""
    rates = {}
    for model in ("reference", "exudyn"):
        mine = [row for row in found if row.model == model and row.case == BOTH]
        rates[model] = rate([row.setting for row in mine], [row.residual for row in mine])
    return rates


def text(found: Sequence[Row]) -> str:
    """Return the table and what it says."""
    lines = [
        [
            row.case,
            row.model if row.status == "success" else f"{row.model}: {row.status}",
            f"tolerance {row.setting:.0e}"
            if row.model == "reference"
            else f"step {quantity(row.setting, 's')}",
            *(quantity(value, "J") for value in (row.damping, row.friction, row.residual, row.kinetic)),
        ]
        for row in found
    ]
    headings = ("case", "model", "setting", "damping", "friction", "residual", "kinetic energy")
    slopes = rates(found)
    ran = [row for row in found if row.status == "success"]
    damping = max(row.damping for row in ran if row.case != NO_FRICTION)
    friction = max(row.friction for row in ran if row.case != NO_DAMPING)
    return "\n\n".join(
        (
            f"Largest sizes, over {TURNS['reference']:g} turn in the reference and {TURNS['exudyn']:g} in "
            "Exudyn:",
            table(headings, lines),
            f"What cannot be lost is not: with restitution 1 damping takes {quantity(damping, 'J')} at most, "
            f"with friction 0 friction {quantity(friction, 'J')}. Where nothing is lost the residual is all "
            f"the method's: in Exudyn it falls with the step to the power {number(slopes['exudyn'])} "
            f"(theory: 2), in the reference with the tolerance to the power {number(slopes['reference'])}. "
            "There an error in proportion to the tolerance would give 1; but likely, as not isolated here, "
            "at a loose tolerance the first step after a touch, which the force's kink makes the worst, is "
            "held to a tenth of a contact whatever the tolerance.",
        )
    )
