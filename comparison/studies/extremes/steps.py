"""Limits of the solvers' steps: Baumgarte's gains under an explicit method, and contacts at fixed steps.

Theory beside runs: what an explicit method allows, what fixed steps make of one mass that hits a wall, and
where Exudyn's five bodies, which have no error control in contacts, cannot follow one.
"""

import tomllib
from collections.abc import Mapping, Sequence
from importlib.resources import files
from itertools import pairwise, product
from math import pi, sqrt
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.polynomial import Polynomial
from scipy.integrate import DOP853

from comparison.execution.run import Job, Progress, energy_share, run_all
from comparison.report import svg
from comparison.scene import Scene, load_scene
from comparison.studies.extremes.limits import duration, effective_mass
from comparison.studies.extremes.runs import BASE
from comparison.studies.paper.laws import contacts, corner_stiffness
from comparison.studies.shared.study import curves, part
from comparison.tables.channels import Array
from comparison.tables.table import Table

Config = Mapping[str, Sequence[float]]
"""Values of settings, as ``full`` of ``steps.toml``."""
_DATA: dict[str, dict[str, Any]] = tomllib.loads(
    files("comparison.studies.extremes").joinpath("steps.toml").read_text("utf-8")
)
FULL: Config = _DATA["full"]

# ---- steps of the explicit method DOP853


def stable_to(direction: complex = -1.0) -> float:
    """Return |l h| up to which |R| <= 1 along the ray of a root l of any size; 0 where it grows at once.

    R(z) = 1 + sum of b A^k 1 z^(k+1), k = 0..11, is what one step with l h = z multiplies y by.
    """
    powers, terms = np.ones(len(DOP853.B)), [1.0]
    for _ in DOP853.B:
        terms.append(float(DOP853.B @ powers))
        powers = DOP853.A @ powers
    # Above 12 |R| > 1 in every direction; far less than the twelve stages could reach at best.
    size = np.linspace(0.0, 12.0, 120_001)
    R = Polynomial(terms)(size * direction / abs(direction))
    return float(size[np.flatnonzero(np.abs(R) > 1.0 + 1e-12)[0] - 1])


GAIN_SCENES = {"ideal slider": "ideal", "slider with contact": BASE}
DEFAULT_GAIN = 10.0
"""1/s: of a scene, and what is shown beside no gain over many cycles."""


def gain_scene(name: str, alpha: float, beta: float, tolerance: float, cycles: float) -> Scene:
    """Return a scene of `GAIN_SCENES` for the multiplier form with Baumgarte's gains, 1/s."""
    values = {"drive.cycles": cycles, "solver.reference.tolerance": tolerance}
    gains = {"solver.reference.baumgarte_alpha": alpha, "solver.reference.baumgarte_beta": beta}
    return load_scene(GAIN_SCENES[name], _DATA["gains"] | values | gains)


def run_gains(config: Config, n_jobs: int, on_progress: Progress | None) -> pd.DataFrame:
    """Run alpha = beta at all tolerances, all pairs at the loosest, and many cycles with little of both.

    A row a run, with its settings, ``status``, ``steps`` that were accepted and their ``mean_step``, s, steps
    that were ``rejected`` by the error control, and the largest |Phi| as ``position`` (m, rad) and |Phi'| as
    ``velocity`` (m/s, rad/s).
    """
    gains, tolerances, long = (config[name] for name in ("gains", "tolerances", "cycles"))
    wanted = [(gain, gain, tolerance, 1.0) for gain, tolerance in product(gains, tolerances)]
    wanted += [(alpha, beta, tolerances[0], 1.0) for alpha, beta in product(gains, gains)]
    wanted += [(gain, gain, tolerances[0], count) for gain, count in product((0.0, DEFAULT_GAIN), long)]
    settings = [(name, *each) for name, each in product(GAIN_SCENES, dict.fromkeys(wanted))]
    scenes = [gain_scene(*each) for each in settings]
    outcomes = run_all([Job(each, "reference") for each in scenes], n_jobs, on_progress)
    rows = []
    for scene, outcome in zip(scenes, outcomes, strict=True):
        run, row = outcome.table or outcome.partial, {"status": outcome.status, "steps": 0, "rejected": 0}
        if run is not None and len(run.frame):
            counted, drift = run.provenance["counters"], run.provenance["constraints"]
            reached = scene.duration if outcome.table is not None else float(run.time[-1])
            row |= {name: counted[name] for name in ("steps", "rejected")}
            row |= {"mean_step": reached / max(1, counted["steps"]), **drift}
        rows.append(row)
    asked = pd.DataFrame(settings, columns=["scene", "alpha", "beta", "tolerance", "cycles"])
    names = ["status", "steps", "rejected", "mean_step", "position", "velocity"]
    measured = pd.DataFrame(rows, columns=names)
    return asked.join(measured).sort_values(["cycles", "alpha", "beta"], kind="stable", ignore_index=True)


# ---- fixed steps: a linear spring, and one mass that hits a wall with such a spring

SPECTRAL_RADIUS = 0.9
"""At infinite frequency, as the Exudyn model runs generalized-alpha."""
_SETTLED = 60
"""Steps in flight after which the algorithmic acceleration has died away: 0.73^60 = 6e-9."""
_PHASES = np.linspace(0.005, 1.0, 200)


class Fixed(NamedTuple):
    """Generalized-alpha in the form for constrained systems.

    M. Arnold, O. Bruels, Multibody Syst. Dyn. 18, 2007: forces are met at the end of each step, and the
    algorithmic acceleration a follows the true one, q'',

        (1 - alpha_m) a1 + alpha_m a0 = (1 - alpha_f) q1'' + alpha_f q0'',
        q1 = q0 + h v0 + h^2 ((1/2 - beta) a0 + beta a1),    v1 = v0 + h ((1 - gamma) a0 + gamma a1).

    The trapezoidal rule is the case alpha_m = alpha_f = 0, beta = 1/4, gamma = 1/2.
    """

    alpha_m: float
    alpha_f: float
    beta: float
    gamma: float


def generalized_alpha(radius: float) -> Fixed:
    """Return the method of a spectral radius at infinite frequency (J. Chung, G. Hulbert, 1993)."""
    alpha_m, alpha_f = (2 * radius - 1) / (radius + 1), radius / (radius + 1)
    shift = alpha_f - alpha_m
    return Fixed(alpha_m, alpha_f, 0.25 * (1 + shift) ** 2, 0.5 + shift)


FIXED = {
    "generalized-alpha": generalized_alpha(SPECTRAL_RADIUS),
    "trapezoidal-index2": Fixed(0.0, 0.0, 0.25, 0.5),
}


def rebounds(method: Fixed, wh: float, phases: Array = _PHASES) -> Array:
    """Return the speeds at which a mass flies off a unilateral linear spring, in units of that before.

    Of all contacts that follow on one another, since a mass may touch again while its algorithmic
    acceleration dies away. ``wh``: step times the frequency sqrt(K/m); the exact contact lasts pi / wh steps
    and returns 1. ``phases``: how much of a step before the touch the last state in flight is, in (0, 1].
    """
    m = method
    # In steps and speeds before the touch: h = 1 and v = 1. The wall is at q = 0, the mass comes from below.
    q, v = -np.asarray(phases, dtype=np.float64), np.ones(len(phases))
    a, true = np.zeros_like(q), np.zeros_like(q)
    stiffness, share = wh * wh, m.beta * (1 - m.alpha_f) / (1 - m.alpha_m)
    for _ in range(int(4 * pi / wh) + _SETTLED):
        carried = (m.alpha_f * true - m.alpha_m * a) / (1 - m.alpha_m)
        free = q + v + (0.5 - m.beta) * a + m.beta * carried
        # Implicit, and linear on either side of the touch: a position inside the wall is drawn towards it.
        end = np.where(free > 0, free / (1 + share * stiffness), free)
        true = -stiffness * np.maximum(end, 0.0)
        following = carried + (1 - m.alpha_f) / (1 - m.alpha_m) * true
        v = v + (1 - m.gamma) * a + m.gamma * following
        q, a = end, following
    return np.asarray(-v)


# ---- fixed steps: contacts of Exudyn's five bodies

LEAST = 0.01
"""w h below which an impact takes more than 300 steps and is as exact as it can be."""
_APPROACH, _LEAVE = 3, 40
"""Steps in flight before and after the impact; in the latter the algorithmic acceleration dies away."""


def run_impacts(config: Config, n_jobs: int, on_progress: Progress | None) -> pd.DataFrame:
    """Let the slider hit its left wall, upright, with the press at rest and a linear law that loses nothing.

    A row for each method, step (s), modulus (Pa) and phase that takes so few steps that it can err: ``wh``,
    the step times w = sqrt(2 K / m), as both corners hit at once; ``rebound``, what the slider leaves with,
    and ``theory``, what one mass would, in speeds before the impact; of the table of contacts ``impulse``:
    over momentum, less 1, which should be the rebound, and ``touch``: the speed of the touch, which should
    be 1.
    """
    base, cycle = load_scene(BASE), 60.0 / _DATA["impact"]["drive.speed_rpm"]
    rows: list[dict[str, Any]] = []
    scenes, steps = [], config["impact_steps"]
    for method, step, young, phase in product(FIXED, steps, config["moduli"], config["phases"]):
        data = base.with_values({"contact.youngs_modulus": young}).data
        mass = effective_mass(data, 2)
        wh = step * sqrt(corner_stiffness(data["contact"]) / mass)
        if wh < LEAST:
            continue
        # A micrometre a step at most, so that it does not come to the other wall.
        speed = min(0.05, 1e-6 / step)
        values = {
            "contact.youngs_modulus": young,
            "drive.cycles": (_APPROACH + int(1.3 * pi / wh) + _LEAVE) * step / cycle,
            "initial.slider_vx": -speed,
            "initial.slider_offset": (_APPROACH + phase) * step * speed - data["clearance"]["slider"],
            "output.samples_per_cycle": round(cycle / step),
            "solver.exudyn.method": method,
            # A sample a step, although their quotient rounds.
            "solver.exudyn.step": step * (1 + 1e-6),
        }
        scenes.append((base.with_values(_DATA["impact"] | values), speed, mass * speed))
        theory = float(rebounds(FIXED[method], wh, np.array([phase]))[0])
        rows.append({"method": method, "step": step, "modulus": young, "phase": phase, "wh": wh})
        rows[-1] |= {"status": "", "theory": theory}
    outcomes = run_all([Job(scene, "exudyn") for scene, *_ in scenes], n_jobs, on_progress)
    for row, (_, speed, momentum), outcome in zip(rows, scenes, outcomes, strict=True):
        row["status"] = outcome.status
        if (run := outcome.table) is not None:
            first = contacts(run).iloc[0]
            row["rebound"] = run.values("slider_vx")[-1] / speed
            row["impulse"] = first["impulse"] / momentum - 1
            row["touch"] = first["normal_speed"] / speed
    return pd.DataFrame(rows)


def run_map(config: Config, n_jobs: int, on_progress: Progress | None) -> pd.DataFrame:
    """Run a quarter of a cycle of the central case; a row for each method, step (s) and modulus (Pa).

    ``count``: steps per contact, in an elastic impact of one corner at the speed of the scene's first touch.
    Of a run that finished ``wrong``: where the method gives energies, the spurious energy in what was lost,
    else by how much the deepest penetration of a wall differs from the reference's; ``speed``: largest |vx|
    in that of the reference.
    """
    points = list(product(FIXED, config["map_steps"], config["moduli"]))
    base = load_scene(BASE, {**_DATA["map"], "output.groups": []})
    scenes = []
    for method, step, young in points:
        values = {"contact.youngs_modulus": young, "solver.exudyn.method": method, "solver.exudyn.step": step}
        groups = {"output.groups": ["energy"]} if method == "trapezoidal-index2" else {}
        scenes.append(base.with_values(values | groups))
    jobs = [Job(scene, "exudyn") for scene in scenes]
    jobs += [
        Job(base.with_values({"contact.youngs_modulus": each}), "reference") for each in config["moduli"]
    ]
    outcomes = run_all(jobs, n_jobs, on_progress)
    exact = dict(zip(config["moduli"], outcomes[len(points) :], strict=True))
    rows = []
    for (method, step, young), scene, outcome in zip(points, scenes, outcomes, strict=False):
        data, right, run = scene.data, exact[young].table, outcome.table
        row: dict[str, Any] = {"method": method, "step": step, "modulus": young, "status": outcome.status}
        if right is not None:
            touch = float(contacts(right)["normal_speed"].iloc[0])
            row["count"] = duration(effective_mass(data, 1), corner_stiffness(data["contact"]), touch) / step
            if run is not None:
                row["wrong"] = energy_share(run)
                if np.isnan(row["wrong"]):
                    middle, clearance = data["mechanism"]["guide_x"], data["clearance"]["slider"]
                    deep, known = (_largest(each, "slider_x", middle) - clearance for each in (run, right))
                    row["wrong"] = abs(deep / known - 1)
                row["speed"] = _largest(run, "slider_vx") / _largest(right, "slider_vx")
        rows.append(row)
    return pd.DataFrame(rows)


def _largest(run: Table, channel: str, middle: float = 0.0) -> float:
    """Return the largest distance of a channel from a value, over all steps."""
    ends = run.extrema[channel]
    return max(abs(ends["min"] - middle), abs(ends["max"] - middle))


def run_steps(config: Config, n_jobs: int, on_progress: Progress | None) -> dict[str, pd.DataFrame]:
    """Run Baumgarte's ``gains``, single ``impacts`` and the map of step and modulus, ``points``."""
    shares = (part(on_progress, *ends) for ends in pairwise((0.0, 0.6, 0.9, 1.0)))
    runs = {"gains": run_gains, "impacts": run_impacts, "points": run_map}
    return {name: run(config, n_jobs, share) for (name, run), share in zip(runs.items(), shares, strict=True)}


# ---- figures

SMALL, WRONG = 0.01, 0.1
"""Errors of a point of the map; above the second one it counts as wrong."""
_DASHES = ((None, None), (4, 1.5), (1, 1.5))
_MARKS = ("o", "s", "^", "D", "v")
_LOOKS = {
    f"error up to {SMALL:.0%}": {"marker": "o", "color": svg.LIMIT, "ms": 3, "ls": ""},
    f"up to {WRONG:.0%}": {"marker": "s", "color": svg.THRESHOLD, "ms": 4, "ls": ""},
    "larger": {"marker": "D", "color": svg.OUTSIDE, "ms": 5, "ls": ""},
    "stopped": {"marker": "x", "color": svg.DIFFERENCE, "ms": 5, "ls": ""},
}
_LOGARITHMIC = {"xscale": "log", "yscale": "log"}


def draw(runs: Mapping[str, pd.DataFrame], folder: Path) -> None:
    """Write the mean step over the gain, the rebound of one impact, and the map of step and modulus."""
    _draw_gains(runs["gains"], folder / "baumgarte_steps.svg")
    _draw_rebound(runs["impacts"], folder / "rebound.svg")
    _draw_map(runs["points"], folder / "step_and_modulus.svg")


def _draw_gains(gains: pd.DataFrame, path: Path) -> None:
    S, equal = stable_to(), gains.query("cycles == 1 and alpha == beta and alpha > 0")
    looks = {
        (name, tolerance): {"marker": mark, "color": svg.FIRST, "dashes": dashes, "mfc": "none", "ms": 4}
        | {"label": f"{name}, tolerance {tolerance:.0e}"}
        for name, mark in zip(GAIN_SCENES, _MARKS, strict=False)
        for tolerance, dashes in zip(equal["tolerance"].unique(), _DASHES, strict=False)
    }
    with svg.panels(path, height=3.6) as (axes,):
        settings = {**_LOGARITHMIC, "xlabel": "gain alpha = beta (1/s)"}
        curves(axes, equal, "alpha", "mean_step", ["scene", "tolerance"], looks, **settings)
        line = np.array([S / 0.02, equal["alpha"].max()])
        axes.plot(line, S / line, color=svg.LIMIT, lw=2.5, alpha=0.6, zorder=0, label="theory: S / alpha")
        axes.set_ylabel("mean step (s)")
        svg.legend_above(axes, 2)


def _draw_map(points: pd.DataFrame, path: Path) -> None:
    conditions = [points["status"] != "success", points["wrong"] <= SMALL, points["wrong"] <= WRONG]
    small, wide, larger, stopped = _LOOKS
    shown = points.assign(look=np.select(conditions, [stopped, small, wide], larger))
    with svg.panels(path, 1, 2, height=3.6, sharex=True, sharey=True) as both:
        for axes, name in zip(both, FIXED, strict=True):
            mine = shown[shown["method"] == name]
            curves(axes, mine, "step", "modulus", "look", _LOOKS, **_LOGARITHMIC, xlabel="step (s)")
            once = mine.drop_duplicates("modulus")
            for count, dashes in zip((10.0, 3.0, 1.0), _DASHES, strict=True):
                at, label = once["count"] * once["step"] / count, f"{count:g} steps per contact"
                axes.plot(at, once["modulus"], color=svg.INK, lw=0.9, dashes=dashes, label=label)
            axes.set_title(name, size=9)
        x, y = ((ends.min() / 1.7, ends.max() * 1.7) for ends in (points["step"], points["modulus"]))
        both[0].set(ylabel="Young's modulus (Pa)", xlim=x, ylim=y)
        svg.legend_above(both[0], 3)


def _draw_rebound(impacts: pd.DataFrame, path: Path) -> None:
    """Draw one impact of one mass and of five bodies, over w h."""
    wh = np.geomspace(1e-2, 2e3, 300)
    looks = {
        step: {"marker": mark, "ls": "", "color": svg.SECOND, "mfc": "none", "ms": 4, "mew": 0.7}
        | {"label": f"five bodies, {step:.0e} s"}
        for step, mark in zip(sorted(impacts["step"].unique()), _MARKS, strict=False)
    }
    with svg.panels(path, 2, 1, height=4.9, sharex=True) as both:
        for axes, (name, method) in zip(both, FIXED.items(), strict=True):
            mine = impacts[impacts["method"] == name]
            mass = np.array([rebounds(method, each) for each in wh])
            ends = mass.min(axis=1), mass.max(axis=1)
            axes.fill_between(wh, *ends, color=svg.THRESHOLD, alpha=0.35, lw=0, label="one mass, all phases")
            axes.plot(wh, mass.mean(axis=1), color=svg.INK, label="one mass, mean")
            curves(axes, mine, "wh", "rebound", "step", looks, ylabel="rebound / impact speed (1)")
            failed = mine.loc[mine["status"] != "success", "wh"]
            axes.plot(failed, np.full(len(failed), 0.1), "x", color=svg.DIFFERENCE, ms=5, label="stopped")
            axes.axvline(pi / 10, color=svg.LIMIT, lw=0.8, label="10 steps per contact")
            axes.set(xscale="log", xlim=(wh[0], wh[-1]), ylim=(0, 3.1))
            axes.set_title(name, size=9)
        both[1].set_xlabel("w h (1); steps per contact: π / (w h)")
        svg.legend_above(both[0], 3)
