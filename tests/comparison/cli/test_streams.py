"""Streams and names from outside: closed, full, in another encoding, with control characters."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from importlib.resources import files
from pathlib import Path

import pytest

from comparison.cli.console import printable

ROOT = Path(str(files("comparison"))).parent


def sixbar(*arguments: str, code: str = "", **options) -> subprocess.CompletedProcess[str]:
    """Run a command in a process that runs ``code`` first."""
    environment = os.environ | {"PYTHONPATH": str(ROOT)} | options.pop("env", {})
    start = f"{code}\nimport sys\nfrom comparison.cli import main\nsys.exit(main())"
    return subprocess.run(
        [sys.executable, "-c", start, *arguments],
        env=environment, capture_output=True, text=True, check=False, **options,
    )  # fmt: skip


def test_what_a_terminal_s_encoding_lacks_is_escaped(tmp_path):
    (tmp_path / "own.toml").write_text('[scene]\nextends = "paper"\ntitle = "✓"\n')
    code = "import comparison.scene\ncomparison.scene.shipped_scenes = lambda: ['own.toml']"
    ended = sixbar("scenes", code=code, cwd=tmp_path, env={"PYTHONIOENCODING": "latin-1"})
    assert (ended.returncode, ended.stderr) == (0, "")
    assert ended.stdout.endswith("\\u2713\n")


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("a\x1b[31mred\x07", r"a\x1b[31mred\x07"),
        ("name\u202egpj.exe", r"name\u202egpj.exe"),
        ("9\u00a0µm ✓\n\t|", "9\u00a0µm ✓\n\t|"),
        ("\udcff", r"\udcff"),
    ],
)
def test_control_characters_are_shown_not_obeyed(text, shown):
    assert printable(text) == shown


def test_warnings_of_python_are_not_the_users_business_unless_asked_for(tmp_path):
    code = (
        "import warnings, comparison.scene\n"
        "def noisy():\n    warnings.warn('overflow', RuntimeWarning)\n    return []\n"
        "comparison.scene.shipped_scenes = noisy"
    )
    assert sixbar("scenes", code=code, cwd=tmp_path).stderr == ""
    assert "overflow" in sixbar("scenes", code=code, cwd=tmp_path, env={"PYTHONWARNINGS": "default"}).stderr


@pytest.mark.parametrize("module", ["typer", "comparison.scene", "comparison.cli.console"])
def test_an_interruption_while_modules_are_imported_ends_with_130_in_one_line(module):
    code = f"""
import builtins, os, signal
signal.signal(signal.SIGINT, signal.default_int_handler)
usual = builtins.__import__
def importing(name, *rest):
    if name == {module!r}:
        builtins.__import__ = usual
        os.kill(os.getpid(), signal.SIGINT)
    return usual(name, *rest)
builtins.__import__ = importing
"""
    ended = sixbar("scenes", code=code, preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL))
    assert ended.returncode == 130
    assert ended.stderr.startswith("sixbar: interrupted")
    assert ended.stderr.count("\n") == 1
