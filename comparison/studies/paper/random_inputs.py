"""Random inputs, and many runs with drawn ones."""

import tomllib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from importlib.resources import files
from math import exp, log1p, sqrt
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from scipy.stats import norm

from comparison.execution.run import Progress, run_one
from comparison.execution.store import Row
from comparison.execution.tasks import SUCCESS, Task, measure_all, on_processes
from comparison.reliability.errors import QUANTITIES, slider_errors
from comparison.scene import Scene, SceneError
from comparison.scene.keys import did_you_mean
from comparison.scene.schema import RandomInput
from comparison.studies.shared.scenes import settable
from comparison.tables.channels import Array
from comparison.tables.table import Table

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
class Draw(Task):
    """A run of a scene with drawn inputs; ``factor`` multiplies deviations.

    The same seed and number draw the same inputs, whatever the solver's settings.
    """

    scene: Scene
    inputs: tuple[RandomInput, ...]
    seed: int
    factor: float = 1.0
    number: int = 0
    models = ("reference",)

    @property
    def u(self) -> Array:
        """The inputs in standard deviations, shape (d,)."""
        return self.factor * np.random.default_rng([self.seed, self.number]).normal(size=len(self.inputs))


class Drawn(NamedTuple):
    """What came of draws."""

    u: Array  # inputs in standard deviations, shape (n, d), of the runs that succeeded
    responses: pd.DataFrame  # a row for each of these runs by its number, with the columns of `RESPONSES`
    failures: list[str]  # one line for each run that did not
    seconds: float  # processor time of a run, the mean, s


def run_draws(draws: Sequence[tuple[Draw, int]], n_jobs: int, on_progress: Progress | None) -> list[Drawn]:
    """Run so many of each draw by the reference, from the first on; what ran before is not run again."""
    tasks = [[replace(one, number=number) for number in range(count)] for one, count in draws]
    rows = iter(
        measure_all(measure, [task for some in tasks for task in some], on_processes(n_jobs), on_progress)
    )
    drawn = []
    for some in tasks:
        results = list(zip(some, rows, strict=False))
        good = [(task, row["responses"]) for task, row in results if row["status"] == SUCCESS]
        drawn.append(
            Drawn(
                np.array([task.u for task, _ in good]).reshape(-1, len(some[0].inputs)),
                pd.DataFrame(
                    [each for _, each in good], [task.number for task, _ in good], list(RESPONSES), float
                ),
                [f"{row['status']}; {row['message']}" for _, row in results if row["status"] != SUCCESS],
                sum(row.get("seconds", 0.0) for _, row in results) / len(results),
            )
        )
    return drawn


def measure(task: Draw, progress: Progress) -> Row:
    """Run a draw, the ideal mechanism with the same numbers, and that with the scene's own."""
    del progress
    scene = task.scene.with_values(values_at(task.scene, task.inputs, task.u))
    asked = (scene, scene.with_values(IDEAL), task.scene.with_values(IDEAL))
    run, ideal, nominal = (run_one(each, "reference") for each in asked)
    return {"responses": respond(run, ideal, nominal, scene.period)}


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
