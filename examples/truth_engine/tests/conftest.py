"""The scenes of these tests, and the engine's runs of them."""

import pytest

from comparison.scene import load_scene


@pytest.fixture(scope="session")
def run():
    """``run(scene, changes, bits)``: the engine's result, once a session."""
    from truth_press import simulate

    runs = {}

    def run_once(name, changes, bits=53):
        key = repr((name, changes, bits))
        if key not in runs:
            scene = load_scene(name, changes).data
            scene["solver"]["truth"] = {"bits": bits}
            runs[key] = simulate(scene)
            assert runs[key].status == "success", runs[key].remedy
        return runs[key]

    return run_once
