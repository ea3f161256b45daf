"""Selection of the smallest formulation of each built-in model that yields the requested channels.

A driven crank and ideal joints leave no degree of freedom; every clearance adds two coordinates, and only
these are integrated. The other bodies matter where joint forces or energies are requested: Exudyn then needs
all five bodies with their constraints, while the reference obtains both by force balance from the reduced
motion. A larger formulation runs only where a scene names it.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

FORCES = ("joints", "energy")
"""Channel groups that require the motion of all bodies."""


def joints_with_clearance(scene: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the joints with clearance, of "crank_pin" and "slider"."""
    joints = scene.get("joints", {})
    defaults = (("crank_pin", "ideal"), ("slider", "clearance"))
    return tuple(name for name, usual in defaults if joints.get(name, usual) == "clearance")


def forces(scene: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the requested channel groups that require the motion of all bodies."""
    groups = scene.get("output", {}).get("groups", ())
    return tuple(group for group in FORCES if isinstance(groups, list) and group in groups)


def smallest_in_exudyn(scene: Mapping[str, Any]) -> str:
    """Return "tree" (the free bodies alone, with error control) or "full" (five bodies).

    An implicit method, which the scene has to name, requires "full".
    """
    method = scene.get("solver", {}).get("exudyn", {}).get("method", "auto")
    explicit = method in ("auto", "dopri5")
    return "tree" if explicit and joints_with_clearance(scene) and not forces(scene) else "full"
