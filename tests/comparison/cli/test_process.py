"""The command line as a process: interruption, closed pipes, what it imports, errors nobody foresaw."""

from __future__ import annotations

import os
import subprocess
import sys
from importlib.resources import files
from pathlib import Path

import pytest

from comparison.cli import main

pytestmark = pytest.mark.usefixtures("fake_models")
ROOT = Path(str(files("comparison"))).parent


def process(*arguments: str, **options) -> subprocess.Popen[str]:
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([*sys.path[:1], str(ROOT)])}
    return subprocess.Popen(
        [sys.executable, "-m", "comparison", *arguments],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment, **options,
    )  # fmt: skip


def test_an_unforeseen_error_is_one_line_with_what_to_report(monkeypatch, capsys):
    def broken():
        raise ZeroDivisionError("a\nb")

    monkeypatch.setattr("comparison.scene.shipped_scenes", broken)
    assert main(["scenes"]) == 70
    err = capsys.readouterr().err
    assert "internal error: ZeroDivisionError: a b at test_process.py:" in err
    assert "please report" in err
    assert err.count("\n") == 1


def test_help_imports_nothing_heavy():
    """And so is quick: 0.15 s where it was written."""
    code = "import sys; from comparison.cli import main; main(['--help']); print(*sys.modules)"
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    out = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, env=environment
    ).stdout
    assert "validate" in out
    loaded = set(out.splitlines()[-1].split())
    assert not loaded & {"numpy", "pandas", "scipy", "pydantic", "matplotlib", "rich", "numba", "exudyn"}
    assert len(loaded) < 400  # 156 where it was written


def test_plan_tells_what_is_integrated_and_what_is_left_out(capsys):
    assert main(["plan", "150rpm-0.2mm", "--set", "solver.exudyn.formulation=auto"]) == 0
    out = capsys.readouterr().out
    assert out.startswith("150rpm-0.2mm+solver.exudyn.formulation=auto: 2 cycles at 150 rpm, 21 channels\n")
    assert "reference: minimal: rod 4 and slider (2 coordinates)\n" in out
    assert "exudyn: rod 4 and slider tree\n" in out
    assert out.count("  left out    contact at the crank pin: joints.crank_pin is ideal\n") == 2
    assert "  instead     solver.exudyn.formulation = 'full': all five bodies" in out
    assert main(["plan", "ideal"]) == 0
    assert "  integrates  nothing: no degree of freedom besides the drive\n" in capsys.readouterr().out
    assert main(["plan", "nowhere"]) == 2
    assert capsys.readouterr().err.count("\n") == 1
