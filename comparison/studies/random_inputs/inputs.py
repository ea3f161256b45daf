"""Random inputs: from independent standard normal numbers to the values of a scene's keys."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from importlib.resources import files
from math import exp, log1p, sqrt
from typing import Any

from scipy.stats import norm

from comparison.scene import Scene, SceneError
from comparison.scene.schema import RandomInput
from comparison.studies.shared.scenes import settable
from comparison.tables.arrays import Array


def inputs_of(scene: Scene) -> tuple[RandomInput, ...]:
    """Return what scatters: as the scene says, else the defaults.

    Raises
    ------
    SceneError
        If a key is no number of the scene, or a lognormal one is not above zero.
    """
    chosen = scene.random or defaults()
    for one in chosen:
        value = _middle(scene, one)
        if one.distribution == "lognormal" and value <= 0:
            raise SceneError(
                f"scene {scene.name!r}: random: {label(one)} = {value:g} must be > 0 to be lognormal"
            )
    if len({label(one) for one in chosen}) < len(chosen):
        raise SceneError(f"scene {scene.name!r}: random: names a key twice")
    return chosen


def defaults() -> tuple[RandomInput, ...]:
    """Return the inputs of ``inputs.toml``."""
    text = files("comparison.studies.random_inputs").joinpath("inputs.toml").read_text("utf-8")
    return tuple(RandomInput(**entry) for entry in tomllib.loads(text)["random"])


def label(one: RandomInput) -> str:
    """Return the key, with its element where it has several."""
    return one.key if one.element is None else f"{one.key}[{one.element}]"


def values_at(scene: Scene, inputs: Sequence[RandomInput], u: Array) -> dict[str, object]:
    """Return the values of the keys for independent standard normal numbers u, shape (d,).

    The scene's own values are the middle of the distributions (of a lognormal one the median).
    """
    values: dict[str, Any] = {}
    for one, number in zip(inputs, u.tolist(), strict=True):
        value = _value(one, _middle(scene, one), number)
        if one.element is None:
            values[one.key] = value
        else:
            held = list(values.get(one.key, settable(scene.data)[one.key]))
            held[one.element] = value
            values[one.key] = held
    return values


def _value(one: RandomInput, middle: float, number: float) -> float:
    if one.distribution == "normal":
        return middle + one.deviation * number
    if one.distribution == "lognormal":
        return middle * exp(sqrt(log1p((one.deviation / middle) ** 2)) * number)
    return middle + sqrt(12.0) * one.deviation * (float(norm.cdf(number)) - 0.5)


def _middle(scene: Scene, one: RandomInput) -> float:
    known = settable(scene.data)
    if one.key not in known:
        raise SceneError(f"scene {scene.name!r}: random: {one.key!r} is not a key of a scene")
    value = known[one.key]
    if one.element is not None and isinstance(value, list) and one.element < len(value):
        value = value[one.element]
    elif one.element is not None or isinstance(value, bool) or not isinstance(value, int | float):
        raise SceneError(f"scene {scene.name!r}: random: {label(one)} is no number of a scene")
    return float(value)
