"""The made-up comparisons of the report's own tests."""

from __future__ import annotations

import importlib.util
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from comparison.agreement.results import SceneComparison


@pytest.fixture(scope="session")
def comparisons() -> list[SceneComparison]:
    """A scene that agrees at both tiers and one that differs."""
    # Test folders are no packages, so the neighbour is loaded by its path.
    path = Path(__file__).parents[1] / "comparison" / "report" / "conftest.py"
    spec = importlib.util.spec_from_file_location("made_up_comparisons", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)

    def moved(columns: dict[str, Any]) -> dict[str, Any]:
        return columns | {"slider_x": columns["slider_x"] + 1e-6}

    both = replace(module.make_scene("press"), tight=module.make_scene("press", tier="tight"))
    return [both, module.make_scene("moved", alter=moved)]
