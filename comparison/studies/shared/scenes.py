"""Scenes of several studies: keys, settings of a tier, formulations."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from comparison.accuracy.levels import tight
from comparison.models import MODELS
from comparison.scene import Scene
from comparison.scene.keys import flat
from comparison.scene.schema import MATERIALS, PARTNERS


def key_values(data: Mapping[str, Any]) -> dict[str, Any]:
    """Return values by dotted keys, those of a contact's materials for both partners and for each."""
    contact = data.get("contact")
    both = {key: contact[key.removeprefix("contact.")] for key in MATERIALS} if contact else {}
    each = {f"{key}.{partner}": value for key, value in both.items() for partner in PARTNERS}
    return each | both | flat(data)


def at_tier(scene: Scene, tier: str) -> Scene:
    """Return a scene with the settings of a tier for the models of this package."""
    return (tight(scene, MODELS) if tier == "tight" else None) or scene


# ---- the catalogue of formulations and integrators by which either model can run a scene


@dataclass(frozen=True)
class Method:
    """A formulation of the equations of motion with an integrator."""

    name: str  # both, as reports print them
    model: str  # "reference" or "exudyn"
    changes: Mapping[str, object] = field(hash=False)
    """Its selection: dotted keys of a scene and their values, without tolerances and step sizes."""

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
