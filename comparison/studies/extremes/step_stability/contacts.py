"""Where the steps of Exudyn's five bodies cannot follow a contact: step and stiffness against theory.

In contacts these are the scene's, without error control; a run with a sample at each step has no others.

Both methods are unconditionally stable for a linear spring, so a lasting contact sets no boundary. A wall is
no linear spring: a step that jumps into it meets a force of a depth that the motion would never have, and one
impact returns more or less than it should. `fixed_steps` says how much.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from itertools import product
from math import nan, pi, sqrt
from typing import Any

import numpy as np
import pandas as pd

from comparison.execution.run import Job, Outcome, Progress, run_all
from comparison.scene import Scene, load_scene
from comparison.studies.extremes.impact import duration, effective_mass
from comparison.studies.extremes.step_stability.fixed_steps import METHODS, rebounds
from comparison.studies.shared.switches import contacts, corner_stiffness
from comparison.tables.table import Table

LEAST = 0.01
"""w h below which an impact takes more than 300 steps and is as exact as it can be."""
LOOSE = 1e-4
"""Of Newton's iteration, where the usual tolerance failed."""
_SLOWEST = 1e-6
"""rpm: the crank stands still for the time of an impact."""
_APPROACH, _LEAVE = 3, 40
"""Steps in flight before and after the impact; in the latter the algorithmic acceleration dies away."""


@dataclass(frozen=True)
class Impact:
    """One impact of the slider, upright, on its left wall, with the press at rest and the linear law."""

    method: str
    step: float
    modulus: float
    phase: float

    @property
    def wh(self) -> float:
        """Step times w = sqrt(2 K / m): both corners of a side hit at once."""
        scene = load_scene("150rpm-0.2mm", {"contact.youngs_modulus": self.modulus}).data
        return self.step * sqrt(corner_stiffness(scene["contact"]) / effective_mass(scene, 2))

    @property
    def speed(self) -> float:
        """Of the slider, m/s: a micrometre a step at most, so that it does not come to the other wall."""
        return min(0.05, 1e-6 / self.step)

    def scene(self, tolerance: float | None = None) -> Scene:
        """Return the scene, in which nothing is lost; without a tolerance of Newton's with the usual one."""
        count = _APPROACH + int(1.3 * pi / self.wh) + _LEAVE
        cycle = 60.0 / _SLOWEST
        base = load_scene("150rpm-0.2mm")
        before = (_APPROACH + self.phase) * self.step * self.speed
        values = {
            "contact.exponent": 1.0,
            "contact.restitution": 1.0,
            "contact.youngs_modulus": self.modulus,
            "friction.coefficient": 0.0,
            "environment.gravity": 0.0,
            "drive.speed_rpm": _SLOWEST,
            "drive.cycles": count * self.step / cycle,
            "initial.slider_vx": -self.speed,
            "initial.slider_offset": before - base.data["clearance"]["slider"],
            "output.groups": ["corners"],
            "output.samples_per_cycle": round(cycle / self.step),
            "solver.exudyn.method": self.method,
            # A sample a step, although their quotient rounds.
            "solver.exudyn.step": self.step * (1 + 1e-6),
        }
        return base.with_values(values | ({"solver.exudyn.tolerance": tolerance} if tolerance else {}))

    def measure(self, outcome: Outcome) -> dict[str, object]:
        """Return what the slider leaves with and what one mass would, in speeds before the impact.

        ``rebound`` and ``theory``; of the table of contacts ``impulse``: over momentum, less 1, which should
        be the rebound, and ``touch``: the speed of the touch, which should be 1.
        """
        theory = float(rebounds(METHODS[self.method], self.wh, np.array([self.phase]))[0])
        row = asdict(self) | {"wh": self.wh, "status": outcome.status, "theory": theory}
        if (run := outcome.table) is not None:
            first, momentum = contacts(run).iloc[0], effective_mass(self.scene().data, 2) * self.speed
            row["rebound"] = run.values("slider_vx")[-1] / self.speed
            row["impulse"] = first["impulse"] / momentum - 1
            row["touch"] = first["normal_speed"] / self.speed
        return row


def run_impacts(impacts: Sequence[Impact], n_jobs: int, on_progress: Progress | None) -> pd.DataFrame:
    """Return a row each (`Impact.measure`). ``loosened``: where Newton failed, the status with `LOOSE`."""
    ended = run_all([Job(impact.scene(), "exudyn") for impact in impacts], n_jobs, on_progress)
    rows = pd.DataFrame([each.measure(of) for each, of in zip(impacts, ended, strict=True)])
    failed = [number for number, of in enumerate(ended) if of.status == "newton-failed"]
    again = run_all([Job(impacts[number].scene(LOOSE), "exudyn") for number in failed], n_jobs)
    return rows.assign(loosened=pd.Series([of.status for of in again], failed, dtype=object))


def run_map(
    steps: Sequence[float], moduli: Sequence[float], n_jobs: int, on_progress: Progress | None
) -> pd.DataFrame:
    """Return a row for each method, step (s) and modulus (Pa), see `map_row`."""
    points = list(product(METHODS, steps, moduli))
    jobs = [Job(map_scene(*point), "exudyn") for point in points]
    jobs += [Job(map_scene("", 1.0, young), "reference") for young in moduli]
    outcomes = run_all(jobs, n_jobs, on_progress)
    exact = dict(zip(moduli, outcomes[len(points) :], strict=True))
    mapped = zip(points, outcomes, strict=False)
    return pd.DataFrame([map_row(*point, outcome, exact[point[2]]) for point, outcome in mapped])


def map_scene(method: str, step: float, young: float) -> Scene:
    """Return a quarter of a cycle of the central case; without a method: for the reference."""
    values: dict[str, object] = {
        "contact.youngs_modulus": young,
        "drive.cycles": 0.25,
        "output.groups": ["energy"] if method == "trapezoidal-index2" else [],
        "output.samples_per_cycle": 400,
    }
    if method:
        values |= {"solver.exudyn.method": method, "solver.exudyn.step": step}
    return load_scene("150rpm-0.2mm", values)


def map_row(method: str, step: float, young: float, outcome: Outcome, exact: Outcome) -> dict[str, object]:
    """Return a point of the map.

    ``count``: steps per contact, in an elastic impact of one corner at the speed of the scene's first touch;
    ``until``: time of the last sample, s. Of a run that finished ``wrong``: where the method gives energies,
    the spurious energy in what damping and friction took, else how much deeper than the reference's the
    deepest penetration of a wall is, in the reference's; ``speed``: largest |vx| in that of the reference.
    """
    data = map_scene(method, step, young).data
    run = outcome.table or outcome.partial
    row: dict[str, object] = {"method": method, "step": step, "modulus": young, "status": outcome.status}
    row["until"] = nan if run is None or len(run.frame) == 0 else float(run.time[-1])
    if exact.table is not None:
        touch = float(contacts(exact.table)["normal_speed"].iloc[0])
        row["count"] = duration(effective_mass(data, 1), corner_stiffness(data["contact"]), touch) / step
        if outcome.table is not None:
            row["wrong"] = _wrong(outcome.table, exact.table, data)
            row["speed"] = _largest(outcome.table, "slider_vx") / _largest(exact.table, "slider_vx")
    return row


def _wrong(run: Table, exact: Table, data: Mapping[str, Any]) -> float:
    if "energy_residual" in run.channels:
        lost = run.values("energy_damping")[-1] + run.values("energy_friction")[-1]
        return float(-run.values("energy_residual")[-1] / lost)
    guide, clearance = data["mechanism"]["guide_x"], data["clearance"]["slider"]
    deepest, right = (_largest(each, "slider_x", guide) - clearance for each in (run, exact))
    return float(deepest / right - 1)


def _largest(run: Table, channel: str, middle: float = 0.0) -> float:
    """Return the largest distance of a channel from a value, over all steps."""
    ends = run.extrema[channel]
    return max(abs(ends["min"] - middle), abs(ends["max"] - middle))
