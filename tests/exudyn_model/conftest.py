"""Scenes and runs for the Exudyn model's tests."""

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
        solver = TREE | {"tolerance": tree} if tree else {}
        merged = {f"solver.exudyn.{key}": value for key, value in solver.items()}
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
