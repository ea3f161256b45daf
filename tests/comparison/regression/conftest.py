"""A baseline of one scene of fake models."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest
from gate_command import BASELINE, gate


@pytest.fixture
def elsewhere(tmp_path, monkeypatch):
    """A folder of its own."""
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    return tmp_path / "here"


@pytest.fixture
def scene_file(fake_models, elsewhere):
    """Write a scene file beside the baseline; called again, it changes the scene."""
    assert fake_models.exists()
    assert Path.cwd() == elsewhere

    def make(name: str, gravity: float = 9.81) -> str:
        Path(f"{name}.toml").write_text(
            f'[scene]\nextends = "paper"\n[environment]\ngravity = {gravity}\n'
            '[output]\nsamples_per_cycle = 100\ngroups = ["corners"]\n'
        )
        return f"{name}.toml"

    return make


@pytest.fixture(scope="session")
def kept(tmp_path_factory):
    """Where the first test leaves the baseline and its runs to the others."""
    return tmp_path_factory.mktemp("kept")


@pytest.fixture
def made(scene_file, kept, tmp_path, capsys):
    """A baseline of one scene, and its runs in the cache."""
    scene_file("own")
    if not (kept / "cache").exists():
        assert gate("own.toml", "--update") == 0
        out = capsys.readouterr().out.splitlines()
        assert re.fullmatch(r"own: 3 runs, \d+ checkpoints", out[0])
        assert out[1:] == [str(BASELINE)]
        shutil.copy(BASELINE, kept)
        shutil.copytree(tmp_path / "cache", kept / "cache")
    else:
        shutil.copy(kept / BASELINE, BASELINE)
        shutil.copytree(kept / "cache", tmp_path / "cache")
    return BASELINE
