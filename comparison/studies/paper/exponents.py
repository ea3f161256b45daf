"""Largest Lyapunov exponents: of a map, of the press as a map, and the verdict on a scene.

*Exponents.* Perturbed orbits are integrated beside an orbit, the logarithm of the growth of their distance is
recorded, and they are brought back along their direction to the initial distance (G. Benettin, L. Galgani, A.
Giorgilli, J.-M. Strelcyn, Meccanica 15 (1980) 9-30, Part 2) after each *stage*, of which a period has
several: a whole one takes a distance from round-off to the size of the attractor. One more perturbed orbit
starts every stage at round-off: its distance at the end is the error of the computation. An orbit that does
not get `MARGIN` times as far is *collapsed*: its growth is only bounded from above, and it starts the next
stage in the direction that it had before.

*The press as a map* takes the slider's state at a crank angle to that one cycle later, by any model. A state
at a crank angle is a scene: the crank starts at that angle, and the keys of ``[initial]`` hold the slider's
place, tilt and speeds; everything else follows from the crank. A scene cannot hold the impact speed that a
closed contact remembers. So states are taken where the slider flies.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum
from functools import partial
from math import pi
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from comparison.execution.run import Progress, run_one
from comparison.execution.store import Row
from comparison.execution.tasks import Task
from comparison.models import MODELS
from comparison.scene import Scene
from comparison.tables.channels import CORNERS, Array, BoolArray
from comparison.tables.table import Table

MARGIN = 10.0  # times the error: there it changes the logarithm by at most 0.1
CONFIDENCE = 0.95
RESAMPLES = 2000
COLLAPSE_LIMIT = 0.1  # share of periods with a collapsed stage that is passed over


class Exponent(NamedTuple):
    """A largest Lyapunov exponent per period, with its confidence interval."""

    value: float
    low: float
    high: float
    collapsed: float  # share of the periods that give a bound only

    @property
    def measured(self) -> bool:
        """True if few enough periods collapsed for ``value`` to be more than an upper bound."""
        return self.collapsed <= COLLAPSE_LIMIT

    @property
    def sign(self) -> int:
        """1 or -1 where the interval excludes 0; a bound can only tell that it is negative."""
        if self.high < 0.0:
            return -1
        return 1 if self.low > 0.0 and self.measured else 0


class Settings(NamedTuple):
    """Settings of the perturbed orbits; the distances in coordinates times ``scale``."""

    distances: Array  # of the perturbed orbits at the start of a stage
    round_off: float  # that of the orbit that shows the error
    scale: Array
    period: int
    skip: int = 0  # periods until the directions have settled


def exponents(
    orbit: Callable[[Array, int], tuple[Array, int]],
    advance: Callable[[Array, int, int], Array],
    start: Array,
    when: int,
    until: int,
    settings: Settings,
) -> list[Exponent]:
    """Follow an orbit, which starts at a time, with its perturbed orbits; stages begin before ``until``.

    ``orbit`` takes a state and its time to the end of a stage, which it chooses; ``advance`` a state and its
    time to a given end, an equal state to the same end. Returns the exponent of each distance per period: a
    stage belongs to that in which it begins.
    """
    distances, round_off, scale, period, skip = settings
    state = np.asarray(start, dtype=np.float64)
    diagonal = np.full(state.size, 1.0 / np.sqrt(state.size))
    directions = np.tile(diagonal, (distances.size, 1))
    begins, logs, collapsed = [], [], []
    while when < until:
        after, end = orbit(state, when)
        drift = (advance(state + round_off * diagonal / scale, when, end) - after) * scale
        error = float(np.linalg.norm(drift))
        starts = state + distances[:, None] * directions / scale
        offsets = (np.array([advance(neighbour, when, end) for neighbour in starts]) - after) * scale
        norms = np.linalg.norm(offsets, axis=1)
        collapse = norms <= MARGIN * error
        directions[~collapse] = offsets[~collapse] / norms[~collapse, None]
        # Where even the error is zero, so may a distance be: the least number there is has a logarithm.
        minimum = np.maximum(MARGIN * error, np.finfo(float).tiny)
        begins.append(when)
        logs.append(np.log(np.maximum(norms, minimum) / distances))
        collapsed.append(collapse)
        state, when = after, end
    periods = np.array(begins) // period
    periods -= periods[0]
    results = []
    for growth, collapse in zip(np.transpose(logs), np.transpose(collapsed), strict=True):
        each = np.bincount(periods, weights=growth)[skip:].astype(np.float64)
        share = float(np.mean(np.bincount(periods, weights=collapse)[skip:] > 0))
        results.append(Exponent(float(np.mean(each)), *mean_interval(each), share))
    return results


def mean_interval(values: Array, seed: int = 0) -> tuple[float, float]:
    """Return the confidence interval of the mean of a stationary series, shape (n,).

    Bootstrap of circular blocks of n^(1/3) periods, which keep the correlation of neighbours (D. N. Politis
    and J. P. Romano, in Exploring the Limits of Bootstrap, 1992, 263-270).
    """
    n = values.size
    length = max(1, round(n ** (1 / 3)))
    starts = np.random.default_rng(seed).integers(n, size=(RESAMPLES, -(-n // length)))
    rows = (starts[:, :, None] + np.arange(length)).reshape(RESAMPLES, -1)[:, :n] % n
    tail = 0.5 * (1.0 - CONFIDENCE)
    low, high = np.quantile(np.mean(values[rows], axis=1), (tail, 1.0 - tail))
    return float(low), float(high)


# ---- the press as a map

STATE = {
    "slider_x": "initial.slider_offset",
    "slider_angle": "initial.slider_angle",
    "slider_vx": "initial.slider_vx",
    "slider_omega": "initial.slider_omega",
}
"""Channel of a table -> key of a scene."""
WALL_MARGIN = 0.02  # of the clearance
SHORTEST_STAGE = 0.08  # of a cycle
TRANSIENT = 10  # cycles before the first that counts; the start is forgotten after one
SAMPLES = 200  # a cycle; stages begin and end at samples
ROUND_OFF = 1e-15  # m; some ten times the rounding of a coordinate of 0.55 m


def states(table: Table, scene: Scene) -> Array:
    """Return the slider's state at every sample, shape (n, 4): offset from the guide (m), rad, m/s, rad/s."""
    values = np.stack([table.values(channel) for channel in STATE], axis=1)
    values[:, 0] -= scene.data["mechanism"]["guide_x"]
    return values


def in_flight(table: Table, scene: Scene) -> BoolArray:
    """Return a mask of the samples without a corner close to a wall, shape (n,)."""
    gap = np.min([table.values(f"corner_{corner}_gap") for corner in CORNERS], axis=0)
    return np.asarray(gap > WALL_MARGIN * scene.data["clearance"]["slider"])


def scale(scene: Scene) -> Array:
    """Return factors from a state to metres, shape (4,): 1 and half the slider's length, times T / 2 pi."""
    half, time = 0.5 * scene.data["mechanism"]["slider"]["length"], scene.period / (2 * pi)
    return np.array([1.0, half, time, half * time])


def by_cycle(values: NDArray[Any], scene: Scene) -> NDArray[Any]:
    """Return samples by cycle and angle, shape (cycles, samples a cycle, ...), without the very last."""
    return values[:-1].reshape(-1, scene.data["output"]["samples_per_cycle"], *values.shape[1:])


class Press:
    """The slider's orbit in stages that begin and end in flight; times are samples since the start.

    A stage is at least `SHORTEST_STAGE` of a cycle long and ends where no corner is closer to a wall than
    `WALL_MARGIN`: after the slider has rested at one, with its next flight.
    """

    def __init__(self, scene: Scene, run: Callable[[Scene], Table]) -> None:
        """Take the scene as it starts, with its samples a cycle, and the function that runs it."""
        self._scene, self._run = scene.with_values({"output.groups": ["corners"]}), run
        self._per_cycle = int(scene.data["output"]["samples_per_cycle"])

    def orbit(self, state: Array, when: int) -> tuple[Array, int]:
        """Take a state, shape (4,), to the end of the stage that begins with it.

        Raises ValueError if the slider does not fly again for a whole cycle.
        """
        shortest = round(SHORTEST_STAGE * self._per_cycle)
        for samples in (2 * shortest, self._per_cycle):
            flying = np.flatnonzero(in_flight(self._table(state, when, samples), self._scene)[shortest:])
            if flying.size:
                end = when + shortest + int(flying[0])
                # Run once more to there: the tables of the perturbed runs end at that sample too.
                return self.advance(state, when, end), end
        raise ValueError(f"scene {self._scene.name!r}: the slider does not fly for a cycle")

    def advance(self, state: Array, when: int, end: int) -> Array:
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
    transient = scene.with_values({"drive.cycles": float(TRANSIENT + 1)})
    table, press = run(transient), Press(scene, run)
    when = TRANSIENT * SAMPLES + int(np.argmax(by_cycle(in_flight(table, scene), transient)[-1]))
    try:
        results = exponents(
            press.orbit, press.advance, states(table, transient)[when], when, when + chain.cycles * SAMPLES,
            Settings(np.array(chain.distances), ROUND_OFF, scale(scene), SAMPLES, skip=1),
        )  # fmt: skip
    except ValueError as error:
        return {"status": "failed", "message": " ".join(str(error).split())}
    return {"exponents": [list(each) for each in results]}


# ---- verdict

Key = tuple[str, str, float]  # scene, model, and its tolerance


class Chaos(Enum):
    """Judgement of a scene by its exponents."""

    CHAOTIC = "chaotic"
    REGULAR = "not chaotic"
    UNDECIDED = "undecided"


def verdict(best: Mapping[Key, Exponent], name: str) -> Chaos:
    """Return the verdict on a scene's chaos, by the exponents to believe of its runs.

    Chaotic: positive in every run that measures it, in both models. Not chaotic: it, or its upper bound,
    negative in every run.
    """
    runs = {key: e for key, e in best.items() if key[0] == name}
    results = {key: e for key, e in runs.items() if e.measured}
    if {e.sign for e in results.values()} == {1} and {model for _, model, _ in results} == set(MODELS):
        return Chaos.CHAOTIC
    return Chaos.REGULAR if runs and {e.sign for e in runs.values()} == {-1} else Chaos.UNDECIDED
