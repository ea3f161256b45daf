"""What commands do that the black-box tests of tests/cli cannot ask: faults, batches, changed scenes.

The models are fakes.
"""

import html
import json
import re
import shlex
import shutil
from pathlib import Path

import pytest

from comparison.cli import main
from comparison.scene import load_scene, parse_set
from comparison.verdict import validate as judge

pytestmark = pytest.mark.usefixtures("fake_models", "wide")


def summary(folder="v"):
    return json.loads(Path(folder, "summary.json").read_text())["scenes"]


def validate(*arguments):
    """One worker: starting another costs more than the fakes' runs."""
    return main(["validate", "--jobs", "1", *arguments])


def last_page(capsys):
    return Path(capsys.readouterr().out.splitlines()[-1])


def commands(page):
    """Return the lines of a page that are commands."""
    plain = html.unescape(re.sub(r"<[^>]+>", "\n", page.read_text()))
    return [line.strip() for line in plain.splitlines() if line.strip().startswith("sixbar ")]


# ---- validate


@pytest.mark.parametrize(("what", "count"), [("differ", 3), ("fail", 1), ("crash", 1)])
def test_each_command_of_the_report_repeats_the_changed_scene(what, count, gravity, scene_file, capsys):
    Path("my scenes").mkdir()
    path = shutil.copy(scene_file("own", extra="[drive]\ncycles = 1\n"), "my scenes")
    changes = [f"environment.gravity={getattr(gravity, what)}", "mechanism.rocker_pivot=[0.2568, 0.21]"]
    options = [word for change in changes for word in ("--set", change)]
    code = validate(path, "--quick", "-q", *options)
    asked = load_scene(path, parse_set(changes))
    own, *advice = dict.fromkeys(commands(last_page(capsys)))
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


def test_an_indeterminate_scene_is_looked_at_again_at_finer_settings(scene_file, capsys):
    path = scene_file("coarse", extra="[solver.exudyn]\nstep = 1e-3\n")
    assert validate(path, "--set", "drive.cycles=1", "--quick", "-q") == 3
    finer = load_scene(path, {"drive.cycles": 1}).command("validate", "--quick", "--accuracy", "strict")
    assert finer in commands(last_page(capsys))
    assert validate(*shlex.split(finer)[2:], "-q") == 0


def test_a_fault_in_one_scene_costs_that_scene_alone(scene_file, monkeypatch, capsys):
    usual = judge.validate

    def faulty(scenes, **options):
        if any(scene.name == "two" for scene in scenes):
            raise ZeroDivisionError("a\nb")
        return usual(scenes, **options)

    monkeypatch.setattr(judge, "validate", faulty)
    files = [scene_file(name) for name in ("one", "two", "three")]
    assert validate(*files, "--quick", "--out", "v", "--jobs", "8") == 70
    assert [scene["verdict"] for scene in summary()] == ["agree", "cannot compare", "agree"]
    reason = "scene 'two': internal error: ZeroDivisionError: a b at test_commands"
    assert summary()[1]["reason"].startswith(reason)
    assert "internal error" in Path("v/report.html").read_text()
    assert "three  standard  agree" in capsys.readouterr().out
