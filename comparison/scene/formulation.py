"""The smallest formulation in which a model of ours gives what a scene asks for.

A driven crank and ideal joints leave nothing free; every clearance frees two coordinates, and only what is
free has to be integrated. The other bodies matter where forces in joints or energies are asked for: then
Exudyn needs all five of them with their constraints, while the reference finds both from the motion of the
few by balance of forces. A larger formulation runs only where a scene names it.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

FORCES = ("joints", "energy")
"""Groups of channels that need the motion of all bodies."""


def loose(scene: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the joints with clearance, of "crank_pin" and "slider"."""
    joints = scene.get("joints", {})
    defaults = (("crank_pin", "ideal"), ("slider", "clearance"))
    return tuple(name for name, usual in defaults if joints.get(name, usual) == "clearance")


def forces(scene: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the groups of channels that a scene asks for and that need all bodies."""
    groups = scene.get("output", {}).get("groups", ())
    return tuple(group for group in FORCES if isinstance(groups, list) and group in groups)


def smallest_in_exudyn(scene: Mapping[str, Any]) -> str:
    """Return "tree", what the drive leaves free with error control, or "full", the five bodies.

    A method of fixed steps that the scene names needs the latter.
    """
    method = scene.get("solver", {}).get("exudyn", {}).get("method", "auto")
    explicit = method in ("auto", "dopri5")
    return "tree" if explicit and loose(scene) and not forces(scene) else "full"
