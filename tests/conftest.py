"""Scenes for the tests of the models, straight from the printed numbers; settings for any machine."""

import os
import tomllib
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, settings
from platformdirs import user_cache_path

# The time of an example depends on the load of the machine.
settings.register_profile("any machine", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("any machine")

# Tests with a cache of their own share the models' compiled kernels.
os.environ.setdefault("NUMBA_CACHE_DIR", os.environ.get("SIXBAR_CACHE_DIR") or str(user_cache_path()))

pytest_plugins = "pytester"  # pytest inside pytest; pytest takes it from the topmost conftest.py only

PAPER = Path(__file__).parents[1] / "comparison" / "scene" / "shipped" / "paper.toml"
Scene = dict[str, Any]


@pytest.fixture(scope="session")
def scene():
    """Return a maker of complete scenes: the paper's press with dotted keys replaced."""

    def make(changes=None):
        data = tomllib.loads(PAPER.read_text())
        data["solver"] = {
            "reference": {
                "method": "dop853",
                "tolerance": 1e-9,
                "baumgarte_alpha": 10.0,
                "baumgarte_beta": 10.0,
            },
            "exudyn": {"formulation": "full", "method": "generalized-alpha", "step": 2e-6, "tolerance": 1e-7},
        }
        for key, value in (changes or {}).items():
            *path, last = key.split(".")
            section = data
            for part in path:
                section = section[part]
            section[last] = value
        data["initial"].setdefault("slider_offset", data["mechanism"]["reference_offset"])
        return data

    return make
