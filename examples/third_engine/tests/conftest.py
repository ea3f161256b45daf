"""The package as an installer leaves it: its entry point where Python and its worker processes find it."""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from comparison.scene import load_scene

PACKAGE = Path(__file__).parents[1]
Run = Callable[..., tuple[dict[str, Any], SimpleNamespace]]


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Register the entry point of the package's ``pyproject.toml``."""
    project = tomllib.loads((PACKAGE / "pyproject.toml").read_text("utf-8"))["project"]
    info = tmp_path / "site" / "sixbar_pinocchio.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text(
        f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: {project['version']}\n"
    )
    points = project["entry-points"]["sixbar.models"]
    lines = [f"{name} = {target}" for name, target in points.items()]
    (info / "entry_points.txt").write_text("\n".join(["[sixbar.models]", *lines, ""]))
    monkeypatch.syspath_prepend(str(PACKAGE))
    monkeypatch.syspath_prepend(str(tmp_path / "site"))
    monkeypatch.setenv("SIXBAR_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.chdir(tmp_path)


@pytest.fixture(scope="session")
def run() -> Run:
    """``run(scene, changes, tolerance)``: the complete scene, and the engine's result, once a session."""
    from pinocchio_press import simulate

    known: dict[str, tuple[dict[str, Any], SimpleNamespace]] = {}

    def simulated(name: str, changes: dict[str, Any], tolerance: float = 1e-10) -> Any:
        key = repr((name, changes, tolerance))
        if key not in known:
            scene = load_scene(name, changes).data
            scene["solver"]["pinocchio"] = {"tolerance": tolerance}
            result = simulate(scene)
            assert result.status == "success", result.remedy
            known[key] = scene, result
        return known[key]

    return simulated
