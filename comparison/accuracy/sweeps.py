"""The formulations by which either model can run a scene, and the settings over which errors are measured."""

from __future__ import annotations

from comparison.models import joints_with_clearance
from comparison.scene import Scene

TOLERANCES = (1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12)
STEPS = (8e-6, 4e-6, 2e-6, 1e-6, 5e-7, 2.5e-7)
SETTINGS = {
    "minimal": TOLERANCES,
    "multiplier": TOLERANCES,
    "tree": TOLERANCES[:-1],
    "full": STEPS,
}
"""Formulation -> its tolerances, or steps in s, coarsest first."""


def formulations(scene: Scene) -> list[str]:
    """Return those that can run a scene, by the names in `SETTINGS`."""
    free = joints_with_clearance(scene.data)
    there = ["minimal"] + ([] if "crank_pin" in free else ["multiplier"])
    return there + (["tree"] if free else []) + ["full"]


def model_of(formulation: str) -> str:
    """Return the model that has a formulation."""
    return "reference" if formulation in ("minimal", "multiplier") else "exudyn"


def key_of(formulation: str) -> str:
    """Return the dotted key of a formulation's setting."""
    return f"solver.{model_of(formulation)}.{'step' if formulation == 'full' else 'tolerance'}"


def at(scene: Scene, formulation: str, setting: float) -> Scene:
    """Return a scene as a formulation runs it at a setting."""
    named = scene.variant({f"solver.{model_of(formulation)}.formulation": formulation})
    return named.variant({key_of(formulation): setting})
