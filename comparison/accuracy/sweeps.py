"""The formulations of both models; this gives way to `comparison.models`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from comparison.scene.formulation import forces, joints_with_clearance, smallest_in_exudyn

__all__ = [
    "forces", "formulations", "joints_with_clearance", "key_of", "model_of", "smallest_in_exudyn",
]  # fmt: skip


def formulations(data: Mapping[str, Any]) -> list[str]:
    """Return those that can run a scene."""
    free = joints_with_clearance(data)
    multiplier = [] if "crank_pin" in free else ["multiplier"]
    return ["minimal", *multiplier, *(["tree"] if free else []), "full"]


def model_of(formulation: str) -> str:
    """Return the model that has a formulation."""
    return "reference" if formulation in ("minimal", "multiplier") else "exudyn"


def key_of(formulation: str) -> str:
    """Return the dotted key of a formulation's setting."""
    return f"solver.{model_of(formulation)}.{'step' if formulation == 'full' else 'tolerance'}"
