"""What is measured: the methods of the catalogue, each over its tolerances or step sizes, on three scenes."""

from __future__ import annotations

from dataclasses import dataclass

from comparison.scene import Scene, load_scene
from comparison.studies.shared import formulations as catalogue
from comparison.studies.shared.formulations import Method

WITH_CLEARANCE = ("150rpm-0.2mm", "300rpm-0.2mm")
"""Scenes with clearance at the slider."""
SCENES: dict[str, dict[str, object]] = {
    "ideal": {"joints.slider": "ideal", "output.groups": ["accelerations", "joints"]},
    **{name: {"output.groups": []} for name in WITH_CLEARANCE},
}
"""Scene -> what is changed of it; each is run for one crank cycle."""
CHIEF = {name: "slider_x" if name in WITH_CLEARANCE else "crank_torque" for name in SCENES}
"""Scene -> the quantity whose error stands for its accuracy."""
TITLES = {
    "ideal": "ideal mechanism with its joint reactions, 150 rpm",
    "150rpm-0.2mm": "150 rpm, 0.2 mm",
    "300rpm-0.2mm": "300 rpm, 0.2 mm",
}


@dataclass(frozen=True)
class Sweep:
    """A method over its settings."""

    method: Method
    settings: tuple[float, ...]
    """Tolerances, or step sizes in s, coarsest first."""
    order: float = 1.0
    """Of the error in the setting: 1 for a tolerance."""
    scenes: tuple[str, ...] = WITH_CLEARANCE
    """Of `SCENES`."""

    @property
    def key(self) -> str:
        """Dotted key of the setting."""
        return f"solver.{self.method.model}.{'step' if self.order == 2 else 'tolerance'}"

    def scene(self, name: str, setting: float) -> Scene:
        """Return a crank cycle of one of the scenes as this method runs it."""
        return cycle(name, {**self.method.changes, self.key: setting})


def cycle(name: str, changes: dict[str, object]) -> Scene:
    """Return one crank cycle of one of the scenes; settings after the formulation that they belong to."""
    source = name if name in WITH_CLEARANCE else "150rpm-0.2mm"
    return load_scene(source, {**SCENES[name], "drive.cycles": 1.0}).variant(changes)


def _decades(first: int, last: int) -> tuple[float, ...]:
    return tuple(float(f"1e-{n}") for n in range(first, last + 1))


_STEPS = (4e-5, 2e-5, 8e-6, 4e-6, 2e-6, 1e-6, 5e-7)
SWEEPS = (
    Sweep(catalogue.MINIMAL, _decades(6, 12)),
    Sweep(catalogue.MINIMAL_SCIPY, _decades(6, 9)),
    Sweep(catalogue.MINIMAL_LSODA, _decades(6, 10)),
    Sweep(catalogue.MINIMAL_RADAU, _decades(6, 8)),
    Sweep(catalogue.MINIMAL_BDF, _decades(6, 9)),
    Sweep(catalogue.MULTIPLIERS, _decades(6, 12), scenes=tuple(SCENES)),
    Sweep(catalogue.MULTIPLIERS_BDF, _decades(6, 8), scenes=tuple(SCENES)),
    Sweep(catalogue.TREE, _decades(4, 11)),
    Sweep(catalogue.TREE_LONG_STEPS, _decades(2, 8)),
    Sweep(catalogue.FULL, _STEPS, order=2.0),
    Sweep(catalogue.FULL_INDEX2, _STEPS, order=2.0, scenes=tuple(SCENES)),
)
