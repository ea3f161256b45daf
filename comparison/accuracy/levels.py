"""Settings of a scene's runs: measured errors and costs, names and refinement, tiers of a verdict, the plan.

The numbers are data: ``measured.toml`` has error bounds and costs on shipped scenes, ``accuracy.toml`` names
and refinement, ``thresholds.toml`` what a verdict requires. A scene uses the measurements of the shipped
scene with the same physics; any other those of the usual scene with the same joints, with a caution, since
the amplification of errors depends on the scene.
"""

import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import cache
from importlib.resources import files
from math import inf, isclose, isfinite, log, nan
from typing import Any, NamedTuple

import numpy as np

from comparison.models import (
    OWN,
    declared,
    forces,
    joints_with_clearance,
    key_of,
    model_of,
    smallest_in_exudyn,
)
from comparison.scene import Scene, digest, load_scene
from comparison.scene.keys import flat, scene_keys
from comparison.tables.channels import Array, BoolArray

# ---- measured errors and costs

_TOLERANCES = (1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12)
SETTINGS = {
    "minimal": _TOLERANCES,
    "multiplier": _TOLERANCES,
    "tree": _TOLERANCES[:-1],
    "full": (8e-6, 4e-6, 2e-6, 1e-6, 5e-7, 2.5e-7),
}
"""Formulation -> its measured tolerances, or steps in s, coarsest first; of each model the smallest first."""
USUAL = {
    (): "ideal",
    ("slider",): "150rpm-0.2mm",
    ("crank_pin",): "crank-pin",
    ("crank_pin", "slider"): "both-clearances",
}
"""Joints with clearance -> scene whose numbers are used for unmeasured scenes, ..."""
OTHER_FORCES = ("adams-impact", "workpiece")
"""... or one of these, where contact law and load are like its own."""
_PHYSICS = ("mechanism", "initial", "joints", "clearance", "contact", "friction", "load", "environment")
FAR = 10.0
"""By so many times a length, mass, stiffness, speed ... differs from that of a scene that tells nothing."""
_METHODS = {"reference": ("dop853",), "exudyn": ("auto", "generalized-alpha", "dopri5")}
"""Measured methods; Exudyn's "auto" is another one where forces are requested."""


class Caution(StrEnum):
    """Why a measured number may not hold for a scene, or what it does not tell."""

    OTHER_SCENE = "measured on another scene"
    OTHER_METHOD = "measured with another method"
    IDEAL_SLIDER = "slider_x does not depend on the setting"


class Row(NamedTuple):
    """One setting, a tolerance or a step in s, with errors in m; ``failed``: why it has no result."""

    setting: float
    measured: float = nan  # the largest error of slider_x over some starts
    error: float = inf  # error bound
    seconds: float = nan  # processor time per cycle or per step
    failed: str = ""


@dataclass(frozen=True)
class Front:
    """The settings of one formulation on one shipped scene, the coarsest first."""

    scene: str
    cycles: float  # over which errors were measured: one, or all of the scene
    unit: str  # of the processor time of the rows: "cycle" or "step"
    start: float  # processor time of a run before its first step, s
    rows: tuple[Row, ...]
    cautions: tuple[Caution, ...] = ()  # concerning the requested scene

    @property
    def applies(self) -> bool:
        """Whether they were measured on the requested scene itself, by its method."""
        return not {Caution.OTHER_SCENE, Caution.OTHER_METHOD} & set(self.cautions)

    @property
    def best(self) -> float:
        """The smallest error bound, m."""
        return min(row.error for row in self.rows)

    def cheapest(self, wanted: float) -> float | None:
        """Return the cheapest setting with an error bound, m; None if there is none."""
        good = [row for row in self.rows if row.error <= wanted]
        by_cost = sorted(good, key=lambda row: row.seconds / (row.setting if self.unit == "step" else 1.0))
        return by_cost[0].setting if by_cost else None


@dataclass(frozen=True)
class Expected:
    """Expected error and cost of a run; nan where not recorded."""

    error: float = nan  # bound of slider_x over the first cycles, m
    cycles: float = 1.0
    seconds: float = nan  # processor time of the whole run
    measured_on: str = ""  # shipped scene
    failed: str = ""  # why the setting had no result there
    cautions: tuple[Caution, ...] = ()
    applies: bool = True  # not those of another scene or method
    far: tuple[tuple[str, float], ...] = ()  # keys that differ by more than FAR, and by how many times

    @property
    def span(self) -> str:
        """Time span of the error."""
        return "the first cycle" if self.cycles == 1 else f"the first {self.cycles:g} cycles"


def front(scene: Scene, model: str) -> Front | None:
    """Return the measurements of the formulation that a scene names; None if there are none."""
    own, joints, name = physics(scene), joints_with_clearance(scene.data), formulation(scene, model)
    equal = next(
        (shipped for shipped, record in _read("measured.toml").items() if record["physics"] == own), None
    )
    used = equal or _usual(scene)
    record = _read("measured.toml")[used]
    table = record.get(model, {}).get(name)
    if table is None:
        return None
    implicit = model == "exudyn" and name != "tree" and forces(scene.data)
    cautions = {
        Caution.OTHER_SCENE: equal is None,
        Caution.OTHER_METHOD: scene.data["solver"][model]["method"] not in _METHODS[model] or implicit,
        Caution.IDEAL_SLIDER: joints == ("crank_pin",),
    }
    return Front(
        scene=used,
        cycles=record["cycles"],
        unit=table["unit"],
        start=table.get("start", nan),
        rows=tuple(Row(**row) for row in table["rows"]),
        cautions=tuple(caution for caution, holds in cautions.items() if holds),
    )


def expected(scene: Scene, model: str) -> Expected:
    """Return the recorded error and cost of a scene's run at its settings."""
    known = front(scene, model)
    if known is None:
        return Expected()
    setting = scene.data["solver"][model][key_of(formulation(scene, model)).rpartition(".")[2]]
    # Settings come as 1e-10 or 1e-9 * 0.1; a coarser one's bound holds for a finer one.
    error = min((row.error for row in known.rows if row.setting >= setting * (1 - 1e-9)), default=nan)
    failed = next((row.failed for row in known.rows if isclose(row.setting, setting)), "")
    nearest = min(known.rows, key=lambda row: abs(log(row.setting / setting)))
    count = scene.duration / (setting if known.unit == "step" else scene.period)
    return Expected(
        error=nan if failed or not isfinite(error) else error,
        cycles=known.cycles,
        seconds=known.start + nearest.seconds * count,
        measured_on=known.scene,
        failed=failed,
        cautions=known.cautions,
        applies=known.applies,
        far=_far(scene, load_scene(known.scene)) if Caution.OTHER_SCENE in known.cautions else (),
    )


def is_measured(scene: Scene, model: str, wanted: float) -> bool:
    """Return whether a setting with such an error bound, m, was measured on this very scene."""
    known = front(scene, model)
    return known is not None and known.applies and known.cheapest(wanted) is not None


def measured_record(scene: Scene, model: str, accuracy: str | float) -> dict[str, object]:
    """Return what is recorded of an accuracy beside a table: the measured error bound of its settings."""
    known = expected(scene, model)
    return {
        "wanted": accuracy,
        "from": f"measured on {known.measured_on}" if known.measured_on else "nothing recorded",
        "bound_m": nan if known.far else known.error,
        "over": known.span,
        "cautions": list(known.cautions),
    }


def at(scene: Scene, formulation: str, setting: float) -> Scene:
    """Return a scene as a formulation runs it at a setting."""
    named = scene.variant({f"solver.{model_of(formulation)}.formulation": formulation})
    return named.variant({key_of(formulation): setting})


def formulation(scene: Scene, model: str) -> str:
    """Return the recorded name of the formulation ("auto" of Exudyn is already resolved)."""
    named = str(scene.data["solver"].get(model, {}).get("formulation", "auto"))
    return "minimal" if model == "reference" and named == "auto" else named


def physics(scene: Scene) -> str:
    """Return the hash of what errors depend on besides the setting: not cycles, output, solver, texts."""
    sections: dict[str, object] = {name: scene.data[name] for name in _PHYSICS}
    return digest(sections | {"speed_rpm": scene.data["drive"]["speed_rpm"]})


def _usual(scene: Scene) -> str:
    """Return the shipped scene whose numbers are used for one that was not measured."""
    joints, own = joints_with_clearance(scene.data), _law_and_load(scene)
    alike = (name for name in OTHER_FORCES if _law_and_load(load_scene(name)) == own)
    return next(alike, USUAL[joints]) if joints == ("slider",) else USUAL[joints]


def _law_and_load(scene: Scene) -> tuple[str, bool, bool]:
    """Return a scene's contact law, and whether it has a load by a power law or by a table."""
    load = scene.data["load"]
    return scene.data["contact"]["law"], bool(load["force"]), bool(load["table"])


def _far(scene: Scene, other: Scene) -> tuple[tuple[str, float], ...]:
    """Return the keys that differ by more than `FAR` from another scene, and by how many times."""
    positive = {
        key.name for key in scene_keys() if key.bounds.startswith(">") and key.name.startswith(_PHYSICS)
    }
    there, keys = flat(other.data), []
    if _law_and_load(scene)[1:] != _law_and_load(other)[1:]:
        keys.append(("load", nan))
    for name, value in flat(scene.data).items():
        both = name.rpartition(".")[0]  # of one partner of a contact
        before = there.get(name, there.get(both))
        if name == "contact.law" or (name == "contact.stiffness" and None in (value, before)):
            keys += [(name, nan)] if value != before else []
        elif positive & {name, both} or name == "drive.speed_rpm":
            times = abs(value / before) if value and before else 1.0
            keys += [] if 1.0 / FAR <= times <= FAR else [(name, times)]
    return tuple(keys)


# ---- settings by name or by wanted error, and tiers

NAMES = ("draft", "standard", "strict")
TIERS = ("standard", "tight")


class AccuracyError(ValueError):
    """Accuracy without a recorded setting; the message is one line."""


def metres(accuracy: str | float) -> float:
    """Return an accuracy that is no name as a number of metres; `AccuracyError` if it is not positive."""
    try:
        number = 0.0 if isinstance(accuracy, bool) else float(accuracy)
    except (TypeError, ValueError):
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

    def predictable(self, u: Array, scale: float) -> BoolArray:
        """Return the samples whose uncertainty is small enough against their channel's scale to be judged."""
        return np.asarray(u <= self.alpha * scale)


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


# ---- what a run integrates, leaves out, and costs

_BODIES = ("crank", "rod 2", "rocker", "rod 4", "slider")
_FREE = {"crank_pin": _BODIES[1:3], "slider": _BODIES[3:]}
"""Joint with clearance -> bodies whose motion is then not prescribed by the crank."""


@dataclass(frozen=True)
class Plan:
    """Plan of one model's run of a scene; ``formulation`` as the model records it with its result."""

    model: str
    formulation: str
    integrated: tuple[str, ...]  # bodies
    prescribed: tuple[str, ...]  # bodies whose motion follows from these and from the crank
    coordinates: int
    constraints: int
    contacts: tuple[str, ...]  # possible ones
    load: str  # empty without one
    left_out: tuple[tuple[str, str], ...]  # not modelled, or not computed, and why
    expected: Expected
    instead: tuple[tuple[str, str, float], ...]  # other formulations: setting, words, ratio of their time


def plan(scene: Scene, model: str) -> Plan:
    """Return the plan of a built-in model for a scene; `ValueError` for another package's."""
    if model not in OWN:
        raise ValueError(f"model {model!r}: the plan of another package's model is not known")
    joints, ideal_slider = joints_with_clearance(scene.data), scene.data["joints"]["slider"] == "ideal"
    pin, rows = "crank_pin" in joints, 15 if ideal_slider else 13
    integrated = tuple(body for joint in joints for body in _FREE[joint])
    coordinates, constraints, instead, words = len(integrated), 0, "", ""
    named = scene.data["solver"][model]["formulation"]
    if model == "reference" and named == "multiplier":
        name = f"multiplier (15 coordinates, {rows} multipliers)"
        integrated, coordinates, constraints = _BODIES, 15, rows
    elif model == "reference":
        listed = f"{', '.join(integrated[:-1])} and {integrated[-1]}" if joints else ""
        name = f"minimal: {listed} ({coordinates} coordinates)" if joints else "closed form"
        if not pin:  # which the multipliers leave ideal
            instead, words = "multiplier", f"the paper's 15 coordinates and {rows} multipliers"
    elif named == "tree":
        name, integrated = f"{'rocker, rods' if pin else 'rod 4'} and slider tree", _BODIES[1 if pin else 3 :]
        # An ideal slider does not rotate: a point mass at the end of rod 4, constrained by the guide's force.
        coordinates = len(integrated) - ideal_slider
        instead, words = "full", "all five bodies with their joints, in steps that are short in contacts"
    else:
        name, integrated, coordinates = "five bodies", _BODIES, 15
        # Two rows for each of the pins O, A, B, H, C and F, the drive, and an ideal slider's two.
        constraints = rows - 2 * pin
        if joints and not forces(scene.data):
            instead, words = "tree", "only the free bodies, with error control"
    known, key = expected(scene, model), f"solver.{model}.formulation"
    # At the scene's settings of that formulation, which are its own.
    seconds = expected(scene.variant({key: instead}), model).seconds if instead else 0.0
    return Plan(
        model=model,
        formulation=name,
        integrated=integrated,
        prescribed=tuple(body for body in _BODIES if body not in integrated),
        coordinates=coordinates,
        constraints=constraints,
        contacts=_contacts(scene, joints),
        load=_load(scene.data["load"]),
        left_out=_left_out(scene, joints),
        expected=replace(known, error=nan) if known.far else known,
        instead=((f"{key} = {instead!r}", words, seconds / known.seconds),) if instead else (),
    )


def _contacts(scene: Scene, joints: tuple[str, ...]) -> tuple[str, ...]:
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
    return tuple(text for joint, text in possible.items() if joint in joints)


def _load(load: Mapping[str, Any]) -> str:
    below = f"below y = {load['surface']:g} m"
    if load["table"]:
        return f"{below}: a table up to {max(force for _, force in load['table']):g} N"
    if load["force"]:
        at = f"at a depth of {load['depth']:g} m"
        return f"{below}: {load['force']:g} N {at}, exponent {load['exponent']:g}"
    return ""


def _left_out(scene: Scene, joints: tuple[str, ...]) -> tuple[tuple[str, str], ...]:
    contacts = {"crank_pin": "contact at the crank pin", "slider": "contact of the slider"}
    ideal = [(text, f"joints.{joint} is ideal") for joint, text in contacts.items() if joint not in joints]
    at_contacts = {"slider": "gaps and forces of the corners", "crank_pin": "path of the journal"}
    groups = {
        "accelerations": "accelerations",
        "corners": " and ".join(text for joint, text in at_contacts.items() if joint in joints),
        "joints": "reactions and the crank's torque",
        "energy": "energies",
    }
    requested = scene.data["output"]["groups"]
    omitted = [text for group, text in groups.items() if text and group not in requested]
    return *ideal, *((text, "not requested (output.groups)") for text in omitted)
