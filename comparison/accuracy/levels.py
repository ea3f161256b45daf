"""Settings of a scene's runs: names and their measured errors, refinement, tiers of a verdict, the plan.

The numbers are data: ``measured.toml`` has error and cost of the named settings on the shipped scenes,
``accuracy.toml`` names and refinement, ``thresholds.toml`` what a verdict requires.
"""

import tomllib
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cache
from importlib.resources import files
from math import degrees, inf, log, nan, remainder
from typing import Any

import numpy as np

from comparison.models import OURS, declared_formulations, declared_settings, formulations, plan_of, smallest
from comparison.scene import Scene, digest, load_scene
from comparison.tables.channels import Array, BoolArray, Extent

NAMES = ("draft", "standard", "strict")
"""Accuracies with a name, from coarse to fine."""
TIERS = ("standard", "tight")
MOST_LIKE = {
    (): "ideal",
    ("slider",): "150rpm-0.2mm",
    ("crank_pin",): "crank-pin",
    ("crank_pin", "slider"): "both-clearances",
}
"""Joints with clearance -> shipped scene whose numbers stand for a scene that was not measured."""
START = {"reference": 0.007, "exudyn": 0.02}
"""Processor time of a run before its first step, s."""
_METHODS = ("auto", "dop853", "dopri5", "generalized-alpha")
"""Integrators of the runs in ``measured.toml``."""
_PHYSICS = ("mechanism", "initial", "joints", "clearance", "contact", "friction", "load", "environment")


class AccuracyError(ValueError):
    """Accuracy without a recorded setting; the message is one line."""


# ---- measured errors and costs of the named settings


@dataclass(frozen=True)
class Forecast:
    """Expected error and cost of a run; nan where not recorded."""

    error: float = nan  # bound of slider_x over the first cycles, m
    cycles: float = 1.0  # over which it was measured: one, or all of the shipped scene
    seconds: float = nan  # processor time of the whole run
    scene: str = ""  # shipped scene on which they were measured
    own: bool = False  # True for this very scene by its method: elsewhere errors may be larger


def forecast(scene: Scene, model: str) -> Forecast:
    """Return error and cost of a scene's run at its settings, as measured on the shipped scene most like it.

    Of the settings on record, error is that of the next coarser one, cost that of the nearest.
    """
    if model not in OURS or scene.is_linkage:
        return Forecast()
    same, name = _same_physics(scene), formulation(scene, model)
    source = same or MOST_LIKE[scene.loose]
    row = _read("measured.toml")[source].get(name)
    if row is None:
        return Forecast()
    settings = scene.data["solver"][model]
    declaration = declared_formulations(model)[name]
    grid, value = _read("accuracy.toml")["names"][name].values(), settings[declaration["setting"]]
    # The margin is for a setting of 1e-9 * 0.1.
    error = min((e for s, e in zip(grid, row["error"], strict=True) if s >= value * (1 - 1e-9)), default=nan)
    nearest, seconds = min(zip(grid, row["seconds"], strict=True), key=lambda each: abs(log(each[0] / value)))
    step_ratio = nearest / value if declaration["setting"] == "step" else 1.0
    implicit = name == "full" and {"joints", "energy"} & set(scene.data["output"]["groups"])
    return Forecast(
        error=error,
        cycles=min(1.0, _shipped(source).data["drive"]["cycles"]),
        seconds=START[model] + seconds * step_ratio * scene.duration / scene.period,
        scene=source,
        own=bool(same) and settings["method"] in _METHODS and not implicit,
    )


def measured_record(scene: Scene, model: str, accuracy: str) -> dict[str, object]:
    """Return the record of a named accuracy beside a table: the measured error of its setting."""
    estimate = forecast(scene, model)
    source = f"measured on {estimate.scene}" if estimate.own else "not measured on this scene"
    bound = estimate.error if estimate.own else nan
    return {"wanted": accuracy, "from": source, "bound_m": bound, "over_cycles": estimate.cycles}


def scene_at(scene: Scene, model: str, formulation: str, setting: float) -> Scene:
    """Return a scene as a formulation of a model runs it at a setting."""
    base = scene.variant({f"solver.{model}.formulation": formulation})
    return base.variant({f"solver.{model}.{declared_formulations(model)[formulation]['setting']}": setting})


def formulation(scene: Scene, model: str) -> str:
    """Return the name of the formulation by which a model runs a scene."""
    name = str(scene.data["solver"].get(model, {}).get("formulation", "auto"))
    return smallest(model, scene.data) if name == "auto" else name


def _same_physics(scene: Scene) -> str:
    """Return the measured scene with the same physics, on which errors depend; "" if there is none."""
    physics, records = _physics(scene), _read("measured.toml")
    names = sorted(records, key=lambda name: name != scene.source)
    return next((name for name in names if _physics(_shipped(name)) == physics), "")


@cache
def _shipped(name: str) -> Scene:
    return load_scene(name)


def _physics(scene: Scene) -> str:
    """Return the hash of the keys on which errors depend besides the setting."""
    sections: dict[str, object] = {name: scene.data[name] for name in _PHYSICS}
    return digest(sections | {"speed_rpm": scene.data["drive"]["speed_rpm"]})


# ---- settings by name, levels of refinement, tiers


def metres(accuracy: str | float) -> float:
    """Return an accuracy in metres as a number; `AccuracyError` if it is not a positive number."""
    try:
        number = 0.0 if isinstance(accuracy, bool) else float(accuracy)
    except (TypeError, ValueError):
        number = 0.0
    if not 0 < number < inf:
        raise AccuracyError(
            f"accuracy {accuracy!r} must be {', '.join(NAMES)} or a positive number of metres"
        )
    return number


def check_accuracy(model: str, accuracy: str | float) -> None:
    """Raise `AccuracyError` where the model is not built in, or the accuracy neither a name nor metres."""
    if model not in OURS:
        raise AccuracyError(
            f"accuracy {accuracy!r}: that of the model {model!r} is not recorded; "
            f"set its solver.{model} in the scene"
        )
    if accuracy not in NAMES:
        metres(accuracy)


def solver_values(model: str, accuracy: str, scene: Scene) -> dict[str, object]:
    """Return a built-in model's solver settings for one of `NAMES`, by dotted keys; else `AccuracyError`."""
    check_accuracy(model, accuracy)
    settings = {"formulation": formulation(scene, model)}
    names = _read("accuracy.toml")["names"][_named_formulation(model, settings)]
    return {f"solver.{model}.{setting_key(model, settings)}": names[accuracy]}


def with_declared(scene: Scene, models: Iterable[str]) -> Scene:
    """Return the scene with the settings that installed models declare and the scene does not give."""
    values = {
        f"solver.{model}.{key}": value
        for model in models
        for key, value in declared_settings(model).items()
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
        f"solver.{model}.{key}": float(f"{settings[key] * factor:.12g}")  # equal by any path: one cached run
        for key, factor in _read("accuracy.toml")[setting_key(model, settings)][direction].items()
        if isinstance(settings.get(key), float)
    }
    return scene.variant(values) if values else None


def refinement(model: str, scene: Scene) -> tuple[float, float]:
    """Return the factor between two levels and the order at which the error should follow it."""
    return recorded_refinement(model, scene.data["solver"].get(model, {}))


def recorded_refinement(model: str, settings: Mapping[str, Any]) -> tuple[float, float]:
    """Return factor and order, as `refinement`, from a run's recorded settings."""
    record, key = _read("accuracy.toml"), setting_key(model, settings)
    formulation_order = record["order"].get(settings.get("formulation")) if model in OURS else None
    return record[key]["factor"], formulation_order or record[key]["order"]


def tight(scene: Scene, models: tuple[str, str]) -> Scene | None:
    """Return the scene at the tight tier: the reference at ``strict``, Exudyn's tree with error control.

    Where a scene requires five bodies (no clearance, reactions), these keep its settings. None if a model is
    not built in: the accuracy of another package's model is unmeasured.
    """
    if not set(models) <= set(OURS):
        return None
    values: dict[str, object] = {}
    if "reference" in models:
        values |= solver_values("reference", "strict", scene)
    if "exudyn" in models and smallest("exudyn", scene.data) == "tree":
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

    def largest(self, scale: Extent) -> Extent:
        """Return the largest uncertainty at which a sample of a channel of this scale is predictable."""
        return self.alpha * scale

    def predictable(self, u: Array, scale: Extent) -> BoolArray:
        """Return the samples whose uncertainty is small enough against their channel's scale to be judged."""
        return np.asarray(u <= self.largest(scale))


def thresholds_record() -> dict[str, Any]:
    """Read ``thresholds.toml``."""
    return _read("thresholds.toml")


def thresholds(tier: str = "standard") -> Thresholds:
    """Return the numbers of a tier, ``"standard"`` or ``"tight"``."""
    record = thresholds_record()
    common = {name: number for name, number in record.items() if not isinstance(number, dict)}
    return Thresholds(**common, **record[tier])


def setting_key(model: str, settings: Mapping[str, Any]) -> str:
    """Return the key of a model's settings that controls its error: "tolerance" or "step"."""
    if model in OURS:
        return str(declared_formulations(model)[_named_formulation(model, settings)]["setting"])
    return "step" if "step" in settings else "tolerance"


def _named_formulation(model: str, settings: Mapping[str, Any]) -> str:
    """Return the formulation in a built-in model's settings, its largest where they name none."""
    names = [*declared_formulations(model)]
    return settings["formulation"] if settings.get("formulation") in names else names[-1]


@cache
def _read(name: str) -> dict[str, Any]:
    return tomllib.loads(files("comparison.accuracy").joinpath(name).read_text("utf-8"))


# ---- what a run integrates, leaves out, and costs

_BODIES = ("crank", "rod 2", "rocker", "rod 4", "slider")


@dataclass(frozen=True)
class Plan:
    """Plan of one model's run of a scene; ``formulation`` as the model records it with its result."""

    model: str
    formulation: str
    integrated: tuple[str, ...]  # bodies
    prescribed: tuple[str, ...]  # bodies whose motion follows from these and from the crank
    coordinates: int
    constraints: int
    note: str  # on the equations, empty without one
    contacts: tuple[str, ...]  # those that are possible
    load: str  # empty without one
    left_out: tuple[tuple[str, str], ...]  # not modelled, or not computed, and why
    expected: Forecast | None  # None for a linkage: sixbar validate shows its error
    instead: tuple[tuple[str, str, float], ...]  # other formulations: setting, name, ratio of their time
    start: Mapping[str, Sequence[float]] = field(default_factory=dict)  # of a linkage's bodies: x, y, angle


GUESS_TURN = 60.0  # deg, largest from the start; measured on the four-bar: followed at 54, not at 82


def plan(scene: Scene, model: str) -> Plan:
    """Return a model's plan of a scene; `EngineError` for a model that declares none."""
    record, estimate = plan_of(model, scene.data), forecast(scene, model)
    if scene.is_linkage:
        omissions = [("tight tier", "it is the press's")]
        exception = " besides the drive" if "speed_rpm" in scene.data["drive"] else ""
        note = f"degrees of freedom{exception}: {record['freedom']}"
        start = record.get("start", {})
        for name, guess in scene.data["guess"].items() if start else ():
            turn = abs(remainder(degrees(start[name][2]) - guess["angle_deg"], 360.0))
            if turn > GUESS_TURN:
                why = f"the start is {turn:.0f} deg from it; guess the bodies that this one is pinned to, too"
                omissions.append((f"guess.{name}", why))
        return Plan(
            model,
            record["formulation"],
            tuple(record["bodies"]),
            (),
            record["coordinates"],
            record["constraints"],
            note,
            tuple(record.get("contacts", ())),
            load="",
            left_out=tuple(omissions),
            expected=None,
            instead=(),
            start=start,
        )
    key, alternatives = f"solver.{model}.formulation", []
    for name in formulations(model, scene.data):
        variant = scene.variant({key: name})  # at the scene's settings of that formulation
        with suppress(ValueError):  # it lacks a channel or the method
            if name != formulation(scene, model):
                title = plan_of(model, variant.data)["formulation"]
                ratio = forecast(variant, model).seconds / estimate.seconds
                alternatives.append((f"{key} = {name!r}", title, ratio))
    return Plan(
        model=model,
        formulation=record["formulation"],
        integrated=tuple(record["bodies"]),
        prescribed=tuple(body for body in _BODIES if body not in record["bodies"]),
        coordinates=record["coordinates"],
        constraints=record["constraints"],
        note=record.get("note", ""),
        contacts=_contacts(scene),
        load=_load(scene.data["load"]),
        left_out=_omissions(scene),
        expected=estimate,
        instead=tuple(alternatives),
    )


def _contacts(scene: Scene) -> tuple[str, ...]:
    contact = scene.data["contact"]

    def of_partners(key: str, factor: float) -> str:
        values = contact[key].values() if isinstance(contact[key], dict) else [contact[key]]
        return " on ".join(f"{factor * value:g}" for value in values)

    materials = f"{of_partners('youngs_modulus', 1e-9)} GPa, Poisson's ratio {of_partners('poisson', 1.0)}"
    other = contact["damping_model"] != "lankarani-nikravesh"  # than the paper's
    damping = f", damping of {contact['damping_model']}" if other else ""
    law = f"{contact['law']}{damping}; {materials}"
    if contact["law"] == "adams-impact":
        stiffness = materials if contact["stiffness"] is None else f"k = {contact['stiffness']:g} N/m^n"
        law = (
            f"{contact['law']}; {stiffness}; damping up to {contact['damping']:g} N s/m, from "
            f"{contact['damping_depth']:g} m on"
        )
    possible = {
        "slider": f"four corners of the slider ({law})",
        "crank_pin": "journal and bearing at the crank pin",
    }
    return tuple(text for joint, text in possible.items() if joint in scene.loose)


def _load(load: Mapping[str, Any]) -> str:
    region = f"below y = {load['surface']:g} m"
    if load["table"]:
        return f"{region}: a table up to {max(force for _, force in load['table']):g} N"
    if load["force"]:
        depth = f"at a depth of {load['depth']:g} m"
        return f"{region}: {load['force']:g} N {depth}, exponent {load['exponent']:g}"
    return ""


def _omissions(scene: Scene) -> tuple[tuple[str, str], ...]:
    contacts = {"crank_pin": "contact at the crank pin", "slider": "contact of the slider"}
    ideal_contacts = [
        (text, f"joints.{joint} is ideal") for joint, text in contacts.items() if joint not in scene.loose
    ]
    contact_channels = {"slider": "gaps and forces of the corners", "crank_pin": "path of the journal"}
    groups = {
        "accelerations": "accelerations",
        "corners": " and ".join(text for joint, text in contact_channels.items() if joint in scene.loose),
        "joints": "reactions and the crank's torque",
        "energy": "energies",
    }
    requests = scene.data["output"]["groups"]
    texts = [text for group, text in groups.items() if text and group not in requests]
    return *ideal_contacts, *((text, "not requested (output.groups)") for text in texts)
