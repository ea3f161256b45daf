"""The package as an installer leaves it: its entry point where Python and its worker processes find it."""

import tomllib
from pathlib import Path

import pytest

from comparison.scene import load_scene

PACKAGE = Path(__file__).parents[1]


@pytest.fixture
def entry_point(tmp_path, monkeypatch):
    """Register the entry point of the package's ``pyproject.toml``."""
    project = tomllib.loads((PACKAGE / "pyproject.toml").read_text("utf-8"))["project"]
    info = tmp_path / "site" / "sixbar_pinocchio.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: 1\n")
    points = project["entry-points"]["sixbar.models"]
    lines = [f"{name} = {target}" for name, target in points.items()]
    (info / "entry_points.txt").write_text("\n".join(["[sixbar.models]", *lines, ""]))
    monkeypatch.syspath_prepend(str(PACKAGE))
    monkeypatch.syspath_prepend(str(tmp_path / "site"))
    monkeypatch.setenv("SIXBAR_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.chdir(tmp_path)


@pytest.fixture(scope="session")
def run():
    """``run(scene, changes, tolerance)``: the complete scene, and the engine's result, once a session."""
    from pinocchio_press import simulate

    runs = {}

    def run_once(name, changes, tolerance=1e-10):
        key = repr((name, changes, tolerance))
        if key not in runs:
            scene = load_scene(name, changes).data
            scene["solver"]["pinocchio"] = {"tolerance": tolerance}
            runs[key] = scene, simulate(scene)
            assert runs[key][1].status == "success", runs[key][1].remedy
        return runs[key]

    return run_once
