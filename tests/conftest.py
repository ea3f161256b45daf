"""Scenes for the tests of the models, straight from the printed numbers."""

import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

pytest_plugins = "pytester"  # pytest inside pytest; pytest takes it from the topmost conftest.py only

PAPER = Path(__file__).parents[1] / "comparison" / "scenes" / "paper.toml"
Scene = dict[str, Any]


@pytest.fixture(scope="session")
def scene() -> Callable[..., Scene]:
    """Return a maker of complete scenes: the paper's press with dotted keys replaced."""

    def make(changes: dict[str, object] | None = None) -> Scene:
        data: Scene = tomllib.loads(PAPER.read_text())
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
