"""Scenes and runs for the Exudyn model's tests."""

import pytest

from exudyn_model import simulate


@pytest.fixture(scope="session")
def make_scene(scene):
    """Function from changes with dotted keys, and a tree's tolerance (None: five bodies), to a scene."""

    def make(*changes, tree=None):
        solver = {"formulation": "tree", "method": "dopri5", "step": 1e-4, "tolerance": tree} if tree else {}
        merged = {f"solver.exudyn.{key}": value for key, value in solver.items()}
        return scene(merged | {key: value for more in changes for key, value in more.items()})

    return make


@pytest.fixture(scope="session")
def run(make_scene):
    """Function from the same arguments to the result."""
    return lambda *changes, tree=None: simulate(make_scene(*changes, tree=tree))
