"""What is printed: it fits, is escaped, says how far the work is; sizes of files; commands of a report."""

import html
import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
from importlib.resources import files
from pathlib import Path

import pytest

from comparison.cli import console, main
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


@pytest.fixture(params=[60, 80, 120, None])
def columns(request, monkeypatch):
    """Columns of the terminal; None: a pipe."""
    monkeypatch.setenv("COLUMNS", str(request.param or ""))
    return request.param or 80


def too_long(text, columns):
    """Lines that do not fit, but for those that are a path, which must not be broken."""
    return [line for line in text.splitlines() if len(line) > columns and not Path(line).exists()]


def test_commands_that_run_nothing_fit_the_terminal(columns, capsys):
    for arguments in STILL:
        assert main(arguments.split()) == 0
        out, err = capsys.readouterr()
        assert (too_long(out, columns), err) == ([], "")
        assert "\x1b" not in out
        assert len(out.splitlines()) > 8


def test_only_the_last_text_is_cut_and_paths_are_not_broken(monkeypatch):
    rows = [("name", "value", "note"), ("first", "12345678", "a long explanation"), ("b", "1", "")]
    for width, cut in ((40, "a long explanation"), (30, "a long exp..."), (12, "a long ex...")):
        monkeypatch.setenv("COLUMNS", str(width))
        shown = ["name      value  note", f"first  12345678  {cut}", "b             1"]
        assert console.columns(rows, right=(1,)) == shown
    path = "a-folder/of-a/long-name/with-hyphens-and/more-of-it.csv"
    assert console.wrapped(f"a table of the scene is in {path}") == ["a table of the scene is in", path]


def test_control_characters_are_shown_not_obeyed():
    assert console.printable("a\x1b[31m\x07 \u202egpj \udcff") == r"a\x1b[31m\x07 \u202egpj \udcff"
    assert console.printable("9\u00a0µm ✓\n\t|") == "9\u00a0µm ✓\n\t|"


def lines(capsys, reports):
    """What is printed of reports, each (seconds since the last one, share, what was finished)."""
    now = [100.0]
    report = Lines("campaign", lambda: now[0])
    for seconds, share, what in reports:
        now[0] += seconds
        report(share, what)
    return capsys.readouterr().err.splitlines()


def test_progress_in_a_log_is_few_lines(capsys):
    # Half a percent a second: a line for every tenth.
    result = lines(capsys, [(1.0, (step + 1) / 200, "") for step in range(200)])
    assert result[0] == "sixbar: campaign: 10%, about 3 min left"
    assert result[-1] == "sixbar: campaign: 90%, less than a minute left"
    assert len(result) == 9
    # Ten minutes for 6 %: neither silent nor loud.
    assert len(lines(capsys, [(1.0, step / 10_000, "") for step in range(600)])) == 600 / SILENCE
    # What was finished is a line, at most one in the interval, and none at the end.
    result = lines(capsys, [(11.0, 0.25, "s1"), (1.0, 0.5, "s2"), (11.0, 0.75, "s3"), (11.0, 1.0, "s4")])
    assert [line.partition("; ")[2] for line in result] == ["s1", "s3"]
    # Cached runs are there at once: 0.1 a minute, four more.
    assert "60%, about 4 min left" in lines(capsys, [(0.0, 0.5, ""), (60.0, 0.6, "")])[0]


def test_help_imports_nothing_heavy():
    """And so is quick: 0.15 s where it was written."""
    code = "import atexit, sys\natexit.register(lambda: print(*sys.modules))\n"
    code += "from comparison.cli import main\nsys.exit(main())"
    command = [sys.executable, "-c", code, "--help"]
    ended = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    loaded = set(ended.stdout.splitlines()[-1].split())
    assert "comparison.cli.compare" in loaded
    assert not loaded & {"numpy", "pandas", "scipy", "pydantic", "matplotlib", "rich", "numba", "exudyn"}


def test_an_unforeseen_error_says_where_and_what_to_report():
    with pytest.raises(ZeroDivisionError) as error:
        print(1 / 0)  # noqa: T201
    message, code = console.describe_error(error.value)
    assert "internal error: ZeroDivisionError: division by zero at test_console.py:" in message
    assert ("please report" in message, code) == (True, 70)


def test_an_interrupt_while_files_are_written_comes_when_they_are():
    written = []

    def write():
        with console.uninterrupted():
            os.kill(os.getpid(), signal.SIGINT)
            written.append("all")

    # What runs in the background ignores SIGINT.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt):
            write()
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    finally:
        signal.signal(signal.SIGINT, before)
    assert written == ["all"]


COMPARE, SOUND = "compare {} sound.csv", "compare sound.csv sound.csv"
TOO_LARGE = [
    ("own.toml", "plan {}", LARGEST_FILE),
    ("map.toml", f"{SOUND} --mapping {{}}", LARGEST_TEXT),
    ("baseline.toml", "gate --baseline {}", LARGEST_TEXT),
    *((name, COMPARE, LARGEST) for name in ("own.csv", "own.txt", "own.parquet", "own.mat")),
    ("own.parquet", "plot {}", LARGEST),
    ("own.csv", "animate {} --scene ideal", LARGEST),
    ("list.csv", "study sweep ideal --list {}", LARGEST_LIST),
]


@pytest.mark.parametrize(("name", "command", "most"), TOO_LARGE)
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


def scene_file(name, extra):
    text = '[scene]\nextends = "paper"\n[output]\nsamples_per_cycle = 100\n'
    Path(f"{name}.toml").write_text(text + extra)
    return f"{name}.toml"


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


@pytest.mark.parametrize(("what", "count"), [("differ", 3), ("fail", 1), ("crash", 1)])
def test_each_command_of_the_report_repeats_the_changed_scene(what, count, gravity, validate, capsys):
    Path("my scenes").mkdir()
    path = shutil.copy(scene_file("own", "[drive]\ncycles = 1\n"), "my scenes")
    changes = [f"environment.gravity={getattr(gravity, what)}", "mechanism.rocker_pivot=[0.2568, 0.21]"]
    options = [word for change in changes for word in ("--set", change)]
    code, (own, *advice) = validate(path, *options)
    asked = load_scene(path, parse_set(changes))
    assert own == asked.command("validate", "--quick")
    assert len(advice) == count
    for command in advice:
        _, verb, source, *options = shlex.split(command)
        if verb == "compare":
            assert main([verb, source, *options]) in (1, 3)
            continue
        again = load_scene(source, parse_set(options[1 : options.index("--model") : 2]))
        for section in ("environment", "mechanism", "drive"):
            assert again.data[section] == asked.data[section]
        # The run that failed fails again; each other one is made.
        assert main([verb, source, *options, "-q"]) == (code if what != "differ" else 0)
    if what != "differ":
        assert capsys.readouterr().err.count("did not succeed") == 1


def test_an_indeterminate_scene_is_looked_at_again_at_finer_settings(validate):
    path = scene_file("coarse", "[solver.exudyn]\nstep = 1e-3\n")
    code, commands = validate(path, "--set", "drive.cycles=1")
    finer = load_scene(path, {"drive.cycles": 1}).command("validate", "--quick", "--accuracy", "strict")
    assert (code, finer in commands) == (3, True)
    assert main([*shlex.split(finer)[1:], "-q", "--jobs", "1"]) == 0
