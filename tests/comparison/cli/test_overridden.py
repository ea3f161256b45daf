"""Scenes that --set changes: what is written about them, where, and the commands. The models are fakes."""

from __future__ import annotations

import html
import json
import re
import shlex
import shutil
from pathlib import Path

import pytest

from comparison.cli import main
from comparison.formatting import number
from comparison.scene import load_scene, parse_set

pytestmark = pytest.mark.usefixtures("fake_models", "wide")


def commands(text: str) -> list[str]:
    """Return the lines of a page or of the console that are commands."""
    plain = html.unescape(re.sub(r"<[^>]+>", "\n", text))
    return [line.strip() for line in plain.splitlines() if line.strip().startswith("sixbar ")]


@pytest.mark.parametrize(("what", "count"), [("differ", 3), ("fail", 1), ("crash", 1)])
def test_each_command_of_the_report_repeats_the_changed_scene(what, count, gravity, scene_file, capsys):
    Path("my scenes").mkdir()
    path = shutil.copy(scene_file("own", extra="[drive]\ncycles = 1\n"), "my scenes")
    changes = [f"environment.gravity={getattr(gravity, what)}", "mechanism.rocker_pivot=[0.2568, 0.21]"]
    options = [word for change in changes for word in ("--set", change)]
    code = main(["validate", path, "--quick", "-q", *options])
    page = Path(capsys.readouterr().out.splitlines()[-1])
    asked = load_scene(path, parse_set(changes))
    own, *advice = dict.fromkeys(commands(page.read_text()))
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
    options = ["--set", "drive.cycles=1", "--quick", "-q"]
    assert main(["validate", path, *options]) == 3
    page = Path(capsys.readouterr().out.splitlines()[-1])
    finer = load_scene(path, {"drive.cycles": 1}).command("validate", "--quick", "--accuracy", "strict")
    assert finer in commands(page.read_text())
    assert main([*shlex.split(finer)[1:], "-q"]) == 0


def test_one_ratio_on_the_console_in_the_report_and_in_the_files(scene_file, gravity, capsys):
    """The rule's: what 99 % of the judged samples stay within. The maximum is called so."""
    for name, value in (("good", gravity.normal), ("bad", gravity.differ)):
        main(["validate", scene_file(name, value), "--quick", "--out", name])
        heading, line, *_ = capsys.readouterr().out.splitlines()
        start = heading.index("|E|/2u (99%)")
        shown = line[start : start + 12].strip()
        (scene,) = json.loads(Path(name, "summary.json").read_text())["scenes"]
        assert number(scene["ratio"], 2) == shown
        assert (scene["ratio"] <= 1) == (scene["verdict"] == "agree")
        assert max(each["ratio"] or 0.0 for each in scene["channels"].values()) == scene["ratio"]
        assert f"{scene['decisive_channel']}, |E|/2u (99%) = {shown}: " in scene["reason"]
        page = Path(name, "report.html").read_text()
        assert f"<b>{shown}</b>" in page
        assert f"|E|/2u (99%) is {shown}, the maximum " in page
