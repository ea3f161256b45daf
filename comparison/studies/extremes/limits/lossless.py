"""Restitution 1 and friction 0, each alone and both: with both, the residual is all the method's."""

from __future__ import annotations

from functools import partial

import numpy as np
import pandas as pd

from comparison.formatting import quantity
from comparison.models import MODELS
from comparison.scene import Scene, load_scene
from comparison.studies.extremes.limits.convergence import Case, Limit, Panel
from comparison.tables.table import Table

CYCLES = {"reference": 1.0, "exudyn": 0.25}
BOTH, NO_FRICTION, NO_DAMPING = "restitution 1, friction 0", "friction 0", "restitution 1"
_KEYS: dict[str, dict[str, object]] = {
    BOTH: {"contact.restitution": 1.0, "friction.coefficient": 0.0},
    NO_FRICTION: {"friction.coefficient": 0.0},
    NO_DAMPING: {"contact.restitution": 1.0},
}
_SETTINGS = {
    "reference": ("solver.reference.tolerance", (1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12), 1e-10),
    "exudyn": ("solver.exudyn.step", (1e-5, 5e-6, 2.5e-6, 1.25e-6), 5e-6),
}
"""Of each model the key, its values (rad, s) where nothing is lost, and the one where something is."""
_ENERGIES = ("damping", "friction", "residual", "kinetic")


def scene(case: Case) -> Scene:
    """Return part of a cycle, with energies."""
    usual = {
        "drive.cycles": CYCLES[case["model"]],
        "output.groups": ["energy"],
        "output.samples_per_cycle": 4000,
        _SETTINGS[case["model"]][0]: case["setting"],
    }
    return load_scene("150rpm-0.2mm", _KEYS[case["case"]] | usual)


def measure(_: Case, run: Table, __: Table) -> dict[str, float]:
    """Return the largest sizes over a run: losses, residual and kinetic energy, J."""
    return {name: float(np.abs(run.values(f"energy_{name}")).max()) for name in _ENERGIES}


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


def _case(case: str, model: str, setting: float) -> Case:
    written = f"tolerance {setting:.0e}" if model == "reference" else f"step {quantity(setting, 's')}"
    return {"case": case, "model": model, "setting": setting, "tolerance or step": written}


def _panel(x: str, model: str, guide: tuple[float, float, float, float]) -> Panel:
    rows = f"model == {model!r} and case == {BOTH!r}"
    return Panel(x, "largest energy residual (J)", ("residual",), guide, rows=rows)


_LOST = [(model, case) for model in MODELS for case in (NO_FRICTION, NO_DAMPING)]
LIMIT = Limit(
    name="lossless",
    variable="setting",
    cases=[_case(BOTH, model, each) for model in MODELS for each in _SETTINGS[model][1]]
    + [_case(case, model, _SETTINGS[model][2]) for model, case in _LOST],
    scene=scene, measure=measure, values=values,
    columns={
        **dict.fromkeys(("case", "run", "tolerance or step"), str),
        **dict.fromkeys(_ENERGIES, partial(quantity, unit="J")),
    },
    orders=("residual",), by=("model",), asymptotic=f"case == {BOTH!r}",
    theory={("reference",): {"residual": 1.0}, ("exudyn",): {"residual": 2.0}},
    panels=(
        _panel("tolerance of the reference (rad)", "reference", (1e-12, 1e-8, 1e-11, 1.0)),
        _panel("step of Exudyn (s)", "exudyn", (1e-6, 1e-5, 4e-9, 2.0)),
    ),
)  # fmt: skip
