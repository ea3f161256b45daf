"""Measured error bounds and costs of the settings on the shipped scenes (``measured.toml``).

A scene uses those of the shipped scene with the same physics; any other those of the usual scene with the
same joints, with a caution, since the amplification of errors depends on the scene.
"""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from functools import cache
from importlib.resources import files
from math import inf, isclose, isfinite, log, nan
from typing import Any, NamedTuple

from comparison.models import forces, joints_with_clearance, key_of, model_of
from comparison.scene import Scene, digest, load_scene
from comparison.scene.keys import scene_keys
from comparison.scene.overrides import flat

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
"""Joints with clearance -> scene whose numbers are used for unmeasured scenes."""
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
    equal = next((shipped for shipped, record in _file().items() if record["physics"] == own), None)
    record = _file()[equal or USUAL[joints]]
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
        scene=equal or USUAL[joints],
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


def _far(scene: Scene, other: Scene) -> tuple[tuple[str, float], ...]:
    """Return the keys that differ by more than `FAR` from another scene, and by how many times."""
    positive = {
        key.name for key in scene_keys() if key.bounds.startswith(">") and key.name.startswith(_PHYSICS)
    }
    there, keys = flat(other.data), []
    for name, value in flat(scene.data).items():
        both = name.rpartition(".")[0]  # of one partner of a contact
        before = there.get(name, there.get(both))
        if name == "contact.law":
            keys += [(name, nan)] if value != before else []
        elif positive & {name, both} or name == "drive.speed_rpm":
            times = abs(value / before) if value and before else 1.0
            keys += [] if 1.0 / FAR <= times <= FAR else [(name, times)]
    return tuple(keys)


@cache
def _file() -> Mapping[str, Any]:
    return tomllib.loads(files("comparison.accuracy").joinpath("measured.toml").read_text("utf-8"))
