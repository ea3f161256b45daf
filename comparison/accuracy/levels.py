"""Solver settings by name or by wanted error, their refinement, and the two tiers of a verdict.

The numbers are data: ``accuracy.toml`` has the names and the refinement, ``thresholds.toml`` what a verdict
requires, ``measured.toml`` error bounds by scene.
"""

import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from math import inf
from typing import Any

from comparison.accuracy.measured import formulation, front
from comparison.models import OWN, declared, smallest_in_exudyn
from comparison.scene import Scene

NAMES = ("draft", "standard", "strict")
TIERS = ("standard", "tight")


class AccuracyError(ValueError):
    """Accuracy without a recorded setting; the message is one line."""


def metres(accuracy: str | float) -> float:
    """Return an accuracy that is no name as a number of metres; `AccuracyError` if it is not positive."""
    try:
        number = float(accuracy)
    except ValueError:
        number = 0.0
    if not 0 < number < inf:
        raise AccuracyError(
            f"accuracy {accuracy!r} must be {', '.join(NAMES)} or a positive number of metres"
        )
    return number


def solver_values(model: str, accuracy: str | float, scene: Scene) -> dict[str, object]:
    """Return a built-in model's solver settings for an accuracy, by dotted keys; `AccuracyError` if none.

    The accuracy is one of `NAMES`, or an error bound of slider_x in metres over the first cycle, also as
    text: the cheapest setting with that bound for the formulation that the scene names.
    """
    if model not in OWN:
        raise AccuracyError(
            f"accuracy {accuracy!r}: that of the model {model!r} is not recorded; "
            f"set its solver.{model} in the scene"
        )
    record = _record(model, scene.data["solver"][model])
    if accuracy in NAMES:
        return {record["key"]: record["names"][accuracy]}
    wanted, known = metres(accuracy), front(scene, model)
    if known is None:
        raise AccuracyError(
            f"accuracy {wanted:g} m: that of the {model} model's {formulation(scene, model)!r} is not "
            f"recorded for these joints; use {', '.join(NAMES)}"
        )
    setting = known.cheapest(wanted)
    if setting is None:
        raise AccuracyError(
            f"accuracy {wanted:g} m is out of reach of the {model} model: the smallest error bound is "
            f"{known.best:g} m, measured on {known.scene}"
        )
    return {record["key"]: setting}


def with_declared(scene: Scene, models: Iterable[str]) -> Scene:
    """Return the scene with the settings that installed models declare and the scene does not give."""
    values = {
        f"solver.{model}.{key}": value
        for model in models
        for key, value in declared(model).items()
        if key not in scene.data["solver"].get(model, {})
    }
    return scene.variant(values) if values else scene


def finer(model: str, scene: Scene) -> Scene | None:
    """Return the scene with the model's settings one level finer: tolerance / 10, step / 2; or None.

    With Exudyn's five bodies both: Newton's iteration stops with an error that is equal in both runs if only
    the step is halved, and would appear as a difference of models.
    """
    return _level(model, scene, "finer")


def coarser(model: str, scene: Scene) -> Scene | None:
    """Return the scene with the model's settings one level coarser: tolerance x 10, step x 2; or None."""
    return _level(model, scene, "coarser")


def _level(model: str, scene: Scene, direction: str) -> Scene | None:
    settings = scene.data["solver"].get(model, {})
    values = {
        f"solver.{model}.{key}": float(f"{settings[key] * factor:.12g}")  # 1e-11 by any path: one cached run
        for key, factor in _record(model, settings)[direction].items()
        if isinstance(settings.get(key), float)
    }
    return scene.variant(values) if values else None


def refinement(model: str, scene: Scene) -> tuple[float, float]:
    """Return the factor between two levels and the order at which the error should follow it."""
    return recorded_refinement(model, scene.data["solver"].get(model, {}))


def recorded_refinement(model: str, settings: Mapping[str, Any]) -> tuple[float, float]:
    """Return the same for a run of which only the settings are known."""
    record = _record(model, settings)
    return record["factor"], record["order"]


def tight(scene: Scene, models: tuple[str, str]) -> Scene | None:
    """Return the scene at the tight tier: the reference at ``strict``, Exudyn's tree with error control.

    Where a scene requires five bodies (no clearance, reactions), these keep its settings. None if a model is
    not built in: the accuracy of another package's model is unmeasured.
    """
    if not set(models) <= set(OWN):
        return None
    values: dict[str, object] = {}
    if "reference" in models:
        values |= solver_values("reference", "strict", scene)
    if "exudyn" in models and smallest_in_exudyn(scene.data) == "tree":
        tree: dict[str, object] = {"solver.exudyn.formulation": "tree"}
        values |= tree | solver_values("exudyn", "strict", scene.variant(tree))
    return scene.variant(values)


@dataclass(frozen=True)
class Thresholds:
    """Thresholds of a tier, explained in ``thresholds.toml``."""

    k: float
    share: float
    least_judged: int
    least_outside: int
    alpha: float
    coverage: float


def thresholds_record() -> dict[str, Any]:
    """Read ``thresholds.toml``."""
    return _read("thresholds.toml")


def thresholds(tier: str = "standard") -> Thresholds:
    """Return the numbers of a tier, ``"standard"`` or ``"tight"``."""
    record = thresholds_record()
    common = {name: number for name, number in record.items() if not isinstance(number, dict)}
    return Thresholds(**common, **record[tier])


def _record(model: str, settings: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return how a model is refined; an installed one by the names of its settings."""
    records = _read("accuracy.toml")
    record: Mapping[str, Any]
    if model in OWN:
        record = records[model].get("formulation", {}).get(str(settings.get("formulation")), records[model])
    else:
        record = records["installed"]["step" if "step" in settings else "tolerance"]
    return record


@cache
def _read(name: str) -> dict[str, Any]:
    return tomllib.loads(files("comparison.accuracy").joinpath(name).read_text("utf-8"))
