"""The press as a map: the slider's state at a crank angle to that one cycle later, by any model.

A state at a crank angle is a scene: the crank starts at that angle, and the keys of ``[initial]`` hold the
slider's place, tilt and speeds; everything else follows from the crank. What a scene cannot hold is the
impact speed that a closed contact remembers. So states are taken where the slider flies.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from math import pi
from typing import Any

import numpy as np
from numpy.typing import NDArray

from comparison.execution.run import Progress, run_one
from comparison.execution.store import Row
from comparison.execution.tasks import Task
from comparison.scene import Scene
from comparison.studies.nonlinear.methods import exponents
from comparison.tables.channels import CORNERS, Array, BoolArray
from comparison.tables.table import Table

STATE = {
    "slider_x": "initial.slider_offset",
    "slider_angle": "initial.slider_angle",
    "slider_vx": "initial.slider_vx",
    "slider_omega": "initial.slider_omega",
}
"""Channel of a table -> key of a scene."""
CLEAR_OF_WALLS = 0.02  # of the clearance
SHORTEST = 0.08  # of a cycle: the shortest stage
TRANSIENT = 10  # cycles before the first that counts; the start is forgotten after one
SAMPLES = 200  # a cycle; stages begin and end at samples
ROUND_OFF = 1e-15  # m; some ten times the rounding of a coordinate of 0.55 m


def states(table: Table, scene: Scene) -> Array:
    """Return the slider's state at every sample, shape (n, 4): offset from the guide (m), rad, m/s, rad/s."""
    values = np.stack([table.values(channel) for channel in STATE], axis=1)
    values[:, 0] -= scene.data["mechanism"]["guide_x"]
    return values


def free(table: Table, scene: Scene) -> BoolArray:
    """Return at which samples no corner is close to a wall, shape (n,)."""
    gap = np.min([table.values(f"corner_{corner}_gap") for corner in CORNERS], axis=0)
    return np.asarray(gap > CLEAR_OF_WALLS * scene.data["clearance"]["slider"])


def scale(scene: Scene) -> Array:
    """Return what turns a state into metres, shape (4,): 1 and half the slider's length, times T / 2 pi."""
    half, time = 0.5 * scene.data["mechanism"]["slider"]["length"], scene.period / (2 * pi)
    return np.array([1.0, half, time, half * time])


def by_cycle(values: NDArray[Any], scene: Scene) -> NDArray[Any]:
    """Return samples by cycle and angle, shape (cycles, samples a cycle, ...), without the very last."""
    return values[:-1].reshape(-1, scene.data["output"]["samples_per_cycle"], *values.shape[1:])


class Press:
    """The slider's orbit in stages that begin and end in flight; times are samples since the start.

    A stage is at least `SHORTEST` of a cycle long and ends where no corner is closer to a wall than
    `CLEAR_OF_WALLS`: after the slider has rested at one, with its next flight.
    """

    def __init__(self, scene: Scene, run: Callable[[Scene], Table]) -> None:
        """Take the scene as it starts, with its samples a cycle, and what runs it."""
        self._scene, self._run = scene.with_values({"output.groups": ["corners"]}), run
        self._per_cycle = int(scene.data["output"]["samples_per_cycle"])

    def orbit(self, state: Array, when: int) -> tuple[Array, int]:
        """Take a state, shape (4,), to the end of the stage that begins with it.

        Raises ValueError if the slider does not fly again for a whole cycle.
        """
        shortest = round(SHORTEST * self._per_cycle)
        for samples in (2 * shortest, self._per_cycle):
            flying = np.flatnonzero(free(self._table(state, when, samples), self._scene)[shortest:])
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
        offset = np.copysign(360.0, drive["speed_rpm"]) * (when % self._per_cycle) / self._per_cycle
        values = dict(zip(STATE.values(), state.tolist(), strict=True)) | {
            "mechanism.crank_angle_deg": float(mechanism["crank_angle_deg"] + offset),
            "drive.cycles": samples / self._per_cycle,
        }
        return self._run(self._scene.with_values(values))


@dataclass(frozen=True)
class Chain(Task):
    """Perturbed runs that are followed through many cycles."""

    scene: Scene
    model: str
    cycles: int
    distances: tuple[float, ...]  # m, growing

    @property
    def models(self) -> tuple[str, ...]:
        """Its model."""
        return (self.model,)


def measure(chain: Chain, progress: Progress) -> Row:
    """Run a scene until its start is forgotten, and follow perturbed runs from its next flight on."""
    del progress
    run = partial(run_one, model=chain.model)
    scene = chain.scene.with_values({"output.groups": ["corners"], "output.samples_per_cycle": SAMPLES})
    before = scene.with_values({"drive.cycles": float(TRANSIENT + 1)})
    table, press = run(before), Press(scene, run)
    when = TRANSIENT * SAMPLES + int(np.argmax(by_cycle(free(table, scene), before)[-1]))
    try:
        measured = exponents(
            press.orbit, press.perturbed, states(table, before)[when], when, when + chain.cycles * SAMPLES,
            distances=np.array(chain.distances), round_off=ROUND_OFF, scale=scale(scene),
            period=SAMPLES, skip=1,
        )  # fmt: skip
    except ValueError as error:
        return {"status": "failed", "message": " ".join(str(error).split())}
    return {"exponents": [list(each) for each in measured]}
