"""Streams and names from outside: closed, full, in another encoding, with control characters."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from importlib.resources import files
from pathlib import Path

import pytest

from comparison.cli import main
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


@pytest.mark.parametrize("closed", [0, 1, 2])
@pytest.mark.parametrize(("arguments", "code"), [(["scenes"], 0), (["plan", "nowhere"], 2)])
def test_a_stream_that_is_closed_changes_no_exit_code(closed, arguments, code):
    ended = sixbar(*arguments, preexec_fn=lambda: os.close(closed))
    assert ended.returncode == code
    assert bool(ended.stdout) == (code == 0 and closed != 1)
    assert bool(ended.stderr) == (code == 2 and closed != 2)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a device that is full")
def test_a_full_disk_behind_stdout_is_one_line():
    with open("/dev/full", "w") as full:  # noqa: PTH123
        ended = subprocess.run(
            [sys.executable, "-m", "comparison", "scenes"],
            env=os.environ | {"PYTHONPATH": str(ROOT)}, stdout=full, stderr=subprocess.PIPE, text=True,
            check=False,
        )  # fmt: skip
    assert ended.returncode == 2
    assert "No space left on device" in ended.stderr
    assert "internal error" not in ended.stderr


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


def test_headers_keys_and_names_cannot_colour_a_terminal(tmp_path, capsys, make_table):
    make_table().frame.rename(columns={"slider_x": "\x1b[31mx"}).to_csv(tmp_path / "a.csv", index=False)
    (tmp_path / "key.toml").write_text('[scene]\nextends = "paper"\n[drive]\n"\\u001b[2J" = 1\n')
    for arguments in (
        ["compare", str(tmp_path / "a.csv"), str(tmp_path / "a.csv")],
        ["plan", str(tmp_path / "key.toml")],
        ["plan", "\x1b]0;title\x07"],
        ["\x1b[31m"],
        ["plan", "ideal", "--\x1b[31m"],
    ):
        main(arguments)
        out, err = capsys.readouterr()
        assert out + err
        assert "\x1b" not in out + err


def test_a_name_that_is_not_utf8_is_refused_in_one_line(tmp_path):
    name = os.fsencode(tmp_path) + b"/\xff.toml"
    Path(os.fsdecode(name)).write_text('[scene]\nextends = "paper"\n')
    ended = sixbar("plan", os.fsdecode(name))
    assert ended.returncode == 2
    assert r"\udcff.toml: is not UTF-8" in ended.stderr
    assert ended.stderr.count("\n") == 1


def test_a_working_directory_that_is_gone_is_one_line(tmp_path):
    gone = tmp_path / "gone"
    gone.mkdir()
    ended = sixbar("scenes", cwd=gone, code="import os; os.rmdir(os.getcwd())")
    assert ended.returncode == 2
    assert ended.stderr == "sixbar: the working directory does not exist any more, or cannot be read\n"


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
