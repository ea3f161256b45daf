"""The press as a map: the slider's state at a crank angle to that one cycle later, by any model.

A state at a crank angle is a scene: the crank starts at that angle, and the keys of ``[initial]`` hold the
slider's place, tilt and speeds; everything else follows from the crank. What a scene cannot hold is the
impact speed that a closed contact remembers. So states are taken where the slider flies.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, fields
from functools import partial
from math import pi

import numpy as np

from comparison.execution.run import Progress, run_one
from comparison.execution.store import Row
from comparison.execution.tasks import SUCCESS, Task
from comparison.scene import Scene
from comparison.studies.nonlinear.methods import PerturbedOrbits, follow
from comparison.tables.arrays import Array
from comparison.tables.channels import CORNERS
from comparison.tables.table import Table

Run = Callable[[Scene], Table]

STATE = {
    "slider_x": "initial.slider_offset",
    "slider_angle": "initial.slider_angle",
    "slider_vx": "initial.slider_vx",
    "slider_omega": "initial.slider_omega",
}
"""Channel of a table -> key of a scene."""
CLEAR_OF_WALLS = 0.02
"""Of the clearance."""
SHORTEST = 0.08
"""Of a cycle: the shortest stage."""
TRANSIENT = 10
"""Cycles before the first that counts; the start is forgotten after one."""
SAMPLES = 200
"""A cycle; stages begin and end at samples."""
ROUND_OFF = 1e-15
"""m; some ten times the rounding of a coordinate of 0.55 m."""
RESTING = 0.78
"""Of a cycle from the start: the slider lies at the right wall with both corners."""
LATER = (0.78, 0.86, 0.0)
"""Of a cycle: still at rest, just after it has left the wall, at the next top dead centre."""
REMEMBERING = ("lr", "ur")
"""Corners at the right wall."""


def states(table: Table, scene: Scene) -> Array:
    """Return the slider's state at every sample, shape (n, 4): offset from the guide (m), rad, m/s, rad/s."""
    values = np.stack([table.values(channel) for channel in STATE], axis=1)
    values[:, 0] -= scene.data["mechanism"]["guide_x"]
    return values


def gaps(table: Table) -> Array:
    """Return the smallest gap of the four corners at every sample, m, shape (n,)."""
    return np.asarray(np.min([table.values(f"corner_{corner}_gap") for corner in CORNERS], axis=0))


def scale(scene: Scene) -> Array:
    """Return what turns a state into metres, shape (4,): 1 and half the slider's length, times T / 2 pi."""
    half, time = 0.5 * scene.data["mechanism"]["slider"]["length"], scene.period / (2 * pi)
    return np.array([1.0, half, time, half * time])


def by_cycle(values: Array, scene: Scene) -> Array:
    """Return samples by cycle and angle, shape (cycles, samples a cycle, ...), without the very last."""
    return values[:-1].reshape(-1, scene.data["output"]["samples_per_cycle"], *values.shape[1:])


def spread(cycles: Array, scene: Scene) -> Array:
    """Return how far states scatter, m, shape (angles,), from states of shape (cycles, angles, 4)."""
    return np.asarray(np.linalg.norm((cycles * scale(scene)).std(axis=0), axis=1))


class Press:
    """The slider's orbit in stages that begin and end in flight; times are samples since the start.

    A stage is at least `SHORTEST` of a cycle long and ends where no corner is closer to a wall than
    `CLEAR_OF_WALLS`: after the slider has rested at one, with its next flight.
    """

    def __init__(self, scene: Scene, run: Run) -> None:
        """Take the scene as it starts, with its samples a cycle, and what runs it."""
        self._scene, self._run = scene.with_values({"output.groups": ["corners"]}), run
        self.per_cycle = int(scene.data["output"]["samples_per_cycle"])

    def orbit(self, state: Array, when: int) -> tuple[Array, int]:
        """Take a state, shape (4,), to the end of the stage that begins with it.

        Raises
        ------
        ValueError
            If the slider does not fly again for a whole cycle.
        """
        shortest = round(SHORTEST * self.per_cycle)
        clear = CLEAR_OF_WALLS * self._scene.data["clearance"]["slider"]
        for samples in (2 * shortest, self.per_cycle):
            table = self._table(state, when, samples)
            flying = np.flatnonzero(gaps(table)[shortest:] > clear)
            if flying.size:
                end = when + shortest + int(flying[0])
                # Run once more to there: the tables of the perturbed runs end at that sample too.
                return self.perturbed(state, when, end), end
        raise ValueError(f"scene {self._scene.name!r}: the slider does not fly for a cycle")

    def perturbed(self, state: Array, when: int, end: int) -> Array:
        """Take a state, shape (4,), from one time to another."""
        return np.asarray(states(self._table(state, when, end - when), self._scene)[-1])

    def _table(self, state: Array, when: int, samples: int) -> Table:
        drive, mechanism = self._scene.data["drive"], self._scene.data["mechanism"]
        offset = np.copysign(360.0, drive["speed_rpm"]) * (when % self.per_cycle) / self.per_cycle
        values = dict(zip(STATE.values(), state.tolist(), strict=True)) | {
            "mechanism.crank_angle_deg": float(mechanism["crank_angle_deg"] + offset),
            "drive.cycles": samples / self.per_cycle,
        }
        return self._run(self._scene.with_values(values))


@dataclass(frozen=True)
class Chain(Task):
    """Perturbed runs that are followed through many cycles."""

    scene: Scene
    model: str
    cycles: int
    distances: tuple[float, ...]
    """m, growing."""

    @property
    def models(self) -> tuple[str, ...]:
        """Its model."""
        return (self.model,)


def measure(chain: Chain, progress: Progress) -> Row:
    """Run a chain's scene until its start is forgotten, and follow perturbed runs from its next flight on.

    Where they cannot be followed the row says why.
    """
    del progress
    run = partial(run_one, model=chain.model)
    scene = chain.scene.with_values({"output.groups": ["corners"], "output.samples_per_cycle": SAMPLES})
    before = scene.with_values({"drive.cycles": float(TRANSIENT + 1)})
    table, press = run(before), Press(scene, run)
    flying = by_cycle(gaps(table), before)[-1] > CLEAR_OF_WALLS * scene.data["clearance"]["slider"]
    when = TRANSIENT * SAMPLES + int(np.argmax(flying))
    try:
        orbits = follow(
            press.orbit, press.perturbed, states(table, before)[when], when, when + chain.cycles * SAMPLES,
            distances=np.array(chain.distances), round_off=ROUND_OFF, scale=scale(scene),
        )  # fmt: skip
    except ValueError as error:
        return {"status": "failed", "message": " ".join(str(error).split())}
    return {name: np.asarray(values).tolist() for name, values in asdict(orbits).items()}


def orbits_of(row: Row) -> PerturbedOrbits | None:
    """Return what a row holds; None where the chain failed."""
    if row["status"] != SUCCESS:
        return None
    return PerturbedOrbits(**{field.name: np.array(row[field.name]) for field in fields(PerturbedOrbits)})


@dataclass(frozen=True)
class Memory:
    """Of one coordinate of the state at an angle, over many cycles."""

    angle: float
    channel: str
    scatter: float
    """Standard deviation, m, by `scale`."""
    explained: float
    """Share of the variance that is a linear function of the inverse impact speeds, 0 to 1."""


def remembered(table: Table, scene: Scene, first_cycle: int) -> list[Memory]:
    """Fit the states after a rest by the impact speeds that the contacts keep through it.

    The damping force is K d^n C d' / v with the frozen speed v of the contact's first touch (Eqs. 9-11):
    where d' is given from outside, as in the slow rise and fall of the load during the rest, the depth
    departs from the elastic one by a share of 1 / v.

    Returns
    -------
    remembered
        Four for each angle of `LATER`, from ``first_cycle`` (from 0) on; none where the slider does not rest
        on both corners in every cycle.
    """
    cycles = by_cycle(states(table, scene) * scale(scene), scene)
    last = len(cycles) - 1
    speeds = _speeds(table, scene, range(first_cycle, last))
    if speeds is None:
        return []
    basis = np.column_stack([np.ones(len(speeds)), 1.0 / speeds])
    memories = []
    for angle in LATER:
        # What comes before the rest in a cycle's count of angles is in the next cycle.
        shift = 1 if angle < RESTING else 0
        values = cycles[first_cycle + shift : last + shift, round(angle * cycles.shape[1])]
        left = values - basis @ np.linalg.lstsq(basis, values)[0]
        for channel, scatter, rest in zip(STATE, values.std(axis=0), left.var(axis=0), strict=True):
            explained = float(1.0 - rest / scatter**2) if scatter else 0.0
            memories.append(Memory(angle, channel, float(scatter), explained))
    return memories


def _speeds(table: Table, scene: Scene, cycles: range) -> Array | None:
    """Return the impact speeds (m/s) of both corners at rest, shape (cycles, 2)."""
    if table.events is None:
        return None
    speeds = []
    for cycle in cycles:
        when = (cycle + RESTING) * scene.period
        closed = table.events[(table.events["start"] < when) & (table.events["end"] > when)]
        touched = closed.drop_duplicates("corner").set_index("corner")["normal_speed"].reindex(REMEMBERING)
        if touched.isna().any():
            return None
        speeds.append(touched.to_numpy(float))
    return np.array(speeds)
