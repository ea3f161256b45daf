"""Speed to 0: the slider comes to hang on rod 4 against one wall, and forces become the static ones."""

from __future__ import annotations

from functools import partial

import numpy as np
import pandas as pd

from comparison.execution.run import Job
from comparison.formatting import number, quantity
from comparison.models import MODELS
from comparison.scene import Scene, load_scene
from comparison.studies.extremes.limits.convergence import Case, Limit, Panel
from comparison.studies.shared.switches import contacts, corner_stiffness
from comparison.tables.table import Table

SPEEDS = (60.0, 30.0, 15.0, 7.5, 3.75, 1.9, 1.0)  # rpm
SLOWEST_TREE = 3.75
"""rpm: an explicit method takes steps of one length however slow the press is, see the template."""
FRICTIONS = (0.0, 0.15)
_STATIC = 1e-6
"""rpm of the ideal mechanism that stands for the press at rest."""
_SAMPLES = 360
_ONE_CYCLE: dict[str, object] = {"drive.cycles": 1.0, "output.samples_per_cycle": _SAMPLES}
_SIDES = {"ll": 1.0, "ul": 1.0, "lr": -1.0, "ur": -1.0}
_UNITS = {
    "wall force": "N", "torque": "N m", "depth": "m", "kinetic energy": "J", "last touch": "s",
    "mean step": "s",
}  # fmt: skip


def scene(case: Case) -> Scene:
    """Return one cycle at a speed."""
    values = _ONE_CYCLE | {
        "drive.speed_rpm": case["speed"],
        "friction.coefficient": case["friction"],
        "output.groups": ["corners"] if case["model"] == "exudyn" else ["corners", "joints", "energy"],
        # At 1 rpm the last impacts are 1e-11 m deep: what a looser tolerance leaves of them never settles.
        "solver.reference.tolerance": 1e-12,
        "solver.exudyn.formulation": "tree",
        "solver.exudyn.step": 60.0 / case["speed"] / 500,
    }
    return load_scene("150rpm-0.2mm", values)


def at_rest(_: Case) -> Job:
    """Return the run of the ideal mechanism, all but at rest, its slider on the line of the right wall."""
    values = _ONE_CYCLE | {
        "drive.speed_rpm": _STATIC,
        "mechanism.reference_offset": load_scene("150rpm-0.2mm").data["clearance"]["slider"],
        "output.groups": ["joints"],
    }
    return Job(load_scene("ideal", values), "reference")


def measure(case: Case, run: Table, static: Table) -> dict[str, float]:
    """Return what differs from the press at rest in the second half of the cycle, after the first impacts.

    The largest differences, and the largest kinetic energy; of the whole cycle the number of contacts, when
    the last began, and the mean step. Units are those of `_UNITS`.
    """
    data, late, events = scene(case).data, slice(_SAMPLES // 2, None), contacts(run)
    held = static.values("guide_force")[late]
    walls = sum(sign * run.values(f"corner_{corner}_normal")[late] for corner, sign in _SIDES.items())
    # Upright and at rest, each corner of the side bears half.
    depth = (np.abs(held) / 2 / corner_stiffness(data["contact"])) ** (1 / data["contact"]["exponent"])
    x = run.values("slider_x")[late] - data["mechanism"]["guide_x"] - data["clearance"]["slider"]
    found = {
        "contacts": len(events),
        "last touch": float(events["start"].max()),
        "mean step": float(run.time[-1]) / run.provenance["counters"]["steps"],
        "wall force": float(np.abs(walls - held).max()),
        "depth": float(np.abs(x - depth).max()),
    }
    if case["model"] == "reference":
        torque = run.values("crank_torque") - static.values("crank_torque")
        found["torque"] = float(np.abs(torque[late]).max())
        found["kinetic energy"] = float(run.values("energy_kinetic")[late].max())
    return found


def values(frame: pd.DataFrame) -> dict[str, object]:
    """Return what friction leaves at the lowest speed, and how far the models' wall forces differ with it."""
    rough = frame[frame["friction"] > 0]
    slow = rough[rough["model"] == "reference"].sort_values("speed").iloc[0]
    force = rough.pivot_table("wall force", "speed", "model").reindex(columns=list(MODELS))
    return {
        "torque": quantity(slow["torque"], "N m"),
        "force": quantity(slow["wall force"], "N"),
        "speed": f"{slow['speed']:g}",
        "apart": number((force["exudyn"] / force["reference"] - 1).abs().max(), 2),
    }


LIMIT = Limit(
    name="speed",
    variable="speed",
    cases=[
        {"friction": friction, "model": model, "speed": speed}
        for friction in FRICTIONS for model in MODELS for speed in SPEEDS
        if model == "reference" or speed >= SLOWEST_TREE
    ],
    scene=scene, held_against=at_rest, measure=measure, values=values,
    columns={
        "friction": "{:g}".format, "run": str, "speed": "{:g} rpm".format, "contacts": "{:.0f}".format,
        **{name: partial(quantity, unit=unit) for name, unit in _UNITS.items()},
    },
    orders=tuple(_UNITS), by=("friction", "model"),
    theory={(0.0, model): dict.fromkeys(list(_UNITS)[:4], 2.0) | {"last touch": 0.0} for model in MODELS},
    panels=(
        Panel(
            "speed (rpm)", "|wall force − static| (N)", ("wall force",), (1.0, 60.0, 6e-5, 2.0),
            by="friction", label="friction {0:g}, {1}",
        ),
        Panel("speed (rpm)", "|torque − static| (N m)", ("torque",), (1.0, 60.0, 4e-5, 2.0), by="friction"),
    ),
)  # fmt: skip
