"""Where the fixed steps of Exudyn's five bodies cannot follow a contact: step and stiffness against theory.

Both methods are unconditionally stable for a linear spring, so a lasting contact sets no boundary. A wall is
no linear spring: a step that jumps into it meets a force of a depth that the motion would never have, and one
hit returns more or less than it should. `comparison.studies.extremes.fixed_steps` says how much.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import nan, pi, sqrt

import numpy as np

from comparison.execution.run import Job, Outcome, Progress, run_all
from comparison.scene import Scene, load_scene
from comparison.studies.extremes.fixed_steps import METHODS, rebounds
from comparison.studies.extremes.impact import duration, effective_mass
from comparison.studies.shared.switches import corner_stiffness
from comparison.tables.table import Table

MODULI = tuple(10.0**power for power in range(6, 14))
"""Pa."""
HIT_STEPS = (1e-7, 1e-6, 1e-5, 1e-4, 1e-3)
"""s, of the single hits."""
PHASES = (0.125, 0.375, 0.625, 0.875)
LEAST = 0.01
"""w h below which a hit takes more than 300 steps and is as exact as it can be."""
STEPS = (1e-6, 2e-6, 5e-6, 1e-5, 2e-5, 5e-5, 1e-4, 2e-4, 5e-4, 1e-3)
"""s, of the map."""
LOOSE = 1e-4
"""Of Newton's iteration, where the usual one failed."""
_SLOWEST = 1e-6
"""rpm: the crank stands still for the time of a hit."""
_APPROACH, _LEAVE = 3, 40
"""Steps in flight before and after the hit; in the latter the algorithmic acceleration dies away."""


@dataclass(frozen=True)
class Hit:
    """One hit of the slider, upright, on its wall, in speeds before it.

    Attributes
    ----------
    wh
        Step times sqrt(2 K / m): both corners of a side hit at once.
    rebound, theory
        What the slider leaves with; what the recurrence of one mass says.
    impulse, speed
        Of the table of contacts: impulse over momentum less 1, which should be the rebound, and the speed of
        the touch, which should be 1.
    loosened
        Where Newton failed: the status with `LOOSE`, a larger tolerance.
    """

    method: str
    step: float
    wh: float
    status: str
    rebound: float
    theory: float
    impulse: float
    speed: float
    loosened: str


@dataclass(frozen=True)
class Cell:
    """A quarter of a turn with Hertz' law.

    Attributes
    ----------
    steps_per_contact
        Of an elastic hit by one corner at the speed of the scene's first touch.
    wrong
        Where the method gives energies: what came from nowhere, in what damping and friction took. Else: how
        much deeper than the reference's the deepest dip into a wall is, in the reference's; nan if stopped.
    speed
        Largest |vx| of the slider in that of the reference.
    until
        s: the last sample.
    """

    method: str
    step: float
    modulus: float
    status: str
    steps_per_contact: float
    wrong: float
    speed: float
    until: float


@dataclass(frozen=True)
class Found:
    """What was measured."""

    hits: list[Hit]
    cells: list[Cell]


def measured(n_jobs: int, on_progress: Progress | None) -> Found:
    """Run all hits and the map."""
    hits = [
        (method, step, young, phase)
        for method in METHODS
        for step in HIT_STEPS
        for young in MODULI
        for phase in PHASES
        if step * frequency(young) >= LEAST
    ]
    cells = [(method, step, young) for method in METHODS for step in STEPS for young in MODULI]
    jobs = [Job(hit_scene(*key), "exudyn") for key in hits]
    jobs += [Job(map_scene(*key), "exudyn") for key in cells]
    jobs += [Job(map_scene("", 1.0, young), "reference") for young in MODULI]
    outcomes = run_all(jobs, n_jobs, on_progress)
    failed = [key for key, outcome in zip(hits, outcomes, strict=False) if outcome.status == "newton-failed"]
    again = [Job(hit_scene(*key).with_values({"solver.exudyn.tolerance": LOOSE}), "exudyn") for key in failed]
    loosened = dict(zip(failed, (each.status for each in run_all(again, n_jobs)), strict=True))
    exact = dict(zip(MODULI, outcomes[-len(MODULI) :], strict=True))
    return Found(
        [_hit(*key, outcome, loosened.get(key, "")) for key, outcome in zip(hits, outcomes, strict=False)],
        [
            _cell(*key, outcome, exact[key[2]])
            for key, outcome in zip(cells, outcomes[len(hits) :], strict=False)
        ],
    )


def hit_scene(method: str, step: float, young: float, phase: float) -> Scene:
    """Return the press at rest, its slider thrown upright at the left wall: linear law, nothing lost.

    The touch comes ``phase`` of a step after a state in flight. The slider moves a micrometre a step at
    most: it does not come to the other wall.
    """
    speed = min(0.05, 1e-6 / step)
    count = _APPROACH + int(1.3 * pi / (step * frequency(young))) + _LEAVE
    turn = 60.0 / _SLOWEST
    base = load_scene("150rpm-0.2mm")
    before = (_APPROACH + phase) * step * speed
    return base.with_values(
        {
            "contact.exponent": 1.0,
            "contact.restitution": 1.0,
            "contact.youngs_modulus": young,
            "friction.coefficient": 0.0,
            "environment.gravity": 0.0,
            "drive.speed_rpm": _SLOWEST,
            "drive.cycles": count * step / turn,
            "initial.slider_vx": -speed,
            "initial.slider_offset": before - base.data["clearance"]["slider"],
            "output.groups": ["corners"],
            "output.samples_per_cycle": round(turn / step),
            "solver.exudyn.method": method,
            # A sample a step, although their quotient rounds.
            "solver.exudyn.step": step * (1 + 1e-6),
        }
    )


def map_scene(method: str, step: float, young: float) -> Scene:
    """Return a quarter of a turn of the central case; without a method: for the reference."""
    values: dict[str, object] = {
        "contact.youngs_modulus": young,
        "drive.cycles": 0.25,
        "output.groups": [],
        "output.samples_per_cycle": 400,
    }
    if method:
        values |= {"solver.exudyn.method": method, "solver.exudyn.step": step}
    if method == "trapezoidal-index2":
        values["output.groups"] = ["energy"]
    return load_scene("150rpm-0.2mm", values)


def frequency(young: float) -> float:
    """Return w = sqrt(2 K / m) of a hit by both corners with the linear law, rad/s."""
    scene = load_scene("150rpm-0.2mm", {"contact.youngs_modulus": young}).data
    return sqrt(corner_stiffness(scene["contact"]) / effective_mass(scene, 2))


def _hit(method: str, step: float, young: float, phase: float, outcome: Outcome, loosened: str) -> Hit:
    wh = step * frequency(young)
    theory = float(rebounds(METHODS[method], wh, np.array([phase]))[0])
    run = outcome.table
    if run is None or run.events is None:
        return Hit(method, step, wh, outcome.status, nan, theory, nan, nan, loosened)
    scene = hit_scene(method, step, young, phase).data
    speed, first = -scene["initial"]["slider_vx"], run.events.iloc[0]
    rebound = run.values("slider_vx")[-1] / speed
    impulse = first["impulse"] / (effective_mass(scene, 2) * speed) - 1
    touched = float(first["normal_speed"] / speed)
    return Hit(method, step, wh, "success", float(rebound), theory, float(impulse), touched, loosened)


def _cell(method: str, step: float, young: float, outcome: Outcome, exact: Outcome) -> Cell:
    data = map_scene(method, step, young).data
    run = outcome.table or outcome.partial
    until = nan if run is None or len(run.frame) == 0 else float(run.time[-1])
    first = exact.table.events if exact.table is not None else None
    speed = nan if first is None else float(first["normal_speed"].iloc[0])
    lasting = duration(effective_mass(data, 1), corner_stiffness(data["contact"]), speed)
    wrong = fast = nan
    if outcome.table is not None and exact.table is not None:
        wrong = _wrong(outcome.table, exact.table, data["mechanism"]["guide_x"], data["clearance"]["slider"])
        fast = _largest(outcome.table, "slider_vx") / _largest(exact.table, "slider_vx")
    return Cell(method, step, young, outcome.status, lasting / step, wrong, fast, until)


def _wrong(run: Table, exact: Table, guide: float, clearance: float) -> float:
    if "energy_residual" in run.channels:
        lost = run.values("energy_damping")[-1] + run.values("energy_friction")[-1]
        return float(-run.values("energy_residual")[-1] / lost)
    deepest, right = (_largest(each, "slider_x", guide) - clearance for each in (run, exact))
    return deepest / right - 1


def _largest(run: Table, channel: str, middle: float = 0.0) -> float:
    """Return the largest distance of a channel from a value, over all steps."""
    ends = run.extrema[channel]
    return max(abs(ends["min"] - middle), abs(ends["max"] - middle))
