"""An orbit of the press with perturbed runs beside it, followed in worker processes."""

from __future__ import annotations

from dataclasses import asdict, dataclass, fields
from functools import partial

import numpy as np

from comparison.execution.run import Progress, run_one
from comparison.execution.store import Row
from comparison.execution.tasks import SUCCESS, Task
from comparison.scene import Scene
from comparison.studies.nonlinear.methods.perturbed_orbits import PerturbedOrbits, follow
from comparison.studies.nonlinear.press import CLEAR_OF_WALLS, Press, Run, by_cycle, gaps, scale, states
from comparison.tables.arrays import Array

TRANSIENT = 10
"""Cycles before the first that counts; the start is forgotten after one."""
SAMPLES = 200
"""A cycle; stages begin and end at samples."""
ROUND_OFF = 1e-15
"""m; some ten times the rounding of a coordinate of 0.55 m."""


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
    """Follow one chain; where its perturbed runs cannot be followed its row says why."""
    del progress
    try:
        found = follow_press(chain)
    except ValueError as error:
        return {"status": "failed", "message": " ".join(str(error).split())}
    return {name: np.asarray(values).tolist() for name, values in asdict(found).items()}


def perturbed_orbits_of(row: Row) -> PerturbedOrbits | None:
    """Return what a row holds; None where the chain failed."""
    return (
        PerturbedOrbits(**{of.name: np.array(row[of.name]) for of in fields(PerturbedOrbits)})
        if row["status"] == SUCCESS
        else None
    )


def follow_press(chain: Chain) -> PerturbedOrbits:
    """Run the scene until its start is forgotten, and follow perturbed runs from there."""
    run = partial(run_one, model=chain.model)
    scene = chain.scene.with_values({"output.groups": ["corners"], "output.samples_per_cycle": SAMPLES})
    before = scene.with_values({"drive.cycles": float(TRANSIENT + 1)})
    when, state = _in_flight(before, run)
    press = Press(scene, run)
    return follow(
        press.orbit,
        press.perturbed,
        state,
        when,
        when + chain.cycles * SAMPLES,
        distances=np.array(chain.distances),
        round_off=ROUND_OFF,
        scale=scale(scene),
    )


def _in_flight(scene: Scene, run: Run) -> tuple[int, Array]:
    """Return when the slider first flies in the last cycle, and its state there."""
    table = run(scene)
    gap = by_cycle(gaps(table), scene)[-1]
    when = TRANSIENT * SAMPLES + int(np.argmax(gap > CLEAR_OF_WALLS * scene.data["clearance"]["slider"]))
    return when, states(table, scene)[when]
