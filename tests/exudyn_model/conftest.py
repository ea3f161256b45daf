"""Scenes and runs for the Exudyn model's tests."""

import json

import numpy as np
import pytest

from exudyn_model import simulate

TREE = {"formulation": "tree", "method": "dopri5", "step": 1e-4}


@pytest.fixture(scope="session")
def make_scene(scene):
    """Function from changes with dotted keys, and a tree's tolerance (None: five bodies), to a scene."""

    def make(*changes, tree=None):
        solver = TREE | {"tolerance": tree} if tree else {}
        merged = {f"solver.exudyn.{key}": value for key, value in solver.items()}
        for more in changes:
            merged |= more
        return scene(merged)

    return make


@pytest.fixture(scope="session")
def run(make_scene):
    """Function from the same arguments to the result, which those who ask for an equal scene share."""
    known = {}

    def result(*changes, tree=None):
        scene = make_scene(*changes, tree=tree)
        key = json.dumps(scene, sort_keys=True)
        if key not in known:
            known[key] = simulate(scene)
        return known[key]

    return result


@pytest.fixture(scope="session")
def error():
    """Function from two results and a channel to the largest difference at a sample."""
    return lambda result, exact, name: float(np.max(np.abs(result.columns[name] - exact.columns[name])))
