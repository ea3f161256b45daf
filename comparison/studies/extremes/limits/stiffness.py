"""Stiffness to infinity: the first impact of the scene, what it returns, and the motion after it."""

from __future__ import annotations

from functools import partial
from math import nan

import numpy as np
import pandas as pd
from scipy.interpolate import CubicHermiteSpline

from comparison.execution.run import Job
from comparison.formatting import number, quantity
from comparison.models import MODELS
from comparison.scene import Scene, load_scene
from comparison.studies.extremes.impact import depth, effective_mass, restitution
from comparison.studies.extremes.limits.convergence import Case, Limit, Panel
from comparison.studies.shared.switches import contacts, corner_stiffness
from comparison.tables.arrays import Array
from comparison.tables.table import Table

MODULI = tuple(10.0**power for power in range(8, 16))  # Pa
TILTS = {"two": 0.0, "one": 2e-3}
"""Corners that hit at once -> the slider's angle, rad: upright, or so that one corner comes alone."""
ASYMPTOTIC = 1e11
"""Pa, from which on orders are taken: softer contacts last milliseconds, in which the press moves."""
FLIGHTS = 3
_X, _CHANGES = ([f"{name} {k + 1}" for k in range(FLIGHTS)] for name in ("x", "x in flight"))


def scene(case: Case) -> Scene:
    """Return a quarter of a cycle without friction."""
    values = {
        "contact.youngs_modulus": case["modulus"],
        "friction.coefficient": 0.0,
        "initial.slider_angle": TILTS[case["corners"]],
        "drive.cycles": 0.25,
        "output.groups": [],
        "output.samples_per_cycle": 4000,
        "solver.reference.tolerance": 1e-12,
        "solver.exudyn.formulation": "tree",
        "solver.exudyn.tolerance": 1e-12,
    }
    return load_scene("150rpm-0.2mm", values)


def stiffest(case: Case) -> Job:
    """Return the reference's run with the hardest walls, whose flights are those that x is taken in."""
    return Job(scene({**case, "modulus": MODULI[-1]}), "reference")


def measure(case: Case, run: Table, hard: Table) -> dict[str, float]:
    """Return depth, duration and restitution of the first contact, and x (m) in the middle of the flights."""
    data, first = scene(case).data, contacts(run).iloc[0]
    corners = 2 if case["corners"] == "two" else 1
    m = effective_mass(data, corners, float(first["start"]))
    v, contact = float(first["normal_speed"]), data["contact"]
    x = CubicHermiteSpline(run.time, run.values("slider_x"), run.values("slider_vx"))(_flights(hard))
    return {
        "depth": float(first["largest_depth"]),
        "point mass": depth(m, corner_stiffness(contact), v, contact["restitution"]),
        "duration": float(first["end"] - first["start"]),
        "restitution": float(first["impulse"]) / (m * v) - 1.0,
        **dict(zip(_X, map(float, x), strict=True)),
    }


def _flights(run: Table) -> Array:
    """Return the middles (s) of the first flights between contacts, shape (FLIGHTS,); nan for what lacks."""
    found = np.full(FLIGHTS, nan)
    starts, ends = (contacts(run)[name].to_numpy(np.float64) for name in ("start", "end"))
    last = np.maximum.accumulate(ends)[:-1]
    gaps = np.flatnonzero(starts[1:] > last)[:FLIGHTS]
    found[: gaps.size] = 0.5 * (last[gaps] + starts[1:][gaps])
    return found


def law() -> float:
    """Return the restitution of the law with the scene's c_e."""
    return restitution(load_scene("150rpm-0.2mm").data["contact"]["restitution"])


def derive(frame: pd.DataFrame) -> pd.DataFrame:
    """Add ratios and errors. x has no known limit: its order is that of the last two changes."""
    excess = frame["restitution"] - law()
    changes = frame.groupby(["corners", "model"], sort=False)[_X].diff(-1).abs()
    last = changes.where(frame["modulus"] >= MODULI[-3]).set_axis(_CHANGES, axis=1)
    ratio = {"in that of a point mass": frame["depth"] / frame["point mass"], "less the law's": excess}
    return frame.assign(**ratio, error=excess.abs()).join(last)


def values(_: pd.DataFrame) -> dict[str, object]:
    """Return what the runs were made with, and the law's restitution."""
    tilt = quantity(TILTS["one"], "rad")
    return {"tilt": tilt, "law": f"{law():.10f}", "asymptotic": f"{ASYMPTOTIC:.0e}"}


_ORDERS = ("depth", "duration", "error", *_CHANGES)
_MODULUS = "Young's modulus (Pa)"
LIMIT = Limit(
    name="stiffness",
    variable="modulus",
    cases=[
        {"corners": corners, "modulus": young, "model": model}
        for corners in TILTS for young in MODULI for model in MODELS
    ],
    scene=scene, held_against=stiffest, measure=measure, derive=derive, values=values,
    columns={
        "corners": str, "modulus": "{:.0e} Pa".format, "run": str,
        "depth": partial(quantity, unit="m", digits=4), "in that of a point mass": partial(number, digits=5),
        "duration": partial(quantity, unit="s", digits=4), "restitution": "{:.7f}".format,
        "less the law's": partial(number, digits=2),
    },
    orders=_ORDERS, by=("corners", "model"), asymptotic=f"modulus >= {ASYMPTOTIC}",
    theory={(corners, model): dict.fromkeys(_ORDERS, -0.4) for corners in TILTS for model in MODELS},
    panels=(
        Panel(
            _MODULUS, "|restitution − the law's|", ("error",), (1e9, 1e15, 0.1, -0.4), by="corners",
            label="corners: {0}, {1}",
        ),
        Panel(_MODULUS, "depth (m)", ("depth",), (1e9, 1e15, 3e-5, -0.4), by="corners"),
    ),
)  # fmt: skip
