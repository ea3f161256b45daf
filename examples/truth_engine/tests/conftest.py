"""The scenes of these tests, and the engine's runs of them."""

import pytest

from comparison.scene import load_scene


@pytest.fixture(scope="session")
def run():
    """``run(scene, changes, bits)``: the engine's result, once a session."""
    from truth_press import simulate

    known = {}

    def simulated(name, changes, bits=53):
        key = repr((name, changes, bits))
        if key not in known:
            scene = load_scene(name, changes).data
            scene["solver"]["truth"] = {"bits": bits}
            known[key] = simulate(scene)
            assert known[key].status == "success", known[key].remedy
        return known[key]

    return simulated
