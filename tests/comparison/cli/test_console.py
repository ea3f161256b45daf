"""What is printed fits, and what a report tells to do repeats its scene."""

import html
import os
import re
import shlex
import subprocess
import sys
from importlib.resources import files
from pathlib import Path

import pytest

from comparison.cli import main
from comparison.scene import load_scene, parse_set

pytestmark = pytest.mark.usefixtures("elsewhere")
ROOT = Path(str(files("comparison"))).parent
STILL = [
    "", "-h", "scenes", "channels", "plan both-clearances", "study", "study sweep -h",
    *(f"{command} -h" for command in ("run", "validate", "compare", "gate", "plot", "animate")),
]  # fmt: skip


@pytest.mark.parametrize("columns", [60, 120, None])  # None: a pipe
def test_commands_that_run_nothing_fit_the_terminal(columns, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", str(columns or ""))
    for arguments in STILL:
        assert main(arguments.split()) == 0
        out, err = capsys.readouterr()
        # A path must not be broken.
        long = [line for line in out.splitlines() if len(line) > (columns or 80) and not Path(line).exists()]
        assert (long, err) == ([], "")
        assert "\x1b" not in out
        assert len(out.splitlines()) > 8


RUN = ["run", "ideal", "--set=drive.cycles=0.1", "--model=reference", "--out=a.csv"]
RUN.append('--set=output.groups=["accelerations", "joints", "energy"]')
HEAVY = {"pandas", "scipy", "numba", "exudyn", "matplotlib", "rich"}


@pytest.mark.parametrize(("arguments", "heavy"), [(["--help"], {*HEAVY, "numpy", "pydantic"}), (RUN, HEAVY)])
def test_a_command_imports_nothing_heavy_that_it_does_not_need(arguments, heavy):
    """And so is quick: help takes 0.15 s where it was written."""
    code = f"import sys; from comparison.cli import main; main({arguments}); print(*sys.modules)"
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    ended = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, check=True)
    loaded = set(ended.stdout.decode().splitlines()[-1].split())
    assert "comparison.cli.compare" in loaded
    assert not loaded & heavy


# Commands of a report


@pytest.fixture
def validate(capsys, fake_models, monkeypatch):
    """Validate by one worker; return the exit code, and the commands that the page shows."""
    del fake_models
    monkeypatch.setenv("COLUMNS", "2000")

    def validated(*arguments):
        code = main(["validate", "--jobs", "1", "--quick", "-q", *arguments])
        page = Path(capsys.readouterr().out.splitlines()[-1]).read_text()
        lines = map(str.strip, html.unescape(re.sub(r"<[^>]+>", "\n", page)).splitlines())
        return code, list(dict.fromkeys(line for line in lines if line.startswith("sixbar ")))

    return validated


def test_each_command_of_the_report_repeats_the_changed_scene(gravity, validate):
    Path("my scenes").mkdir()
    text = '[scene]\nextends = "paper"\n[output]\nsamples_per_cycle = 100\n[drive]\ncycles = 1\n'
    path = "my scenes/own.toml"
    Path(path).write_text(text)
    changes = [f"environment.gravity={gravity.differ}", "mechanism.rocker_pivot=[0.2568, 0.21]"]
    options = [word for change in changes for word in ("--set", change)]
    code, (own, *advice) = validate(path, *options)
    asked = load_scene(path, parse_set(changes))
    assert own == asked.command("validate", "--quick")
    assert (code, len(advice)) == (1, 3)
    for command in advice:
        _, verb, source, *options = shlex.split(command)
        if verb == "compare":
            assert main([verb, source, *options]) in (1, 3)
            continue
        again = load_scene(source, parse_set(options[1 : options.index("--model") : 2]))
        for section in ("environment", "mechanism", "drive"):
            assert again.data[section] == asked.data[section]
        assert main([verb, source, *options, "-q"]) == 0
