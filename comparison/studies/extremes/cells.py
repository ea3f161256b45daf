"""What is pushed to its extremes: one number at a time, and all at once in a Latin hypercube."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from importlib.resources import files
from typing import Any

from scipy.stats import qmc

from comparison.scene import Scene, load_scene
from comparison.studies.extremes.formulations import FULL, INDEX2, METHODS, MINIMAL, MULTIPLIERS, TREE
from comparison.studies.extremes.runs import BASE
from comparison.studies.shared.formulations import Method

LITERAL_LAW = "paper-switching"
LAWS = ("hertz-corners", "foundation", LITERAL_LAW)
SEED = 1  # of the Latin hypercube
CYCLES, SAMPLES = 1.0, 250
"""An error bound is one over the first cycle; samples of a cycle."""
CYCLES_AXIS, HYPERCUBE = "cycles", "hypercube"
"""Of the first one's cells only the first cycle is held against more accurate runs; they have more time."""
BASE_LABEL, NEWTON = "as shipped", "Newton's tolerance"
_DATA: dict[str, list[dict[str, Any]]] = tomllib.loads(
    files("comparison.studies.extremes").joinpath("axes.toml").read_text("utf-8")
)
_PARTS, _RANGES = _DATA["part"], _DATA["range"]
AXES = tuple(dict.fromkeys(part["axis"] for part in _PARTS if "only" not in part))
"""Names of those that are run under all laws; the first is the scene as it is."""
UNITS = {part["axis"]: part["unit"] for part in _PARTS if "unit" in part}
"""Of the values of an axis."""
COMMON = (MINIMAL, MULTIPLIERS, TREE, FULL)
"""What runs a cell of the hypercube, and under the laws of a whole side; there LSODA takes all its time."""


@dataclass(frozen=True)
class Cell:
    """One scene at an extreme, and the formulations that run it."""

    axis: str
    """What is pushed."""
    label: str
    """How far, for a reader."""
    law: str
    methods: tuple[Method, ...]
    changes: Mapping[str, object] = field(default_factory=dict, hash=False)
    """Dotted keys that differ from the scene `BASE`."""
    settings: Mapping[str, object] = field(default_factory=dict, hash=False)
    """Of a solver, dotted keys: they replace those of the formulation that runs it."""

    @cached_property
    def scene(self) -> Scene:
        """The scene, without the solver of a formulation; raises `SceneError` where it is refused."""
        usual: dict[str, object] = {"drive.cycles": CYCLES, "contact.law": self.law}
        sampled = {"output.groups": [], "output.samples_per_cycle": SAMPLES}
        return load_scene(BASE, usual | sampled | dict(self.changes))


def cells(axes: Sequence[str], points: int) -> list[Cell]:
    """Return all cells: every axis under every law, settings and cycles, then the hypercube."""
    usual = [cell for law in LAWS for axis in axes for cell in along(axis, law)]
    special = [cell for part in _PARTS if "only" in part for cell in _cells(part, LAWS[0])]
    return [*usual, *special, *hypercube(points, SEED)]


def along(axis: str, law: str) -> list[Cell]:
    """Return the cells of an axis under a law: of the laws of a whole side the ends alone; they cost much."""
    parts = [part for part in _PARTS if part["axis"] == axis]
    found = [cell for part in parts for cell in _cells(part, law)]
    if law == LAWS[0]:
        return found
    if law == LITERAL_LAW and not parts[0].get("literal"):
        return []
    return list(dict.fromkeys((found[0], found[-1])))


def _cells(part: Mapping[str, Any], law: str) -> list[Cell]:
    methods: Sequence[Method] = METHODS if law == LAWS[0] else COMMON
    if "only" in part:
        methods = [method for method in METHODS if method.name in part["only"]]
    elif not part.get("audited"):
        methods = [method for method in methods if method != INDEX2]
    cells = []
    for value in part["values"]:
        values = {key: factor * value for key, factor in part["keys"].items()} | part.get("fixed", {})
        both = ({}, values) if part.get("settings") else (values, {})
        cells.append(Cell(part["axis"], part.get("label", "{:g}").format(value), law, tuple(methods), *both))
    return cells


def hypercube(count: int, seed: int) -> list[Cell]:
    """Return cells drawn over all ranges at once.

    The start lies from wall to wall and a tenth of the clearance inside it, tilted up to the wedge; of ten
    points one is under the paper's literal switch, of the others each second one under the foundation.
    """
    cells = []
    for number, u in enumerate(qmc.LatinHypercube(len(_RANGES) + 2, rng=seed).random(count).tolist()):
        values: dict[str, Any] = {}
        for of, share in zip(_RANGES, u, strict=False):
            low, high = of.get("logarithmic") or of["linear"]
            at = low + share * (high - low)
            values[of["key"]] = float(f"{10**at:.6g}") if "logarithmic" in of else round(at, 4)
        clearance, (offset, angle) = values["clearance.slider"], (2.0 * share - 1.0 for share in u[-2:])
        values["mechanism.reference_offset"] = 0.0
        values["initial.slider_offset"] = 1.1 * offset * clearance
        # Corners of a diagonal touch at about 2 clearances / length.
        values["initial.slider_angle"] = angle * clearance / 0.035
        law = LAWS[2] if number % 10 == 9 else LAWS[number % 2]
        cells.append(Cell(HYPERCUBE, f"{number + 1}", law, COMMON, values))
    return cells
