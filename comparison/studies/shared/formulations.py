"""The catalogue of formulations and integrators by which either model can run a scene."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


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


def _reference(name: str, formulation: str, integrator: str = "dop853") -> Method:
    changes = {"solver.reference.formulation": formulation, "solver.reference.method": integrator}
    return Method(name, "reference", changes)


def _exudyn(name: str, formulation: str, **solver: object) -> Method:
    changes = {"formulation": formulation} | solver
    return Method(name, "exudyn", {f"solver.exudyn.{key}": value for key, value in changes.items()})


MINIMAL = _reference("minimal, DOP853", "auto")
MINIMAL_SCIPY = _reference("minimal, scipy's DOP853", "auto", "scipy-DOP853")
MINIMAL_LSODA = _reference("minimal, LSODA", "auto", "LSODA")
MINIMAL_RADAU = _reference("minimal, Radau", "auto", "Radau")
MINIMAL_BDF = _reference("minimal, BDF", "auto", "BDF")
MULTIPLIERS = _reference("multipliers, DOP853", "multiplier")
MULTIPLIERS_BDF = _reference("multipliers, BDF", "multiplier", "BDF")
TREE = _exudyn("tree, DOPRI5", "tree")
TREE_LONG_STEPS = _exudyn("tree, DOPRI5, steps up to 1 ms", "tree", step=1e-3)
FULL = _exudyn("full (five bodies), generalized alpha", "full")
FULL_INDEX2 = _exudyn("full (five bodies), trapezoidal index 2", "full", method="trapezoidal-index2")

METHODS = (
    MINIMAL,
    MINIMAL_SCIPY,
    MINIMAL_LSODA,
    MINIMAL_RADAU,
    MINIMAL_BDF,
    MULTIPLIERS,
    MULTIPLIERS_BDF,
    TREE,
    TREE_LONG_STEPS,
    FULL,
    FULL_INDEX2,
)
