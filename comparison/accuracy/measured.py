"""What was measured of the shipped scenes: the error that a setting promises there, and what it costs.

The numbers are data (``measured.toml``). A scene takes those of the shipped one with the same physics; any
other takes those of the usual scene with the same joints, with a caution: scenes magnify errors by factors of
their own.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from math import inf, isclose, log, nan
from typing import Any

from comparison.scene import Scene, digest
from comparison.scene.formulation import forces, loose

USUAL = {
    (): "ideal",
    ("slider",): "150rpm-0.2mm",
    ("crank_pin",): "crank-pin",
    ("crank_pin", "slider"): "both-clearances",
}
"""Of the joints with clearance: whose numbers stand in for those of a scene that nobody has measured."""
_PHYSICS = ("mechanism", "initial", "joints", "clearance", "contact", "friction", "environment")
_METHODS = {"reference": ("dop853",), "exudyn": ("auto", "generalized-alpha", "dopri5")}
"""What was measured; of Exudyn's, "auto" is another one where forces are asked for."""


@dataclass(frozen=True)
class Row:
    """One setting.

    Attributes
    ----------
    setting
        A tolerance, or a step in s.
    measured
        The largest error of slider_x over some starts, m; nan where it has no result.
    error
        What is promised of it, m; infinite where it has no result.
    seconds
        Processor time of a turn, or of a step, s; nan where it is not known.
    failed
        Why it has no result.
    """

    setting: float
    measured: float = nan
    error: float = inf
    seconds: float = nan
    failed: str = ""


@dataclass(frozen=True)
class Front:
    """The settings of one formulation on one shipped scene, coarsest first.

    Attributes
    ----------
    scene
        Where they were measured.
    turns
        Over how many first turns of the crank errors were measured: one, or all that the scene has.
    unit
        Of what the rows say the processor time: ``"turn"`` or ``"step"``.
    start
        Processor time of a run before its first step, s.
    rows
        The settings.
    cautions
        Why the numbers may not hold for the scene that asks; empty where they do.
    """

    scene: str
    turns: float
    unit: str
    start: float
    rows: tuple[Row, ...]
    cautions: tuple[str, ...] = ()

    @property
    def best(self) -> float:
        """The smallest error that is promised, m."""
        return min(row.error for row in self.rows)

    @property
    def span(self) -> str:
        """What the errors are of, in words."""
        return "the first cycle" if self.turns == 1 else f"the first {self.turns:g} turns"

    def error(self, setting: float) -> float:
        """Return what is promised at a setting, m; nan where none on record is as coarse."""
        # Settings come as 1e-10 or 1e-9 * 0.1.
        coarser = [row.error for row in self.rows if row.setting >= setting * (1 - 1e-9)]
        return min(coarser, default=nan)

    def failed(self, setting: float) -> str:
        """Return why there is no result at just this setting, or nothing."""
        return next((row.failed for row in self.rows if isclose(row.setting, setting)), "")

    def cheapest(self, wanted: float) -> float | None:
        """Return the setting that promises an error, m, at the least cost; None where none does."""
        good = [row for row in self.rows if row.error <= wanted]
        return min(good, key=self._cost).setting if good else None

    def seconds(self, setting: float, scene: Scene) -> float:
        """Estimate a scene's processor time, s: its turns or steps at the rate of the nearest setting."""
        count = scene.duration / (setting if self.unit == "step" else scene.period)
        return self.start + self._nearest(setting).seconds * count

    def _cost(self, row: Row) -> float:
        return row.seconds / row.setting if self.unit == "step" else row.seconds

    def _nearest(self, setting: float) -> Row:
        return min(self.rows, key=lambda row: abs(log(row.setting / setting)))


def front(scene: Scene, model: str) -> Front | None:
    """Return what was measured of the formulation that a scene names; None where nobody has.

    Parameters
    ----------
    scene
        Its physics choose the shipped scene, its solver the formulation; cycles, output and texts do not
        count.
    model
        ``"reference"`` or ``"exudyn"``; of others nothing is known.
    """
    mark = physics(scene)
    equal = next((name for name, found in _file().items() if found["physics"] == mark), None)
    free = loose(scene.data)
    found = _file()[equal or USUAL[free]]
    table = found.get(model, {}).get(formulation(scene, model))
    if table is None:
        return None
    cautions = []
    if equal is None:
        cautions.append(f"measured on {USUAL[free]}; this scene may magnify errors: check with one finer run")
    method = scene.data["solver"][model]["method"]
    implicit = model == "exudyn" and formulation(scene, model) != "tree" and forces(scene.data)
    if method not in _METHODS[model] or implicit:
        cautions.append("measured with another method: check with one finer run")
    if free == ("crank_pin",):
        cautions.append("x of an ideal slider is right at any setting: for y choose by a name")
    return Front(
        scene=equal or USUAL[free],
        turns=found["turns"],
        unit=table["unit"],
        start=table.get("start", nan),
        rows=tuple(Row(**row) for row in table["rows"]),
        cautions=tuple(cautions),
    )


def formulation(scene: Scene, model: str) -> str:
    """Return the formulation's name on record: "auto" has become that of Exudyn by now."""
    named = str(scene.data["solver"].get(model, {}).get("formulation", "auto"))
    return "minimal" if model == "reference" and named == "auto" else named


def physics(scene: Scene) -> str:
    """Hash of what errors depend on beside the setting: not cycles, output, solver, texts."""
    sections: dict[str, object] = {name: scene.data[name] for name in _PHYSICS}
    return digest(sections | {"speed_rpm": scene.data["drive"]["speed_rpm"]})


@cache
def _file() -> Mapping[str, Any]:
    return tomllib.loads(files("comparison.accuracy").joinpath("measured.toml").read_text("utf-8"))
