"""Scenes, runs and the closed form of the linkage for the Exudyn model's tests."""

import json
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from exudyn_model import simulate

TREE = {"formulation": "tree", "method": "dopri5", "step": 1e-4}


@pytest.fixture(scope="session")
def make_scene(scene: Callable[..., dict[str, Any]]) -> Callable[..., dict[str, Any]]:
    """Function from changes with dotted keys, and a tree's tolerance (None: five bodies), to a scene."""

    def make(*changes: dict[str, Any], tree: float | None = None) -> dict[str, Any]:
        merged = {f"solver.exudyn.{key}": value for key, value in TREE.items()} if tree else {}
        if tree:
            merged["solver.exudyn.tolerance"] = tree
        for more in changes:
            merged |= more
        return scene(merged)

    return make


@pytest.fixture(scope="session")
def run(make_scene: Callable[..., dict[str, Any]]) -> Callable[..., Any]:
    """Function from the same arguments to the result, which those who ask for an equal scene share."""
    known: dict[str, Any] = {}

    def result(*changes: dict[str, Any], tree: float | None = None) -> Any:
        scene = make_scene(*changes, tree=tree)
        key = json.dumps(scene, sort_keys=True)
        if key not in known:
            known[key] = simulate(scene)
        return known[key]

    return result


@pytest.fixture(scope="session")
def error() -> Callable[..., float]:
    """Function from two results and a channel to the largest difference at a sample."""
    return lambda result, exact, name: float(np.max(np.abs(result.columns[name] - exact.columns[name])))


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
        c = linkage_points(scene, angle, shift)[2]
        x = linkage["guide_x"] + linkage["reference_offset"]
        return c.imag - np.sqrt(linkage["rod4"]["length"] ** 2 - (x - c.real) ** 2)

    return y
