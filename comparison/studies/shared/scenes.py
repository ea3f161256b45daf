"""What several studies do with scenes: keys, settings of a tier, random starts, formulations."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from comparison.accuracy.levels import tight
from comparison.models import MODELS
from comparison.scene import Scene
from comparison.scene.schema import MATERIALS, PARTNERS


def leaves(data: Mapping[str, Any], above: str = "") -> dict[str, Any]:
    """Return the values of a nested mapping by their dotted keys."""
    result: dict[str, Any] = {}
    for key, value in data.items():
        result |= leaves(value, f"{above}{key}.") if isinstance(value, dict) else {f"{above}{key}": value}
    return result


def settable(data: Mapping[str, Any]) -> dict[str, Any]:
    """Return the `leaves`, and a material's number for both partners of a contact as well as for each."""
    both = {key: data["contact"][key.removeprefix("contact.")] for key in MATERIALS}
    each = {f"{key}.{partner}": value for key, value in both.items() for partner in PARTNERS}
    return each | both | leaves(data)


def at_tier(scene: Scene, tier: str) -> Scene:
    """Return a scene with the settings of a tier for the models of this package."""
    return (tight(scene, MODELS) if tier == "tight" else None) or scene


def log_uniform(rng: np.random.Generator, bounds: tuple[float, float]) -> float:
    """Draw a number whose logarithm is uniform between those of the bounds."""
    return float(np.exp(rng.uniform(*np.log(bounds))))


def clearance_and_start(
    rng: np.random.Generator, bounds: tuple[float, float], length: float
) -> dict[str, float]:
    """Draw a clearance and a start between the walls of a slider of this length, m, as keys of a scene."""
    clearance = log_uniform(rng, bounds)
    # A corner is as far out as |offset| + |angle| L / 2.
    offset, corner = rng.uniform(-1.0, 1.0, 2)
    while abs(offset) + abs(corner) >= 0.98:
        offset, corner = rng.uniform(-1.0, 1.0, 2)
    return {
        "clearance.slider": clearance,
        "initial.slider_offset": float(offset * clearance),
        "initial.slider_angle": float(corner * clearance * 2.0 / length),
    }


# ---- the catalogue of formulations and integrators by which either model can run a scene


@dataclass(frozen=True)
class Method:
    """A formulation of the equations of motion with an integrator."""

    name: str  # both, as reports print them
    model: str  # "reference" or "exudyn"
    changes: Mapping[str, object] = field(hash=False)
    """What selects it: dotted keys of a scene and their values, without tolerances and step sizes."""

    @property
    def title(self) -> str:
        """Model and name, which identify it."""
        return f"{self.model}: {self.name}"


def _method(name: str, model: str, **solver: object) -> Method:
    return Method(name, model, {f"solver.{model}.{key}": value for key, value in solver.items()})


def _reference(name: str, formulation: str, method: str = "dop853") -> Method:
    return _method(name, "reference", formulation=formulation, method=method)


MINIMAL = _reference("minimal, DOP853", "auto")
MINIMAL_SCIPY = _reference("minimal, scipy's DOP853", "auto", "scipy-DOP853")
MINIMAL_LSODA = _reference("minimal, LSODA", "auto", "LSODA")
MINIMAL_RADAU = _reference("minimal, Radau", "auto", "Radau")
MINIMAL_BDF = _reference("minimal, BDF", "auto", "BDF")
MULTIPLIERS = _reference("multipliers, DOP853", "multiplier")
MULTIPLIERS_BDF = _reference("multipliers, BDF", "multiplier", "BDF")
TREE = _method("tree, DOPRI5", "exudyn", formulation="tree")
TREE_LONG_STEPS = _method("tree, DOPRI5, steps up to 1 ms", "exudyn", formulation="tree", step=1e-3)
FULL = _method("full (five bodies), generalized alpha", "exudyn", formulation="full")
FULL_INDEX2 = _method(
    "full (five bodies), trapezoidal index 2", "exudyn", formulation="full", method="trapezoidal-index2"
)

METHODS = tuple(value for value in globals().values() if isinstance(value, Method))
