"""From a wanted accuracy to solver settings, and from a setting to the next finer one.

The numbers are data (``accuracy.toml``): measured errors of slider_x over the first cycle.
"""

from __future__ import annotations

import tomllib
from functools import cache
from importlib.resources import files
from typing import Any

from comparison.scene import Scene

NAMES = ("draft", "standard", "strict")


class AccuracyError(ValueError):
    """An accuracy that no setting on record gives; the message is one line."""


def solver_values(model: str, accuracy: str | float) -> dict[str, object]:
    """Solver settings of a model for a wanted accuracy.

    Parameters
    ----------
    model
        ``"reference"`` or ``"exudyn"``.
    accuracy
        ``"draft"``, ``"standard"``, ``"strict"``, or the wanted error of slider_x in metres over the
        first cycle, also as text (``"1e-8"``). Of the settings that promise it, the cheapest is taken.

    Returns
    -------
    dict
        Dotted scene keys and their values, for `Scene.with_values`.

    Raises
    ------
    AccuracyError
        If it is neither a name nor a positive number, or smaller than the best on record.
    """
    record = _record(model)
    if accuracy in NAMES:
        return {record["key"]: record["names"][accuracy]}
    try:
        wanted = float(accuracy)
    except ValueError:
        wanted = -1.0
    if not 0 < wanted < float("inf"):
        raise AccuracyError(
            f"accuracy {accuracy!r} must be {', '.join(NAMES)} or a positive number of metres"
        )
    good = [row for row in record["table"] if row["error"] <= wanted]
    if not good:
        best = min(row["error"] for row in record["table"])
        raise AccuracyError(
            f"accuracy {wanted:g} m is beyond the {model} model: the smallest possible is {best:g} m"
        )
    return {record["key"]: max(row["setting"] for row in good)}


def finer(model: str, scene: Scene) -> Scene:
    """Return the scene with the model's settings one level finer: tolerance / 10, step / 2.

    In Exudyn both: Newton's iteration stops with an error of its own that halving the step alone leaves in
    both runs alike, where the comparison would take it for a difference of models.
    """
    return _level(model, scene, "finer")


def coarser(model: str, scene: Scene) -> Scene:
    """Return the scene with the model's settings one level coarser: tolerance x 10, step x 2."""
    return _level(model, scene, "coarser")


def refinement(model: str) -> tuple[float, float]:
    """Return the factor between two levels and the order at which the error should follow it."""
    record = _record(model)
    return record["factor"], record["order"]


def _level(model: str, scene: Scene, which: str) -> Scene:
    settings = scene.data["solver"][model]
    return scene.with_values(
        {f"solver.{model}.{key}": settings[key] * factor for key, factor in _record(model)[which].items()}
    )


@cache
def _record(model: str) -> dict[str, Any]:
    record: dict[str, Any] = tomllib.loads(files("comparison").joinpath("accuracy.toml").read_text("utf-8"))[
        model
    ]
    return record
