"""Restitution 1 and friction 0, each alone and both: with both, the residual is all the method's."""

from __future__ import annotations

from functools import partial

import numpy as np
import pandas as pd

from comparison.execution.run import MODELS
from comparison.formatting import quantity
from comparison.scene import Scene, load_scene
from comparison.studies.extremes.limits.convergence import Case, Limit, Panel
from comparison.tables.table import Table

TOLERANCES = (1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12)
"""Of the reference."""
STEPS = (1e-5, 5e-6, 2.5e-6, 1.25e-6)
"""s, of the trapezoidal rule, index 2."""
CYCLES = {"reference": 1.0, "exudyn": 0.25}
BOTH, NO_FRICTION, NO_DAMPING = "restitution 1, friction 0", "friction 0", "restitution 1"
_KEYS: dict[str, dict[str, object]] = {
    BOTH: {"contact.restitution": 1.0, "friction.coefficient": 0.0},
    NO_FRICTION: {"friction.coefficient": 0.0},
    NO_DAMPING: {"contact.restitution": 1.0},
}
_SETTING = {"reference": "solver.reference.tolerance", "exudyn": "solver.exudyn.step"}
_ENERGIES = ("damping", "friction", "residual", "kinetic")


def scene(case: Case) -> Scene:
    """Return part of a cycle, with energies."""
    usual = {
        "drive.cycles": CYCLES[case["model"]],
        "output.groups": ["energy"],
        "output.samples_per_cycle": 4000,
        _SETTING[case["model"]]: case["setting"],
    }
    return load_scene("150rpm-0.2mm", _KEYS[case["case"]] | usual)


def measure(_: Case, run: Table, __: Table) -> dict[str, float]:
    """Return the largest sizes over a run: losses, residual and kinetic energy, J."""
    return {name: float(np.abs(run.values(f"energy_{name}")).max()) for name in _ENERGIES}


def derive(frame: pd.DataFrame) -> pd.DataFrame:
    """Add the setting in words."""
    settings = [
        f"tolerance {value:.0e}" if model == "reference" else f"step {quantity(value, 's')}"
        for model, value in zip(frame["model"], frame["setting"], strict=True)
    ]
    return frame.assign(**{"tolerance or step": settings})


def values(frame: pd.DataFrame) -> dict[str, object]:
    """Return the largest of the losses that cannot be."""
    damping = frame.loc[frame["case"] != NO_FRICTION, "damping"].max()
    friction = frame.loc[frame["case"] != NO_DAMPING, "friction"].max()
    return {
        "reference_cycles": f"{CYCLES['reference']:g}",
        "exudyn_cycles": f"{CYCLES['exudyn']:g}",
        "damping": quantity(damping, "J"),
        "friction": quantity(friction, "J"),
    }


_SETTINGS = {"reference": (TOLERANCES, 1e-10), "exudyn": (STEPS, STEPS[1])}
"""Of each model where nothing is lost, and where something is."""
_RESIDUAL = "largest energy residual (J)", ("residual",)
LIMIT = Limit(
    name="lossless",
    variable="setting",
    cases=[
        {"case": BOTH, "model": model, "setting": setting}
        for model in MODELS
        for setting in _SETTINGS[model][0]
    ]
    + [
        {"case": case, "model": model, "setting": _SETTINGS[model][1]}
        for model in MODELS
        for case in (NO_FRICTION, NO_DAMPING)
    ],
    scene=scene,
    measure=measure,
    derive=derive,
    values=values,
    columns={
        **dict.fromkeys(("case", "run", "tolerance or step"), str),
        **dict.fromkeys(_ENERGIES, partial(quantity, unit="J")),
    },
    orders=("residual",),
    by=("model",),
    asymptotic=f"case == {BOTH!r}",
    theory={("reference",): {"residual": 1.0}, ("exudyn",): {"residual": 2.0}},
    panels=(
        Panel(
            "tolerance of the reference (rad)", *_RESIDUAL, (1e-12, 1e-8, 1e-11, 1.0),
            rows=f"model == 'reference' and case == {BOTH!r}",
        ),
        Panel(
            "step of Exudyn (s)", *_RESIDUAL, (1e-6, 1e-5, 4e-9, 2.0),
            rows=f"model == 'exudyn' and case == {BOTH!r}",
        ),
    ),
)  # fmt: skip
