"""Scenes for the Exudyn model's tests, and what several of them hold the model against."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest


@pytest.fixture(scope="session")
def make_scene(scene: Callable[..., dict[str, Any]]) -> Callable[..., dict[str, Any]]:
    """Function from changes with dotted keys to a complete scene."""
    return scene


@pytest.fixture(scope="session")
def tree_scene(make_scene: Callable[..., dict[str, Any]]) -> Callable[..., dict[str, Any]]:
    """Function from tolerance and changes to a scene for a tree."""

    def scene(tolerance: float, changes: dict[str, object]) -> dict[str, Any]:
        tree = {"formulation": "tree", "method": "dopri5", "step": 1e-4, "tolerance": tolerance}
        return make_scene({f"solver.exudyn.{key}": value for key, value in tree.items()} | changes)

    return scene


@pytest.fixture(scope="session")
def error() -> Callable[..., float]:
    """Function from two results and a channel to the largest difference at a sample."""

    def largest(result: Any, exact: Any, name: str = "slider_y") -> float:
        return float(np.max(np.abs(result.columns[name] - exact.columns[name])))

    return largest


@pytest.fixture(scope="session")
def mirrored() -> dict[str, Any]:
    """Changes that make the mirror image in the plane x = 0 of the paper's press."""
    return {
        "mechanism.rocker_pivot": [-0.2568, 0.2],
        "mechanism.guide_x": 0.55,
        "mechanism.reference_offset": -5e-5,
        "mechanism.crank_angle_deg": 180 - 111.36,
        "mechanism.rocker_branch": -1,
        "drive.speed_rpm": -150.0,
    }


@pytest.fixture(scope="session")
def linkage_points() -> Callable[..., tuple[Any, Any, Any, complex]]:
    """Joints A, B, C and H as complex numbers (m), from side lengths, on the paper's branches.

    Of a scene, the crank's angle (rad), and by how much (m) A is shifted.
    """

    def points(scene: dict[str, Any], angle: Any, shift: complex = 0.0) -> tuple[Any, Any, Any, complex]:
        linkage = scene["mechanism"]
        a = linkage["crank"]["length"] * np.exp(1j * angle) + shift
        h = complex(*linkage["rocker_pivot"])
        r2, r3 = linkage["rod2"]["length"], linkage["rocker"]["centroid"]
        d = abs(h - a)
        along = (d**2 + r2**2 - r3**2) / (2 * d)
        b = a + (along + 1j * np.sqrt(r2**2 - along**2)) * (h - a) / d
        return a, b, h + (b - h) * linkage["rocker"]["length"] / r3, h

    return points


@pytest.fixture(scope="session")
def ideal_y(linkage_points: Callable[..., tuple[Any, Any, Any, complex]]) -> Callable[..., Any]:
    """Ideal slider's y (m) of a scene, the crank's angle (rad) and the shift of A (m)."""

    def y(scene: dict[str, Any], angle: Any, shift: complex = 0.0) -> Any:
        linkage = scene["mechanism"]
        _, _, c, _ = linkage_points(scene, angle, shift)
        x = linkage["guide_x"] + linkage["reference_offset"]
        return c.imag - np.sqrt(linkage["rod4"]["length"] ** 2 - (x - c.real) ** 2)

    return y
