"""Measured error bounds and costs of the settings on the shipped scenes.

The numbers are data (``measured.toml``). A scene uses those of the shipped scene with the same physics; any
other uses those of the standard scene with the same joints, with a caution, since the amplification of errors
depends on the scene.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from math import inf, isclose, log, nan
from typing import Any

from comparison.models import forces, joints_with_clearance
from comparison.scene import Scene, digest

USUAL = {
    (): "ideal",
    ("slider",): "150rpm-0.2mm",
    ("crank_pin",): "crank-pin",
    ("crank_pin", "slider"): "both-clearances",
}
"""Joints with clearance -> scene whose numbers are used for unmeasured scenes."""
_PHYSICS = ("mechanism", "initial", "joints", "clearance", "contact", "friction", "environment")
_METHODS = {"reference": ("dop853",), "exudyn": ("auto", "generalized-alpha", "dopri5")}
"""Measured formulations; Exudyn's "auto" is another one where forces are requested."""


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
        Error bound, m; infinite without a result.
    seconds
        Processor time per cycle or per step, s; nan if unknown.
    failed
        Reason for a missing result.
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
    cycles
        Number of first crank cycles over which errors were measured: one, or all of the scene.
    unit
        Unit of the processor time of the rows: ``"cycle"`` or ``"step"``.
    start
        Processor time of a run before its first step, s.
    rows
        The settings.
    applies
        Whether they were measured on the requested scene itself, by its method.
    cautions
        Reasons why the numbers may not hold for the requested scene, or what they do not tell.
    """

    scene: str
    cycles: float
    unit: str
    start: float
    rows: tuple[Row, ...]
    applies: bool = True
    cautions: tuple[str, ...] = ()

    @property
    def best(self) -> float:
        """The smallest error bound, m."""
        return min(row.error for row in self.rows)

    @property
    def span(self) -> str:
        """Time span of the errors, in words."""
        return "the first cycle" if self.cycles == 1 else f"the first {self.cycles:g} cycles"

    def error(self, setting: float) -> float:
        """Return the error bound of a setting, m; nan if no recorded setting is as coarse."""
        # Settings come as 1e-10 or 1e-9 * 0.1.
        coarser = [row.error for row in self.rows if row.setting >= setting * (1 - 1e-9)]
        return min(coarser, default=nan)

    def failed(self, setting: float) -> str:
        """Return the reason for a missing result at exactly this setting, or an empty string."""
        return next((row.failed for row in self.rows if isclose(row.setting, setting)), "")

    def cheapest(self, wanted: float) -> float | None:
        """Return the cheapest setting with an error bound, m; None if there is none."""
        good = [row for row in self.rows if row.error <= wanted]
        return min(good, key=self._cost).setting if good else None

    def seconds(self, setting: float, scene: Scene) -> float:
        """Estimate a scene's processor time, s: its cycles or steps at the rate of the nearest setting."""
        count = scene.duration / (setting if self.unit == "step" else scene.period)
        return self.start + self._nearest(setting).seconds * count

    def _cost(self, row: Row) -> float:
        return row.seconds / row.setting if self.unit == "step" else row.seconds

    def _nearest(self, setting: float) -> Row:
        return min(self.rows, key=lambda row: abs(log(row.setting / setting)))


def front(scene: Scene, model: str) -> Front | None:
    """Return the measurements of the formulation that a scene names; None if there are none.

    Parameters
    ----------
    scene
        Its physics select the shipped scene, its solver the formulation; cycles, output and texts are
        ignored.
    model
        ``"reference"`` or ``"exudyn"``; others are unmeasured.
    """
    mark = physics(scene)
    equal = next((name for name, found in _file().items() if found["physics"] == mark), None)
    free = joints_with_clearance(scene.data)
    found = _file()[equal or USUAL[free]]
    table = found.get(model, {}).get(formulation(scene, model))
    if table is None:
        return None
    cautions = []
    if equal is None:
        cautions.append(f"measured on {USUAL[free]}; this scene may magnify errors: estimate them by --check")
    method = scene.data["solver"][model]["method"]
    implicit = model == "exudyn" and formulation(scene, model) != "tree" and forces(scene.data)
    if method not in _METHODS[model] or implicit:
        cautions.append("measured with another method: estimate errors by --check")
    applies = not cautions
    if free == ("crank_pin",):
        cautions.append("x of an ideal slider is right at any setting: for y choose by a name")
    return Front(
        scene=equal or USUAL[free],
        cycles=found["cycles"],
        unit=table["unit"],
        start=table.get("start", nan),
        rows=tuple(Row(**row) for row in table["rows"]),
        applies=applies,
        cautions=tuple(cautions),
    )


def formulation(scene: Scene, model: str) -> str:
    """Return the recorded name of the formulation ("auto" is already resolved)."""
    named = str(scene.data["solver"].get(model, {}).get("formulation", "auto"))
    return "minimal" if model == "reference" and named == "auto" else named


def physics(scene: Scene) -> str:
    """Return the hash of what errors depend on besides the setting: not cycles, output, solver, texts."""
    sections: dict[str, object] = {name: scene.data[name] for name in _PHYSICS}
    return digest(sections | {"speed_rpm": scene.data["drive"]["speed_rpm"]})


@cache
def _file() -> Mapping[str, Any]:
    return tomllib.loads(files("comparison.accuracy").joinpath("measured.toml").read_text("utf-8"))
