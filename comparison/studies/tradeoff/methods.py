"""What is measured: each model's formulations and integrators, each over its settings, on three scenes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from comparison.scene import Scene, load_scene

TURNS = 1.0
JOINTS: dict[str, object] = {"output.groups": ["accelerations", "joints"]}
SCENES: dict[str, dict[str, object]] = {
    "ideal": {"joints.slider": "ideal"} | JOINTS,
    "150rpm-0.2mm": {"output.groups": []},
    "300rpm-0.2mm": {"output.groups": []},
}
WORDS = {
    "ideal": "ideal mechanism with the reactions of its joints, 150 rpm",
    "150rpm-0.2mm": "150 rpm, 0.2 mm",
    "300rpm-0.2mm": "300 rpm, 0.2 mm",
}
LOOSE = ("150rpm-0.2mm", "300rpm-0.2mm")


@dataclass(frozen=True)
class Method:
    """One way to run a scene.

    Attributes
    ----------
    name
        What it is called.
    model
        "reference" or "exudyn".
    changes
        Of the scene, dotted keys.
    settings
        Tolerances, or steps in s, coarsest first.
    order
        Of the error in the setting: 1 for a tolerance.
    scenes
        Of `SCENES`.
    """

    name: str
    model: str
    settings: tuple[float, ...]
    changes: Mapping[str, object] = field(default_factory=dict)
    order: float = 1.0
    scenes: tuple[str, ...] = LOOSE

    @property
    def key(self) -> str:
        """Dotted key of the setting."""
        return f"solver.{self.model}.{'step' if self.order == 2 else 'tolerance'}"

    def scene(self, name: str, setting: float) -> Scene:
        """Return one of the scenes as this method runs it: one turn of the crank."""
        source = name if name in LOOSE else "150rpm-0.2mm"
        values = {**SCENES[name], **self.changes, "drive.cycles": TURNS}
        return load_scene(source, values).with_values({self.key: setting})


def _decades(first: int, last: int) -> tuple[float, ...]:
    return tuple(float(f"1e-{n}") for n in range(first, last + 1))


_STEPS = (4e-5, 2e-5, 8e-6, 4e-6, 2e-6, 1e-6, 5e-7)
_WHOLE: dict[str, object] = {"solver.reference.formulation": "multiplier"}
_TREE: dict[str, object] = {"solver.exudyn.formulation": "tree"}
EVERYWHERE = ("ideal", *LOOSE)

METHODS = (
    Method("minimal, DOP853", "reference", _decades(6, 12)),
    Method(
        "minimal, scipy's DOP853", "reference", _decades(6, 9), {"solver.reference.method": "scipy-DOP853"}
    ),
    Method("minimal, LSODA", "reference", _decades(6, 10), {"solver.reference.method": "LSODA"}),
    Method("minimal, Radau", "reference", _decades(6, 8), {"solver.reference.method": "Radau"}),
    Method("minimal, BDF", "reference", _decades(6, 9), {"solver.reference.method": "BDF"}),
    Method("multipliers, DOP853", "reference", _decades(6, 12), _WHOLE, scenes=EVERYWHERE),
    Method(
        "multipliers, BDF",
        "reference",
        _decades(6, 8),
        _WHOLE | {"solver.reference.method": "BDF"},
        scenes=EVERYWHERE,
    ),
    Method("tree, DOPRI5", "exudyn", _decades(4, 11), _TREE),
    Method("tree, DOPRI5, steps up to 1 ms", "exudyn", _decades(2, 8), _TREE | {"solver.exudyn.step": 1e-3}),
    Method("five bodies, generalized alpha", "exudyn", _STEPS, order=2.0),
    Method(
        "five bodies, trapezoidal index 2",
        "exudyn",
        _STEPS,
        {"solver.exudyn.method": "trapezoidal-index2"},
        order=2.0,
        scenes=EVERYWHERE,
    ),
    Method(
        "five bodies, Exudyn's contact", "exudyn", _STEPS, {"solver.exudyn.formulation": "native"}, order=2.0
    ),
)
PAPERS_WAY = "multipliers, BDF"
