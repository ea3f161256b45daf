"""What is printed: it fits, and says how far the work is; sizes of files; commands of a report."""

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
from comparison.cli.console import SILENCE, Lines
from comparison.files import LARGEST_TEXT
from comparison.scene import load_scene, parse_set
from comparison.scene.loading import LARGEST_FILE
from comparison.studies.sweep import LARGEST_LIST
from comparison.tables.table_files import LARGEST

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


def test_progress_in_a_log_is_few_lines(capsys):
    """Half a percent a second: a line for every tenth. Ten minutes for 6 %: neither silent nor loud."""
    now = [100.0]

    def lines(shares):
        report = Lines("campaign", lambda: now[0])
        for share in shares:
            now[0] += 1.0
            report(share)
        return capsys.readouterr().err.splitlines()

    result = lines((step + 1) / 200 for step in range(200))
    assert result[0] == "sixbar: campaign: 10%, about 3 min left"
    assert result[-1] == "sixbar: campaign: 90%, less than a minute left"
    assert len(result) == 9
    assert len(lines(step / 10_000 for step in range(600))) == 600 / SILENCE


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


COMPARE, SOUND = "compare {} sound.csv", "compare sound.csv sound.csv"


@pytest.mark.parametrize(
    ("name", "command", "most"),
    [
        ("own.toml", "plan {}", LARGEST_FILE),
        ("map.toml", f"{SOUND} --mapping {{}}", LARGEST_TEXT),
        ("baseline.toml", "gate --baseline {}", LARGEST_TEXT),
        *((name, COMPARE, LARGEST) for name in ("own.csv", "own.parquet", "own.mat")),
        ("own.parquet", "plot {}", LARGEST),
        ("list.csv", "study sweep ideal --list {}", LARGEST_LIST),
    ],
)
def test_a_file_that_is_too_large_is_refused_before_it_is_read(name, command, most, capsys):
    Path("sound.csv").write_text("time,x\n0,1\n1,2\n2,4\n")
    Path(name).touch()
    os.truncate(name, most + 1)  # zeros, which take no space on the disk
    assert main(command.format(name).split()) == 2
    out, err = capsys.readouterr()
    assert (out, err.count("\n")) == ("", 1)
    assert name in err
    assert f"is larger than {most} bytes" in err


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
