"""Cells of the study: the scene `runs.BASE` with one parameter pushed to an extreme, or all drawn at once.

The axes and the ranges of the Latin hypercube are data, ``axes.toml``.
"""

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from importlib.resources import files
from typing import Any

from scipy.stats import qmc

from comparison.scene import Scene, load_scene
from comparison.studies.extremes.runs import BASE, LIMIT
from comparison.studies.shared.scenes import FULL, MINIMAL, MULTIPLIERS, TREE

PAIRS: dict[str, dict[str, object]] = {
    "smallest": {**MINIMAL.changes, **TREE.changes},
    "largest": {**MULTIPLIERS.changes, **FULL.changes},
}
"""Pair of formulations -> keys that select it; settings are those of the scene (accuracy ``standard``)."""
LAWS = ("hertz-corners", "foundation", "paper-switching", "adams-impact")
"""Contact laws; the first three are run along the axes that name none of their own."""
USUAL, FOUNDATION, LITERAL, IMPACT = LAWS
DAMPING_MODELS = ("lankarani-nikravesh", "hunt-crossley", "flores", "gonthier")
SEED = 1
"""Of the Latin hypercube."""
CYCLES, SAMPLES = 1.0, 250
"""Crank cycles of a cell, where its axis does not push them; samples per cycle."""
CYCLES_AXIS, HYPERCUBE = "cycles", "hypercube"
LONG_LIMIT, SHORT_LIMIT = 120.0, 3.0
"""Limits of cells of many cycles, and of those whose runs mostly take all the time that they are given."""
_DATA: dict[str, list[dict[str, Any]]] = tomllib.loads(
    files("comparison.studies.extremes").joinpath("axes.toml").read_text("utf-8")
)
_PARTS, _RANGES = _DATA["part"], _DATA["range"]
AXES = tuple(dict.fromkeys(part["axis"] for part in _PARTS))
"""All axes; the first is the base scene as it is shipped."""
UNITS = {part["axis"]: part["unit"] for part in _PARTS if "unit" in part}


@dataclass(frozen=True)
class Cell:
    """A scene at an extreme, and the pairs of formulations that run it."""

    axis: str
    label: str
    law: str
    changes: Mapping[str, object] = field(default_factory=dict, hash=False)
    """Dotted keys that differ from the scene `BASE`."""
    pairs: tuple[str, ...] = tuple(PAIRS)

    @cached_property
    def scene(self) -> Scene:
        """The scene, without formulations; raises `SceneError` where the values of a scene exclude it."""
        usual: dict[str, object] = {"drive.cycles": CYCLES, "contact.law": self.law}
        sampled = {"output.groups": [], "output.samples_per_cycle": SAMPLES}
        return load_scene(BASE, usual | sampled | dict(self.changes))

    @property
    def limit(self) -> float:
        """Processor time that a run may take, s."""
        if self.axis == CYCLES_AXIS:
            return LONG_LIMIT
        short = self.law == LITERAL or (self.axis == HYPERCUBE and self.law != USUAL)
        return SHORT_LIMIT if short else LIMIT


def cells(axes: Sequence[str], points: int) -> list[Cell]:
    """Return the cells along axes, by law, and so many points of the hypercube.

    Under the laws of a whole side, whose runs are expensive, only the two ends of an axis.
    """
    grid: list[Cell] = []
    for law in LAWS:
        for axis in axes:
            parts = [part for part in _PARTS if part["axis"] == axis]
            named, literal = parts[0].get("law"), parts[0].get("literal", False)
            along = [cell for part in parts for cell in _along(part, law)]
            if law == (named or USUAL):
                grid += along
            elif named is None and (law == FOUNDATION or (law == LITERAL and literal)):
                grid += dict.fromkeys((along[0], along[-1]))
    return grid + hypercube(points, SEED)


def _along(part: Mapping[str, Any], law: str) -> list[Cell]:
    pairs = (part["pair"],) if "pair" in part else tuple(PAIRS)
    keys, cells = part["keys"] if "keys" in part else {part["key"]: 1.0}, []
    for value in part["values"]:
        changes = {key: factor * value for key, factor in keys.items()} | part.get("fixed", {})
        cells.append(Cell(part["axis"], part.get("label", "{:g}").format(value), law, changes, pairs))
    return cells


def hypercube(count: int, seed: int) -> list[Cell]:
    """Return cells drawn over all ranges at once.

    The start lies from wall to wall and a tenth of the clearance inside it, tilted up to the wedge. Of ten
    points one is under the paper's literal switch, one under ADAMS' law, of the others each second one under
    the foundation; these take the damping models in turn. Of five points one has a workpiece.
    """
    cells = []
    for number, u in enumerate(qmc.LatinHypercube(len(_RANGES) + 2, rng=seed).random(count).tolist()):
        values: dict[str, Any] = {}
        for span, share in zip(_RANGES, u, strict=False):
            low, high = span.get("logarithmic") or span["linear"]
            at = low + share * (high - low)
            values[span["key"]] = float(f"{10**at:.6g}") if "logarithmic" in span else round(at, 4)
        clearance, (offset, angle) = values["clearance.slider"], (2.0 * share - 1.0 for share in u[-2:])
        values["mechanism.reference_offset"] = 0.0
        values["initial.slider_offset"] = 1.1 * offset * clearance
        # Corners of a diagonal touch at about 2 clearances / length.
        values["initial.slider_angle"] = angle * clearance / 0.035
        if number % 5 != 2:
            del values["load.force"]
        law = {9: LITERAL, 4: IMPACT}.get(number % 10, LAWS[number % 2])
        if law in (USUAL, FOUNDATION):
            values["contact.damping_model"] = DAMPING_MODELS[number // 2 % len(DAMPING_MODELS)]
        cells.append(Cell(HYPERCUBE, f"{number + 1}", law, values))
    return cells
