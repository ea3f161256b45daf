"""Every formulation of both models behind one interface, and short scenes that each of them runs once."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest

import exudyn_model
import reference_model
from comparison.scene import load_scene

CORNERS = ("ll", "lr", "ul", "ur")


@dataclass(frozen=True)
class Variant:
    """A model in one of its formulations, at a setting that is accurate enough to tell physics from error."""

    model: Any
    settings: dict[str, Any]
    groups: tuple[str, ...] = ("accelerations", "corners", "joints", "energy")
    """Those that it gives."""
    error: float = 1e-9
    """Of slider_x in the scenes below, m: measured against the strict reference, rounded up."""


# The errors measured in the scene "rattle": 2e-13, 2e-12, 2e-8, 1e-8 and 4e-11 m.
VARIANTS = {
    "reference-minimal": Variant(
        reference_model,
        {"solver.reference.formulation": "minimal", "solver.reference.tolerance": 1e-13},
    ),
    "reference-multiplier": Variant(
        reference_model,
        {"solver.reference.formulation": "multiplier", "solver.reference.tolerance": 1e-12},
    ),
    "exudyn-full": Variant(
        exudyn_model,
        {"solver.exudyn.formulation": "full", "solver.exudyn.step": 2e-6},
        groups=("accelerations", "corners"),
        error=1e-6,
    ),
    "exudyn-index2": Variant(
        exudyn_model,
        {
            "solver.exudyn.formulation": "full",
            "solver.exudyn.method": "trapezoidal-index2",
            "solver.exudyn.step": 2e-6,
        },
        error=1e-6,
    ),
    "exudyn-tree": Variant(
        exudyn_model,
        {"solver.exudyn.formulation": "tree", "solver.exudyn.tolerance": 1e-10},
        groups=("accelerations", "corners"),
    ),
}

# A sample every 4e-6 s, some fifty in a contact of steel.
DENSE = {"drive.cycles": 0.1, "output.samples_per_cycle": 100_000}
SCENES: dict[str, tuple[str, dict[str, Any]]] = {
    # Thrown into its guide with a spin: short hits of single corners, at first in free flight.
    "rattle": ("150rpm-0.2mm", {**DENSE, "initial.slider_omega": 0.2, "initial.slider_angle": 1e-4}),
    # Opposite corners in a soft guide, the shipped scene.
    "wedge": ("wedge", DENSE),
}


@dataclass(frozen=True)
class Run:
    """A result with the scene that it answers."""

    scene: dict[str, Any]
    result: Any
    variant: Variant
    columns: dict[str, np.ndarray] = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "columns", self.result.columns)

    @property
    def reference(self) -> bool:
        """Whether it is one of the reference model's."""
        return self.variant.model is reference_model

    def contacts(self, corner: str) -> list[dict[str, float]]:
        """Rows of the table of contacts for one corner, in time."""
        events = self.result.events
        return [
            {name: events[name][row] for name in events if name != "corner"}
            for row in np.flatnonzero(events["corner"] == corner)
        ]


@pytest.fixture(scope="session")
def run() -> Callable[..., Run]:
    """``run(variant, scene, changes)``: a named scene with dotted keys changed, simulated once a session."""
    known: dict[str, Run] = {}

    def simulate(variant: str, scene: str, changes: dict[str, Any] | None = None) -> Run:
        chosen = VARIANTS[variant]
        name, own = SCENES.get(scene, (scene, {}))
        key = repr((variant, scene, changes))
        if key not in known:
            groups = {"output.groups": list(chosen.groups)}
            data = load_scene(name, {**groups, **chosen.settings, **own, **(changes or {})}).data
            result = chosen.model.simulate(data)
            assert result.status == "success", result.remedy
            known[key] = Run(data, result, chosen)
        return known[key]

    return simulate


@pytest.fixture(params=VARIANTS)
def variant(request: pytest.FixtureRequest) -> str:
    """Each formulation of both models."""
    return str(request.param)


@pytest.fixture(params=SCENES)
def short(request: pytest.FixtureRequest, variant: str, run: Callable[..., Run]) -> Run:
    """Each formulation's run of each short scene."""
    return run(variant, request.param)
