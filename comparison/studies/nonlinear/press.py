"""The press as a map: the slider's state at a crank angle to that one cycle later, by any model.

A state at a crank angle is a scene: the crank starts at that angle, and the keys of ``[initial]`` hold the
slider's place, tilt and speeds; everything else follows from the crank. What a scene cannot hold is the
impact speed that a closed contact remembers. So states are taken where the slider flies.
"""

from __future__ import annotations

from collections.abc import Callable
from math import pi

import numpy as np

from comparison.scene import Scene
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
"""Of a cycle."""


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
                end = shortest + int(flying[0])
                # Run once more to there: the tables of the perturbed runs end at that sample too.
                return self.perturbed(state, when, when + end), when + end
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
