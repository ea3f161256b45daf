"""Clearance to 0: the slider's deviation from the ideal mechanism over one cycle."""

from __future__ import annotations

from functools import partial
from math import tau

import numpy as np
import pandas as pd

from comparison.execution.run import Job
from comparison.formatting import number, quantity
from comparison.models import MODELS
from comparison.reliability.errors import slider_errors
from comparison.scene import Scene, load_scene
from comparison.studies.extremes.impact import rod4_inclination
from comparison.studies.extremes.limits.convergence import Case, Limit, Panel
from comparison.studies.shared.switches import contacts
from comparison.tables.table import Table

_CENTRED = {"mechanism.reference_offset": 0.0, "drive.cycles": 1.0, "output.groups": []}
WIDE, TIGHT = "clearance > 3 depths", "clearance < depth / 3"
_DEVIATIONS = ("x", "y", "vx", "vy")


def scene(case: Case) -> Scene:
    """Return one cycle with a clearance."""
    clearance = case["clearance"]
    values = {
        "initial.slider_offset": 0.0,
        "clearance.slider": clearance,
        "solver.exudyn.formulation": "tree",
        # The tolerance is one of the rod's angle; a thousandth of the angle that crosses the clearance.
        "solver.reference.tolerance": max(1e-12, min(1e-10, clearance / 240)),
    }
    return load_scene("150rpm-0.2mm", _CENTRED | values)


def ideal(_: Case) -> Job:
    """Return the run of the ideal mechanism."""
    return Job(load_scene("ideal", _CENTRED), "reference")


def measure(_: Case, run: Table, still: Table) -> dict[str, float]:
    """Return the largest deviations (m, m/s), depth (m), force (N) and normal speed (m/s) of a cycle."""
    events = contacts(run)
    names = {name: f"slider_{name}" for name in _DEVIATIONS}
    errors = slider_errors(run, still, float(run.time[-1]), names=list(names.values()))
    largest = {name: abs(errors.peak(channel).value) for name, channel in names.items()}
    return largest | {
        "contacts": len(events),
        "deepest": float(events["largest_depth"].max()),
        "largest force": float(events["peak_force"].max()),
    }


def derive(frame: pd.DataFrame) -> pd.DataFrame:
    """Add on which side of the transition from free flight to two springs a run is."""
    ratio = frame["clearance"] / frame["deepest"]
    where = pd.Series(np.select([ratio > 3, ratio < 1 / 3], [WIDE, TIGHT], "")).replace("", None)
    return frame.assign(where=where, **{"y / x": frame["y"] / frame["x"]})


def values(frame: pd.DataFrame) -> dict[str, object]:
    """Return by how much x exceeds clearance plus depth, and the largest inclination of rod 4."""
    surplus = frame["x"] - frame["clearance"] - frame["deepest"]
    data = scene(LIMIT.cases[0]).data
    return {
        "least": quantity(float(surplus.min()), "m"),
        "most": quantity(float(surplus.max()), "m"),
        "rod4_inclination": number(float(rod4_inclination(data, 0.0, np.linspace(0.0, tau, 3601)).max()), 4),
    }


_METRES, _SPEED = partial(quantity, unit="m"), partial(quantity, unit="m/s")
_ORDERS = {"x": 1.0, "y": 1.0, "vx": 0.5, "vy": 0.5, "largest force": 0.6}
LIMIT = Limit(
    name="clearance",
    variable="clearance",
    cases=[{"model": model, "clearance": 10.0**-n} for n in range(3, 10) for model in MODELS],
    scene=scene, held_against=ideal, measure=measure, derive=derive, values=values,
    columns={
        "clearance": _METRES, "run": str, "x": _METRES, "y": _METRES, "y / x": partial(number, digits=4),
        "vx": _SPEED, "vy": _SPEED, "deepest": _METRES, "largest force": partial(quantity, unit="N"),
        "contacts": "{:.0f}".format,
    },
    orders=(*_ORDERS, "deepest"), by=("model", "where"),
    theory={(model, WIDE): _ORDERS for model in MODELS},
    panels=(
        Panel(
            "clearance (m)", "largest deviation (m)", ("x", "y"), (1e-5, 1e-3, 1e-5, 1.0),
            label="{0} or v{0}, {1}",
        ),
        Panel("clearance (m)", "largest deviation (m/s)", ("vx", "vy"), (1e-5, 1e-3, 8e-3, 0.5)),
    ),
)  # fmt: skip
