"""Many runs with drawn inputs, in chunks: a chunk is a task of a worker process and a row of the ledger."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

from comparison.execution.ledger import Row
from comparison.execution.run import Progress, RunError, runner
from comparison.execution.task_store import Task, measure_all, on_processes
from comparison.scene import Scene, SceneError
from comparison.scene.criteria import RandomInput
from comparison.studies.random_inputs.inputs import values_at
from comparison.studies.shared.errors import peak, second_cycle
from comparison.studies.sweep.runs import IDEAL
from comparison.tables.arrays import Array
from comparison.tables.table import Table

CHUNK = 50
RESPONSES = {
    "displacement": "m",
    "velocity": "m/s",
    "acceleration": "m/s^2",
    "displacement, against the nominal mechanism": "m",
}
"""Largest errors of the second turn and their units; against the ideal mechanism with the same numbers, or
against that with none of them drawn, at equal crank angle."""
_CHANNELS = ("slider_y", "slider_vy", "slider_ay")
_runner = cache(runner)


@dataclass(frozen=True)
class Draws:
    """Runs with inputs drawn about a scene.

    Attributes
    ----------
    scene
        With its solver's settings.
    inputs
        What is drawn.
    count
        How many runs.
    seed
        The same seed draws the same inputs, whatever the solver's settings.
    factor
        What the standard deviations are multiplied with.
    """

    scene: Scene
    inputs: tuple[RandomInput, ...]
    count: int
    seed: int
    factor: float = 1.0

    @property
    def chunks(self) -> list[Chunk]:
        """Its parts."""
        return [Chunk(self, first, min(CHUNK, self.count - first)) for first in range(0, self.count, CHUNK)]


@dataclass(frozen=True)
class Chunk(Task):
    """Runs ``first`` to ``first + count`` of some draws."""

    draws: Draws
    first: int
    count: int

    @property
    def identity(self) -> dict[str, object]:
        """Scene, inputs and which draws."""
        draws = self.draws
        drawn = [one.model_dump() for one in draws.inputs]
        return {
            "scene": draws.scene.hash,
            "inputs": drawn,
            "draw": [draws.seed, draws.factor, self.first, self.count],
        }

    @property
    def models(self) -> tuple[str, ...]:
        """The reference."""
        return ("reference",)


@dataclass(frozen=True)
class Drawn:
    """What came of draws.

    Attributes
    ----------
    u
        Inputs in standard deviations, shape (n, d): of the runs that succeeded.
    responses
        Shape (n, len(RESPONSES)).
    index
        Number of each run, shape (n,).
    failures
        One line for each run that did not succeed.
    seconds
        Processor time of a run, the mean, s.
    """

    u: Array
    responses: Array
    index: Array
    failures: list[str]
    seconds: float


def run_draws(draws: Sequence[Draws], n_jobs: int, on_progress: Progress | None) -> list[Drawn]:
    """Run all draws by the reference; what ran before is not run again."""
    chunks = [chunk for one in draws for chunk in one.chunks]
    held = iter(measure_all(measure, chunks, on_processes(n_jobs), on_progress))
    return [_joined([next(held) for _ in one.chunks], len(one.inputs)) for one in draws]


def measure(chunk: Chunk, progress: Progress) -> Row:
    """Run a chunk; a run that fails leaves its reason."""
    del progress
    draws, run = chunk.draws, _runner("reference")
    nominal = run(draws.scene.with_values(IDEAL))
    u, responses, index, failures = [], [], [], []
    for number in range(chunk.first, chunk.first + chunk.count):
        drawn = draws.factor * np.random.default_rng([draws.seed, number]).normal(size=len(draws.inputs))
        try:
            scene = draws.scene.with_values(values_at(draws.scene, draws.inputs, drawn))
            found = respond(run(scene), run(scene.with_values(IDEAL)), nominal, scene.period)
        except (RunError, SceneError) as error:
            failures.append(str(error))
            continue
        u.append(drawn.tolist())
        responses.append(found)
        index.append(number)
    return {"u": u, "responses": responses, "index": index, "failures": failures}


def respond(run: Table, ideal: Table, nominal: Table, period: float) -> list[float]:
    """Return the responses of one run, in the order of `RESPONSES`.

    Parameters
    ----------
    run
        Two turns or more.
    ideal
        The ideal mechanism with the same numbers, at the same times.
    nominal
        The ideal mechanism with the scene's own numbers: at the same crank angles.
    period
        Of a crank turn, s.
    """
    within = second_cycle(run.time, period)
    errors = [run.values(channel) - ideal.values(channel) for channel in _CHANNELS]
    errors.append(run.values("slider_y") - nominal.values("slider_y"))
    return [abs(peak(run.time, values, within).value) for values in errors]


def _joined(rows: Sequence[Row], inputs: int) -> Drawn:
    u = [values for row in rows for values in row.get("u", [])]
    responses = [values for row in rows for values in row.get("responses", [])]
    failures = [told for row in rows for told in row.get("failures", [row.get("message", "")])]
    index = [number for row in rows for number in row.get("index", [])]
    seconds = sum(row.get("seconds", 0.0) for row in rows)
    return Drawn(
        np.array(u, dtype=np.float64).reshape(-1, inputs),
        np.array(responses, dtype=np.float64).reshape(-1, len(RESPONSES)),
        np.array(index, dtype=np.float64),
        failures,
        seconds / max(1, len(index) + len(failures)),
    )
