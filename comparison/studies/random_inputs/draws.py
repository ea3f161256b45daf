"""Random inputs, and many runs with drawn ones, in chunks: a chunk is a task of a worker and a stored row."""

import tomllib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from importlib.resources import files
from itertools import islice
from math import exp, log1p, sqrt
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from scipy.stats import norm

from comparison.execution.run import Progress, RunError, run_one
from comparison.execution.store import Row
from comparison.execution.tasks import Task, measure_all, on_processes
from comparison.reliability.errors import QUANTITIES, slider_errors
from comparison.scene import Scene, SceneError
from comparison.scene.keys import did_you_mean
from comparison.scene.schema import RandomInput
from comparison.studies.shared.scenes import settable
from comparison.tables.channels import Array
from comparison.tables.table import Table

CHUNK = 50
IDEAL = {"joints.slider": "ideal", "joints.crank_pin": "ideal"}
RESPONSES = {
    "displacement": "m",
    "velocity": "m/s",
    "acceleration": "m/s^2",
    "displacement, against the nominal mechanism": "m",
}
"""Largest errors of the second cycle and their units; against the ideal mechanism with the same numbers, or
against that with none of them drawn, at equal crank angle."""


# ---- inputs


def inputs_of(scene: Scene) -> tuple[RandomInput, ...]:
    """Return what scatters: as the scene says, else the inputs of ``inputs.toml``.

    Raises SceneError if a key is no number of the scene, or a lognormal one is not above zero.
    """
    if not (chosen := tuple(scene.random)):
        text = files(__package__).joinpath("inputs.toml").read_text("utf-8")
        chosen = tuple(RandomInput(**entry) for entry in tomllib.loads(text)["random"])
    for one in chosen:
        value = _middle(scene, one)
        if one.distribution == "lognormal" and value <= 0:
            raise SceneError(
                f"scene {scene.name!r}: random: {label(one)} = {value:g} must be > 0 to be lognormal"
            )
    if len({label(one) for one in chosen}) < len(chosen):
        raise SceneError(f"scene {scene.name!r}: random: names a key twice")
    return chosen


def label(one: RandomInput) -> str:
    """Return the key, with its element where it has several."""
    return one.key if one.element is None else f"{one.key}[{one.element}]"


def values_at(scene: Scene, inputs: Sequence[RandomInput], u: Array) -> dict[str, object]:
    """Return the values of the keys for independent standard normal numbers u, shape (d,).

    The scene's own values are the middle of the distributions (of a lognormal one the median).
    """
    values: dict[str, Any] = {}
    for one, number in zip(inputs, u.tolist(), strict=True):
        middle = _middle(scene, one)
        if one.distribution == "normal":
            value = middle + one.deviation * number
        elif one.distribution == "lognormal":
            value = middle * exp(sqrt(log1p((one.deviation / middle) ** 2)) * number)
        else:
            value = middle + sqrt(12.0) * one.deviation * (float(norm.cdf(number)) - 0.5)
        if one.element is None:
            values[one.key] = value
        else:
            values.setdefault(one.key, [*settable(scene.data)[one.key]])[one.element] = value
    return values


def _middle(scene: Scene, one: RandomInput) -> float:
    known = settable(scene.data)
    if one.key not in known:
        hint = did_you_mean(one.key, known)
        raise SceneError(f"scene {scene.name!r}: random: {one.key!r} is not a key of a scene{hint}")
    value = known[one.key]
    if one.element is not None and isinstance(value, list) and one.element < len(value):
        value = value[one.element]
    elif one.element is not None or isinstance(value, bool) or not isinstance(value, int | float):
        raise SceneError(f"scene {scene.name!r}: random: {label(one)} is no number of a scene")
    return float(value)


# ---- draws


@dataclass(frozen=True)
class Draws(Task):
    """So many runs of a scene with drawn inputs from the run ``first`` on; ``factor`` multiplies deviations.

    The same seed draws the same inputs, whatever the solver's settings.
    """

    scene: Scene
    inputs: tuple[RandomInput, ...]
    count: int
    seed: int
    factor: float = 1.0
    first: int = 0
    models = ("reference",)

    def u(self, number: int) -> Array:
        """Return the inputs of a run in standard deviations, shape (d,)."""
        return self.factor * np.random.default_rng([self.seed, number]).normal(size=len(self.inputs))


class Drawn(NamedTuple):
    """What came of draws."""

    u: Array  # inputs in standard deviations, shape (n, d), of the runs that succeeded
    responses: pd.DataFrame  # a row for each of these runs by its number, with the columns of `RESPONSES`
    failures: list[str]  # one line for each run that did not
    seconds: float  # processor time of a run, the mean, s


def run_draws(
    draws: Sequence[Draws], n_jobs: int, on_progress: Progress | None, chunk: int = CHUNK
) -> list[Drawn]:
    """Run all draws by the reference, in chunks of so many; what ran before is not run again."""
    firsts = [range(0, one.count, chunk) for one in draws]
    chunks = [
        replace(one, first=n, count=min(chunk, one.count - n))
        for one, parts in zip(draws, firsts, strict=True)
        for n in parts
    ]
    rows = iter(measure_all(measure, chunks, on_processes(n_jobs), on_progress))
    joined = []
    for one, parts in zip(draws, firsts, strict=True):
        # The row of a chunk whose process died has a message alone.
        results = list(islice(rows, len(parts)))
        numbers = [number for row in results for number in row.get("numbers", [])]
        responses = [each for row in results for each in row.get("responses", [])]
        joined.append(
            Drawn(
                np.array([one.u(number) for number in numbers]).reshape(-1, len(one.inputs)),
                pd.DataFrame(responses, numbers, list(RESPONSES), dtype=np.float64),
                [reason for row in results for reason in row.get("failures", [row.get("message", "")])],
                sum(row.get("seconds", 0.0) for row in results) / one.count,
            )
        )
    return joined


def measure(draws: Draws, progress: Progress) -> Row:
    """Run a chunk; a run that fails leaves its reason."""
    del progress
    run = partial(run_one, model="reference")
    nominal = run(draws.scene.with_values(IDEAL))
    numbers, responses, failures = [], [], []
    for number in range(draws.first, draws.first + draws.count):
        try:
            scene = draws.scene.with_values(values_at(draws.scene, draws.inputs, draws.u(number)))
            responses.append(respond(run(scene), run(scene.with_values(IDEAL)), nominal, scene.period))
            numbers.append(number)
        except (RunError, SceneError) as error:
            failures.append(str(error))
    return {"numbers": numbers, "responses": responses, "failures": failures}


def respond(run: Table, ideal: Table, nominal: Table, period: float) -> list[float]:
    """Return the responses of a run of two cycles or more, period in s, in the order of `RESPONSES`.

    ``ideal``: the ideal mechanism with the same numbers; ``nominal``: that with the scene's own numbers, at
    the same crank angles.
    """
    at_equal_angle = replace(nominal, frame=nominal.frame.assign(time=run.time))
    pairs = [*((channel, ideal) for channel in QUANTITIES.values()), ("slider_y", at_equal_angle)]
    return [
        abs(slider_errors(run, other, period, names=(channel,)).peak(channel, period, 2 * period).value)
        for channel, other in pairs
    ]
