"""Every formulation of both models behind one interface, and short scenes that each of them runs once."""

from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import pytest

import exudyn_model
import reference_model
from comparison.scene import load_scene


@dataclass(frozen=True)
class Variant:
    """A model in one of its formulations, at a setting that is accurate enough to tell physics from error."""

    model: Any
    settings: dict[str, Any]
    groups: tuple[str, ...] = ("accelerations", "corners")  # those that it gives


reference = partial(Variant, reference_model, groups=("accelerations", "corners", "joints", "energy"))
exudyn = partial(Variant, exudyn_model)
# The errors measured in the scene "rattle": 2e-13, 2e-12, 2e-8, 1e-8 and 4e-11 m.
VARIANTS = {
    "reference-minimal": reference({"reference.formulation": "minimal", "reference.tolerance": 1e-13}),
    "reference-multiplier": reference({"reference.formulation": "multiplier", "reference.tolerance": 1e-12}),
    "exudyn-full": exudyn({"exudyn.formulation": "full", "exudyn.step": 2e-6}),
    "exudyn-index2": Variant(
        exudyn_model,
        {"exudyn.formulation": "full", "exudyn.method": "trapezoidal-index2", "exudyn.step": 2e-6},
        ("accelerations", "corners", "joints", "energy"),
    ),
    "exudyn-tree": exudyn({"exudyn.formulation": "tree", "exudyn.tolerance": 1e-10}),
}

# A sample every 4e-6 s, some fifty in a contact of steel.
SAMPLING = {"drive.cycles": 0.1, "output.samples_per_cycle": 100_000}
THROW = {"initial.slider_omega": 0.2, "initial.slider_angle": 1e-4}
SCENES = {
    # Thrown into its guide with a spin: short hits of single corners, at first in free flight.
    "rattle": ("150rpm-0.2mm", {**SAMPLING, **THROW}),
    # Opposite corners in a soft guide, the shipped scene.
    "wedge": ("wedge", SAMPLING),
    # Thrown likewise under the law adams-impact, 0.1 mm inside a workpiece.
    "punch": (
        "150rpm-0.2mm",
        {
            **SAMPLING, **THROW, "contact.law": "adams-impact", "load.surface": 0.1892,
            "load.table": [[0.0, 0.0], [2e-3, 8.0], [2e-2, 4.0]],
        },
    ),
    # A whole turn without clearance.
    "turn": (
        "ideal",
        {
            "drive.cycles": 1.0, "solver.exudyn.step": 1.25e-5,
            "output.groups": ["accelerations", "joints", "energy"],
        },
    ),
}  # fmt: skip


@dataclass(frozen=True)
class Run:
    """A result with the scene that it answers."""

    scene: dict[str, Any]
    result: Any
    variant: Variant

    @property
    def columns(self):
        return self.result.columns

    @property
    def reference(self):
        """True for a run of the reference model."""
        return self.variant.model is reference_model

    def contacts(self, corner):
        """Rows of the table of contacts for one corner, in time."""
        events = self.result.events
        rows = np.flatnonzero(events["corner"] == corner)
        return [{name: events[name][row] for name in events if name != "corner"} for row in rows]


@pytest.fixture(scope="session")
def run():
    """``run(variant, scene, changes)``: a named scene with dotted keys changed, simulated once a session.

    It succeeds, or has one of the statuses ``failures``.
    """
    runs = {}

    def simulate(variant, scene, changes=None, failures=()):
        setup = VARIANTS[variant]
        name, values = SCENES.get(scene, (scene, {}))
        key = repr((variant, scene, changes or {}))
        if key not in runs:
            settings = {f"solver.{key}": value for key, value in setup.settings.items()}
            groups = {"output.groups": list(setup.groups)}
            data = load_scene(name, {**groups, **settings, **values, **(changes or {})}).data
            result = setup.model.simulate(data)
            assert result.status in ("success", *failures), result.remedy
            runs[key] = Run(data, result, setup)
        return runs[key]

    return simulate


@pytest.fixture(params=VARIANTS)
def variant(request):
    """Each formulation of both models."""
    return str(request.param)


@pytest.fixture(params=["rattle", "wedge", "punch"])
def short_run(request, variant, run):
    """Each formulation's run of each short scene."""
    return run(variant, request.param)
