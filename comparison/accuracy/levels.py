"""Solver settings for a requested accuracy, and refinement levels.

Names and levels are data (``accuracy.toml``), as are their error bounds by scene:
`comparison.accuracy.measured`.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from math import inf, isfinite, nan
from typing import Any

from comparison.accuracy.measured import Front, front
from comparison.models import OWN, declared
from comparison.scene import Scene

NAMES = ("draft", "standard", "strict")


class AccuracyError(ValueError):
    """Accuracy without a recorded setting; the message is one line."""


@dataclass(frozen=True)
class Expected:
    """Expected error and cost of a run; nan where not recorded.

    Attributes
    ----------
    error
        Error bound of slider_x over the span, m.
    span
        "the first cycle", or the measured part of it.
    seconds
        Estimated processor time of the whole run.
    cautions
        Reasons why these numbers may not hold.
    """

    error: float = nan
    span: str = "the first cycle"
    seconds: float = nan
    cautions: tuple[str, ...] = ()


def solver_values(model: str, accuracy: str | float, scene: Scene) -> dict[str, object]:
    """Return the solver settings of a model for a requested accuracy of a scene.

    Parameters
    ----------
    model
        ``"reference"`` or ``"exudyn"``.
    accuracy
        ``"draft"``, ``"standard"``, ``"strict"``, or an error bound of slider_x in metres over the first
        cycle, also as text (``"1e-8"``). The cheapest setting with that bound for this scene is taken.
    scene
        Names the formulation: Exudyn's ``"tree"`` is controlled by its tolerance, the others by their step.

    Returns
    -------
    dict
        Dotted scene keys and their values, for `Scene.variant`.

    Raises
    ------
    AccuracyError
        If it is neither a name nor a positive number, or smaller than the smallest recorded bound, or if the
        model is not built in and therefore unmeasured.
    """
    record = _record(model, _formulation(model, scene))
    if record is None:
        raise AccuracyError(
            f"accuracy {accuracy!r}: that of the model {model!r} is not recorded; "
            f"set its solver.{model} in the scene"
        )
    if accuracy in NAMES:
        return {record["key"]: record["names"][accuracy]}
    return {record["key"]: _cheapest(metres(accuracy), model, scene, front(scene, model))}


def metres(accuracy: str | float) -> float:
    """Return an accuracy that is no name as a number of metres.

    Raises
    ------
    AccuracyError
        If it is no positive number.
    """
    try:
        number = float(accuracy)
    except ValueError:
        number = nan
    if not 0 < number < inf:
        raise AccuracyError(
            f"accuracy {accuracy!r} must be {', '.join(NAMES)} or a positive number of metres"
        )
    return number


def _cheapest(wanted: float, model: str, scene: Scene, measured: Front | None) -> float:
    if measured is None:
        raise AccuracyError(
            f"accuracy {wanted:g} m: that of the {model} model's {_formulation(model, scene)!r} is not "
            f"recorded for these joints; use {', '.join(NAMES)}"
        )
    setting = measured.cheapest(wanted)
    if setting is None:
        raise AccuracyError(
            f"accuracy {wanted:g} m is out of reach of the {model} model: the smallest error bound is "
            f"{measured.best:g} m, measured on {measured.scene}"
        )
    return setting


def expected(scene: Scene, model: str) -> Expected:
    """Return the recorded error and cost of a scene's run at its settings."""
    record = _record(model, _formulation(model, scene))
    measured = None if record is None else front(scene, model)
    if record is None or measured is None:
        return Expected()
    setting = scene.data["solver"][model][record["key"].rpartition(".")[2]]
    failed = measured.failed(setting)
    error = nan if failed else measured.error(setting)
    return Expected(
        error=error if isfinite(error) else nan,
        span=measured.span,
        seconds=measured.seconds(setting, scene),
        cautions=(*([f"no result at this setting: {failed}"] if failed else []), *measured.cautions),
    )


def unmeasured(scene: Scene, model: str) -> str:
    """Return a line where a built-in model's error at the scene's settings was not measured on this scene."""
    known = front(scene, model) if model in OWN else None
    if known is None or known.applies:
        return ""
    error = expected(scene, model).error
    there = f" (on {known.scene} it is {error:.2g} m)" if isfinite(error) else ""
    return f"the error of slider_x was not measured on this scene{there}: estimate it by --check"


def is_measured(scene: Scene, model: str, accuracy: str | float) -> bool:
    """Return whether a setting with such an error bound, m, was measured on this very scene."""
    known = front(scene, model)
    return known is not None and known.applies and known.cheapest(metres(accuracy)) is not None


def measured_record(scene: Scene, model: str, accuracy: str | float) -> dict[str, object]:
    """Return what is recorded of an accuracy beside a table: the measured error bound of its settings."""
    known, found = front(scene, model), expected(scene, model)
    name = None if known is None else known.scene
    return {
        "wanted": accuracy,
        "from": f"measured on {name}" if name else "nothing recorded",
        "bound_m": found.error,
        "over": found.span,
        "cautions": list(found.cautions),
    }


def with_declared(scene: Scene, models: Iterable[str]) -> Scene:
    """Return the scene with the settings that installed models declare and the scene does not give.

    Raises
    ------
    EngineError
        If a model declares what is no setting.
    """
    values = {
        f"solver.{model}.{key}": value
        for model in models
        for key, value in declared(model).items()
        if key not in scene.data["solver"].get(model, {})
    }
    return scene.variant(values) if values else scene


def finer(model: str, scene: Scene) -> Scene | None:
    """Return the scene with the model's settings one level finer: tolerance / 10, step / 2.

    With Exudyn's five bodies both: Newton's iteration stops with an error that remains equal in both runs if
    only the step is halved, and would appear as a difference of models. An installed model is refined in
    whichever of ``step`` and ``tolerance`` the scene gives as a real number; None if neither.
    """
    return _level(model, scene, "finer")


def coarser(model: str, scene: Scene) -> Scene | None:
    """Return the scene with the model's settings one level coarser: tolerance x 10, step x 2; or None."""
    return _level(model, scene, "coarser")


def refinement(model: str, scene: Scene) -> tuple[float, float]:
    """Return the factor between two levels and the order at which the error should follow it."""
    return recorded_refinement(model, scene.data["solver"].get(model, {}))


def recorded_refinement(model: str, settings: Mapping[str, Any]) -> tuple[float, float]:
    """Return the same for a run of which only the settings are known."""
    record = _levels(model, settings)
    return record["factor"], record["order"]


def _level(model: str, scene: Scene, which: str) -> Scene | None:
    settings = scene.data["solver"].get(model, {})
    changed = {
        f"solver.{model}.{key}": float(f"{settings[key] * factor:.12g}")  # 1e-11 by any path: one cached run
        for key, factor in _levels(model, settings)[which].items()
        if isinstance(settings.get(key), float)
    }
    return scene.variant(changed) if changed else None


def _levels(model: str, settings: Mapping[str, Any]) -> dict[str, Any]:
    """Return how a model is refined: as recorded, else by the names of an installed model's settings."""
    if (record := _record(model, str(settings.get("formulation", "auto")))) is not None:
        return record
    levels: dict[str, Any] = _file()["installed"]["step" if "step" in settings else "tolerance"]
    return levels


def _formulation(model: str, scene: Scene) -> str:
    return str(scene.data["solver"].get(model, {}).get("formulation", "auto"))


def _record(model: str, formulation: str) -> dict[str, Any] | None:
    """Return the record of a built-in model; None for another."""
    if model not in OWN:
        return None
    record: dict[str, Any] = _file()[model]
    return record.get("formulation", {}).get(formulation, record)  # type: ignore[no-any-return]


@cache
def _file() -> dict[str, Any]:
    return tomllib.loads(files("comparison.accuracy").joinpath("accuracy.toml").read_text("utf-8"))
