"""From a wanted accuracy to solver settings, and from a setting to the next finer one.

The numbers are data (``accuracy.toml``): measured errors of slider_x over the first cycle.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from functools import cache
from importlib.resources import files
from typing import Any

from comparison.engines import OWN
from comparison.scene import Scene

NAMES = ("draft", "standard", "strict")


class AccuracyError(ValueError):
    """An accuracy that no setting on record gives; the message is one line."""


def solver_values(model: str, accuracy: str | float, formulation: str = "auto") -> dict[str, object]:
    """Solver settings of a model for a wanted accuracy.

    Parameters
    ----------
    model
        ``"reference"`` or ``"exudyn"``.
    accuracy
        ``"draft"``, ``"standard"``, ``"strict"``, or the wanted error of slider_x in metres over the
        first cycle, also as text (``"1e-8"``). Of the settings that promise it, the cheapest is taken.
    formulation
        The one that is to integrate: Exudyn's ``"tree"`` is set by its tolerance, the others by their step.

    Returns
    -------
    dict
        Dotted scene keys and their values, for `Scene.with_values`.

    Raises
    ------
    AccuracyError
        If it is neither a name nor a positive number, or smaller than the best on record, or the model is
        not one of ours: nobody has measured it.
    """
    record = _record(model, formulation)
    if record is None:
        raise AccuracyError(
            f"accuracy {accuracy!r}: that of the model {model!r} is not on record; "
            f"set its solver.{model} in the scene"
        )
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


def expected_error(model: str, scene: Scene) -> float:
    """Return the promised error of slider_x over the first cycle of 150rpm-0.2mm at a scene's setting, m.

    nan where no setting on record is as coarse, or the model is not one of ours.
    """
    settings = scene.data["solver"].get(model, {})
    record = _record(model, settings.get("formulation", "auto"))
    if record is None:
        return float("nan")
    setting = settings[record["key"].rpartition(".")[2]]
    # Settings come as 1e-10 or 1e-9 * 0.1.
    coarser_ones = [row["error"] for row in record["table"] if row["setting"] >= setting * (1 - 1e-9)]
    return float(min(coarser_ones, default=float("nan")))


def finer(model: str, scene: Scene) -> Scene | None:
    """Return the scene with the model's settings one level finer: tolerance / 10, step / 2.

    In Exudyn's fixed steps both: Newton's iteration stops with an error of its own that halving the step
    alone leaves in both runs alike, where the comparison would take it for a difference of models. An
    installed model is refined in whichever of ``step`` and ``tolerance`` its scene gives as a real number;
    None where it gives neither.
    """
    return _level(model, scene, "finer")


def coarser(model: str, scene: Scene) -> Scene | None:
    """Return the scene with the model's settings one level coarser: tolerance x 10, step x 2; or None."""
    return _level(model, scene, "coarser")


def refinement(model: str, scene: Scene) -> tuple[float, float]:
    """Return the factor between two levels and the order at which the error should follow it."""
    record = _levels(model, scene.data["solver"].get(model, {}))
    return record["factor"], record["order"]


def _level(model: str, scene: Scene, which: str) -> Scene | None:
    settings = scene.data["solver"].get(model, {})
    changed = {
        f"solver.{model}.{key}": float(f"{settings[key] * factor:.12g}")  # 1e-11 by any way: one kept run
        for key, factor in _levels(model, settings)[which].items()
        if isinstance(settings.get(key), float)
    }
    return scene.with_values(changed) if changed else None


def _levels(model: str, settings: Mapping[str, Any]) -> dict[str, Any]:
    """Find how a model is refined: as on record, else by the names of an installed model's settings."""
    if (record := _record(model, settings.get("formulation", "auto"))) is not None:
        return record
    levels: dict[str, Any] = _file()["installed"]["step" if "step" in settings else "tolerance"]
    return levels


def _record(model: str, formulation: str) -> dict[str, Any] | None:
    """Find what is on record of one of our own models; None of another."""
    if model not in OWN:
        return None
    record: dict[str, Any] = _file()[model]
    return record.get("formulation", {}).get(formulation, record)  # type: ignore[no-any-return]


@cache
def _file() -> dict[str, Any]:
    return tomllib.loads(files("comparison").joinpath("accuracy.toml").read_text("utf-8"))
