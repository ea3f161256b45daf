"""Scenes for the Exudyn model's tests: the shipped numbers with every default filled in."""

import copy
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

PAPER = Path(__file__).parents[2] / "comparison" / "scenes" / "paper.toml"


@pytest.fixture(scope="session")
def make_scene() -> Callable[[dict[str, Any]], dict[str, Any]]:
    """Function from changes with dotted keys to a complete scene."""
    base = tomllib.loads(PAPER.read_text(encoding="utf-8"))
    base["solver"] = {
        "reference": {
            "method": "dop853",
            "tolerance": 1e-9,
            "baumgarte_alpha": 10.0,
            "baumgarte_beta": 10.0,
        },
        "exudyn": {"method": "generalized-alpha", "step": 2e-6, "tolerance": 1e-7},
    }

    def scene(changes: dict[str, Any]) -> dict[str, Any]:
        result = copy.deepcopy(base)
        for path, value in changes.items():
            *sections, key = path.split(".")
            table = result
            for section in sections:
                table = table[section]
            table[key] = value
        result["initial"].setdefault("slider_offset", result["mechanism"]["reference_offset"])
        return result

    return scene
