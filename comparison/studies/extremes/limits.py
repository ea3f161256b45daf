"""Four limits with a known answer, to which both models must converge at a known order.

Clearance to 0, walls of infinite stiffness, nothing lost, and a speed to 0; and the theory of one impact.
"""

import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from importlib.resources import files
from itertools import product
from math import cos, log, log1p, nan, radians, sin, tau
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from scipy.interpolate import CubicHermiteSpline
from scipy.optimize import brentq

from comparison.execution.run import Job, Outcome, Progress, run_all
from comparison.models import MODELS
from comparison.reliability.errors import slider_errors
from comparison.report import svg
from comparison.scene import Scene, load_scene
from comparison.studies.extremes.runs import BASE
from comparison.studies.paper.fitting import TOPOLOGIES, Geometry, motion, table_1
from comparison.studies.paper.laws import contacts, corner_stiffness
from comparison.studies.shared.study import curves, rate
from comparison.tables.table import Table

Case = Mapping[str, Any]
"""A model (``"model"``), the value of what goes to its limit, and what else distinguishes a run."""
Row = dict[str, Any]
_MARKS: dict[str, dict[str, Any]] = {
    "reference": {"marker": "o", "color": svg.FIRST, "ms": 5.5},
    "exudyn": {"marker": "x", "color": svg.SECOND, "ms": 4},
}

# ---- one impact


@cache
def law() -> float:
    """Return what F = K d^n (1 + C d'/v), C = 3 (1 - c_e^2) / 4, returns of the speed of an impact in `BASE`.

    Energy and momentum balance of a point mass: ln[(1 + C)/(1 - C e)] = C (1 + e), whatever m, K and n.
    """
    C = 0.75 * (1.0 - load_scene(BASE).data["contact"]["restitution"] ** 2)
    return float(brentq(lambda e: log((1.0 + C) / (1.0 - C * e)) - C * (1.0 + e), 0.01, 1.0, xtol=1e-15))


def depth(m: float, K: float, v: float, c_e: float, n: float = 1.5) -> float:
    """Return how deep (m) a mass m (kg) of speed v (m/s) dips into the wall, friction and weight left out."""
    C = 0.75 * (1.0 - c_e**2)
    share = 0.5 if C == 0.0 else (C - log1p(C)) / C**2
    return float(((n + 1.0) * m * v**2 / K * share) ** (1.0 / (n + 1.0)))


def duration(m: float, K: float, v: float) -> float:
    """Return how long (s) an elastic contact of Hertz' law lasts."""
    return float(3.2181 * (m**2 / (K**2 * v)) ** 0.2)


def effective_mass(data: Mapping[str, Any], corners: int, time: float = 0.0) -> float:
    """Return the mass (kg) that a corner feels in a frictionless impact on the left wall.

    Of a scene's data with the slider all but upright; the time of the touch, s, decides the inclination of
    rod 4. Two corners at once do not rotate the slider and share what rod 4 and slider put against the wall;
    one alone rotates the slider as well: 1/m = sin^2(theta4) L4^2/I4 + r_y^2/J5.
    """
    mechanism, drive = data["mechanism"], data["drive"]
    rod, slider = mechanism["rod4"], mechanism["slider"]
    angle = radians(mechanism["crank_angle_deg"]) + tau * drive["speed_rpm"] / 60 * time
    x, y = mechanism["rocker_pivot"]
    press = Geometry(x, y, mechanism["guide_x"] - data["clearance"]["slider"])
    tangent = motion(press, TOPOLOGIES[0], table_1()[0], np.array([angle])).tangent[0]
    inertia = rod["inertia"] + rod["mass"] * rod["centroid"] ** 2 + slider["mass"] * rod["length"] ** 2
    across = rod["length"] ** 2 / inertia / (1.0 + tangent**2)
    if corners == 2:
        return float(0.5 / across)
    tilt = abs(data["initial"]["slider_angle"])
    arm = 0.5 * (slider["length"] * cos(tilt) - slider["width"] * sin(tilt))
    return float(1.0 / (across + arm**2 / slider["inertia"]))


# ---- limits of parameters

_DATA: dict[str, dict[str, Any]] = tomllib.loads(
    files("comparison.studies.extremes").joinpath("limits.toml").read_text("utf-8")
)
_ALL = "index == index"


@dataclass(frozen=True)
class Limit:
    """A limit: its runs and what is measured of them; all else is in ``limits.toml``."""

    name: str
    cases: Sequence[Case]
    changes: Callable[[Case], dict[str, object]]  # dotted keys of a case
    measure: Callable[[Case, Table, Table], Row]  # of a case, its run and the one that it is held against
    against: Callable[[Case], Job] | None = None  # the run that a case is held against; by default its own
    derive: Callable[[pd.DataFrame], pd.DataFrame] = pd.DataFrame.copy  # adds columns to all runs

    def scene(self, case: Case) -> Scene:
        """Return the scene of a case."""
        return load_scene(BASE, _DATA[self.name]["scene"] | self.changes(case))

    @property
    def jobs(self) -> list[Job]:
        """The runs of the cases and, in their order, those that they are held against."""
        own = [Job(self.scene(case), case["model"]) for case in self.cases]
        return own + ([self.against(case) for case in self.cases] if self.against else [])

    def rows(self, outcomes: Sequence[Outcome]) -> pd.DataFrame:
        """Return a row for each case, from the outcomes of `jobs`; without a result nothing is measured."""
        rows = []
        for case, own, other in zip(self.cases, outcomes, outcomes[-len(self.cases) :], strict=False):
            row = {**case, "status": (own if own.table is None else other).status}
            if own.table is not None and other.table is not None:
                row |= self.measure(case, own.table, other.table)
            rows.append(row)
        return self.derive(pd.DataFrame(rows))

    def observed(self, frame: pd.DataFrame) -> pd.DataFrame:
        """Return the observed orders: ``case``, ``quantity``, ``expected``, and a column for each model."""
        data = _DATA[self.name]
        taken, variable = frame.query(data.get("asymptotic", _ALL)), data["variable"]
        rows = [
            {"case": key, "quantity": name, "expected": order if key in data["known"] else nan}
            | {
                model: rate(runs[variable].tolist(), runs[name].tolist())
                for model, runs in group.groupby("model")
            }
            for key, group in taken.groupby(data["by"], sort=False)
            for name, order in data["orders"].items()
        ]
        return pd.DataFrame(rows, columns=["case", "quantity", "expected", *MODELS])


# Clearance to 0
WIDE, TIGHT = "clearance > 3 depths", "clearance < depth / 3"


def _deviations(_: Case, run: Table, still: Table) -> Row:
    events, names = contacts(run), ["x", "y", "vx", "vy"]
    errors = slider_errors(run, still, float(run.time[-1]), names=[f"slider_{name}" for name in names])
    return {name: abs(errors.peak(f"slider_{name}").value) for name in names} | {
        "contacts": len(events),
        "depth": float(events["largest_depth"].max()),
        "largest force": float(events["peak_force"].max()),
    }


def _with_regime(frame: pd.DataFrame) -> pd.DataFrame:
    """Add on which side of the transition from free flight to two springs a run is."""
    ratio = frame["clearance"] / frame["depth"]
    where = pd.Series(np.select([ratio > 3, ratio < 1 / 3], [WIDE, TIGHT], "")).replace("", None)
    return frame.assign(where=where, **{"y / x": frame["y"] / frame["x"]})


_CENTRED = {"mechanism.reference_offset": 0.0, "drive.cycles": 1.0, "output.groups": []}
CLEARANCE = Limit(
    "clearance",
    [{"model": model, "clearance": 10.0**-n} for n in range(3, 10) for model in MODELS],
    lambda case: {
        "clearance.slider": case["clearance"],
        # The tolerance is one of the rod's angle; a thousandth of the angle that crosses the clearance.
        "solver.reference.tolerance": max(1e-12, min(1e-10, case["clearance"] / 240)),
    },
    _deviations,
    lambda _: Job(load_scene("ideal", _CENTRED), "reference"),
    _with_regime,
)

# Stiffness to infinity
MODULI = tuple(10.0**power for power in range(8, 16))  # Pa
TILTS = {"two": 0.0, "one": 2e-3}
"""Corners that hit at once -> the slider's angle, rad: upright, or so that one corner comes alone."""
_FLIGHTS = [f"x {k}" for k in (1, 2, 3)]


def _first_impact(case: Case, run: Table, hard: Table) -> Row:
    """Return depth, duration and restitution of the first contact, and x (m) in the middle of the flights."""
    data, first = STIFFNESS.scene(case).data, contacts(run).iloc[0]
    m = effective_mass(data, 2 if case["corners"] == "two" else 1, float(first["start"]))
    v, contact = float(first["normal_speed"]), data["contact"]
    # The middles of the first flights between contacts of the hardest walls; nan for what lacks.
    starts, ends = (contacts(hard)[name].to_numpy(np.float64) for name in ("start", "end"))
    last = np.maximum.accumulate(ends)[:-1]
    gaps = np.flatnonzero(starts[1:] > last)[: len(_FLIGHTS)]
    middles = np.full(len(_FLIGHTS), nan)
    middles[: gaps.size] = 0.5 * (last[gaps] + starts[1:][gaps])
    x = CubicHermiteSpline(run.time, run.values("slider_x"), run.values("slider_vx"))(middles)
    return {
        "depth": float(first["largest_depth"]),
        "point mass": depth(m, corner_stiffness(contact), v, contact["restitution"]),
        "duration": float(first["end"] - first["start"]),
        "restitution": float(first["impulse"]) / (m * v) - 1.0,
        **dict(zip(_FLIGHTS, map(float, x), strict=True)),
    }


def _with_errors(frame: pd.DataFrame) -> pd.DataFrame:
    """Add ratios and errors. x has no known limit: its order is that of the last two changes."""
    changes = frame.groupby(["corners", "model"], sort=False)[_FLIGHTS].diff(-1).abs()
    last = changes.where(frame["modulus"] >= MODULI[-3]).add_suffix(" in flight")
    ratio = {"in that of a point mass": frame["depth"] / frame["point mass"]}
    return frame.assign(**ratio, error=(frame["restitution"] - law()).abs()).join(last)


STIFFNESS: Limit = Limit(
    "stiffness",
    [
        {"corners": at, "modulus": young, "model": model}
        for at, young, model in product(TILTS, MODULI, MODELS)
    ],
    lambda case: {"contact.youngs_modulus": case["modulus"], "initial.slider_angle": TILTS[case["corners"]]},
    _first_impact,
    # The hardest walls, whose flights are those that x is taken in.
    lambda case: Job(STIFFNESS.scene({**case, "modulus": MODULI[-1]}), "reference"),
    _with_errors,
)

# Nothing lost
BOTH, NO_FRICTION, NO_DAMPING = "restitution 1, friction 0", "friction 0", "restitution 1"
_RESTITUTION, _FRICTION = {"contact.restitution": 1.0}, {"friction.coefficient": 0.0}
_LOSSLESS = {BOTH: _RESTITUTION | _FRICTION, NO_FRICTION: _FRICTION, NO_DAMPING: _RESTITUTION}
_SETTINGS = {
    "reference": ("solver.reference.tolerance", (1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12), 1e-10, 1.0),
    "exudyn": ("solver.exudyn.step", (1e-5, 5e-6, 2.5e-6, 1.25e-6), 5e-6, 0.25),
}
"""Of a model the key, its values (rad, s) where nothing is lost, the one where something is, and cycles."""


def _without_losses(case: Case) -> dict[str, object]:
    key, _, _, cycles = _SETTINGS[case["model"]]
    return {"drive.cycles": cycles, key: case["setting"], **_LOSSLESS[case["case"]]}


LOSSLESS = Limit(
    "lossless",
    [
        {"case": case, "model": model, "setting": setting}
        for cases in ((BOTH,), (NO_FRICTION, NO_DAMPING))
        for model, (_, values, usual, _) in _SETTINGS.items()
        for case in cases
        for setting in (values if case == BOTH else [usual])
    ],
    _without_losses,
    lambda _, run, __: {
        name: float(np.abs(run.values(f"energy_{name}")).max())
        for name in ("damping", "friction", "residual", "kinetic")
    },
)

# Speed to 0
SPEEDS = (60.0, 30.0, 15.0, 7.5, 3.75, 1.9, 1.0)  # rpm
SLOWEST_TREE = 3.75
"""rpm: an explicit method takes steps of one length however slow the press is."""
_SIDES = {"ll": 1.0, "ul": 1.0, "lr": -1.0, "ur": -1.0}


def _at_rest(_: Case) -> Job:
    """Return the run of the ideal mechanism, all but at rest, its slider on the line of the right wall."""
    values = {
        "drive.cycles": 1.0,
        "output.samples_per_cycle": 360,
        "drive.speed_rpm": 1e-6,
        "mechanism.reference_offset": load_scene(BASE).data["clearance"]["slider"],
        "output.groups": ["joints"],
    }
    return Job(load_scene("ideal", values), "reference")


def _less_static(case: Case, run: Table, static: Table) -> Row:
    """Return what differs from the press at rest in the second half of the cycle, after the first impacts.

    The largest differences (N, N m, m), and the largest kinetic energy, J; of the whole cycle the number of
    contacts, when the last began, and the mean step, s.
    """
    data, late, events = SPEED.scene(case).data, slice(len(run.time) // 2, None), contacts(run)
    held = static.values("guide_force")[late]
    walls = sum(sign * run.values(f"corner_{corner}_normal")[late] for corner, sign in _SIDES.items())
    # Upright and at rest, each corner of the side bears half.
    deep = (np.abs(held) / 2 / corner_stiffness(data["contact"])) ** (1 / data["contact"]["exponent"])
    x = run.values("slider_x")[late] - data["mechanism"]["guide_x"] - data["clearance"]["slider"]
    row = {
        "contacts": len(events),
        "last touch": float(events["start"].max()),
        "mean step": float(run.time[-1]) / run.provenance["counters"]["steps"],
        "wall force": float(np.abs(walls - held).max()),
        "depth": float(np.abs(x - deep).max()),
    }
    if case["model"] == "reference":
        torque = run.values("crank_torque") - static.values("crank_torque")
        row["torque"] = float(np.abs(torque[late]).max())
        row["kinetic energy"] = float(run.values("energy_kinetic")[late].max())
    return row


SPEED = Limit(
    "speed",
    [
        {"friction": friction, "model": model, "speed": speed}
        for friction, model, speed in product((0.0, 0.15), MODELS, SPEEDS)
        if model == "reference" or speed >= SLOWEST_TREE
    ],
    lambda case: {
        "drive.speed_rpm": case["speed"],
        "friction.coefficient": case["friction"],
        "output.groups": ["corners"] if case["model"] == "exudyn" else ["corners", "joints", "energy"],
        "solver.exudyn.step": 60.0 / case["speed"] / 500,
    },
    _less_static,
    _at_rest,
)

LIMITS = {limit.name: limit for limit in (CLEARANCE, STIFFNESS, LOSSLESS, SPEED)}
"""By the name that is, after ``limit_``, that of figure and table."""


def run_limits(n_jobs: int, on_progress: Progress | None) -> dict[str, pd.DataFrame]:
    """Run all limits in one go; a frame each, by the names of `LIMITS`."""
    jobs = {name: limit.jobs for name, limit in LIMITS.items()}
    outcomes = iter(run_all([job for some in jobs.values() for job in some], n_jobs, on_progress))
    return {name: LIMITS[name].rows([next(outcomes) for _ in some]) for name, some in jobs.items()}


def orders(frames: Mapping[str, pd.DataFrame]) -> pd.DataFrame:
    """Return the observed orders of all limits, where theory has one."""
    named = {"two": "both corners", "one": "one corner", 0.0: "no friction"}
    observed = pd.concat(
        [LIMITS[name].observed(frame).astype({"case": object}) for name, frame in frames.items()]
    )
    return observed.dropna(subset="expected").replace({"case": named})


def draw(name: str, frame: pd.DataFrame, folder: Path) -> None:
    """Write limit_NAME.svg: points beside lines of the expected orders."""
    data = _DATA[name]
    kept = dict.fromkeys([data["variable"], "model", *([data["by"]] if data["by"] != "where" else [])])
    with svg.panels(folder / f"limit_{name}.svg", 1, 2, height=3.0) as both:
        for axes, panel in zip(both, data["panels"], strict=True):
            points = frame.query(panel.get("rows", _ALL)).melt(list(kept), panel["columns"], "quantity")
            by = "quantity" if len(panel["columns"]) > 1 else data["by"]
            lines = zip(points[by].unique(), ((None, None), (4, 1.5)), strict=False)
            looks = {
                (key, model): look
                | {"dashes": dashes, "lw": 0.8, "mfc": "none", "label": data["label"].format(key, model)}
                for key, dashes in lines
                for model, look in _MARKS.items()
            }
            settings = {"xscale": "log", "yscale": "log", "xlabel": panel["x"], "ylabel": panel["y"]}
            curves(axes, points, data["variable"], "value", [by, "model"], looks, **settings)
            start, end, first, order = panel["guide"]
            ends = first, first * (end / start) ** order
            axes.plot((start, end), ends, color=svg.LIMIT, lw=3, alpha=0.5, zorder=0)
            written = str(Fraction(order).limit_denominator(10)).replace("-", "−")
            axes.set_title(f"grey: order {written}", size=9, loc="right")
            axes.margins(x=0.04)
        if name != "lossless":
            svg.legend_above(both[0], 2)
