"""`sixbar run` with an estimate of its error, and `sixbar settings`. The models are fakes."""

from __future__ import annotations

from pathlib import Path

import pytest

from comparison.accuracy import work_precision
from comparison.accuracy.measured import expected
from comparison.cli import main
from comparison.scene import load_scene
from comparison.tables.table_files import read

pytestmark = pytest.mark.usefixtures("fake_models", "wide")


def run(path, *options):
    return main(["run", path, "--model", "exudyn", "--formulation", "tree", "--out", "a.csv", "-q", *options])


@pytest.mark.parametrize(("what", "code"), [("fail", 2), ("crash", 70), ("refuse", 2)])
def test_where_no_run_succeeds_it_fails_as_a_single_one_does(scene_file, gravity, capsys, what, code):
    assert run(scene_file("own", getattr(gravity, what)), "--accuracy", "1e-8") == code
    assert capsys.readouterr().err.count("\n") == 1
    left = ["a.partial.csv", "a.partial.events.csv", "a.partial.json"] if what == "fail" else []
    assert sorted(path.name for path in Path.cwd().iterdir()) == left


def test_accuracy_is_that_of_the_formulation(scene_file):
    path = scene_file("own")
    tree = load_scene(path, {"solver.exudyn.formulation": "tree", "solver.exudyn.tolerance": 1e-9})
    assert run(path, "--accuracy", str(expected(tree, "exudyn").error), "--no-check") == 0
    solver = read("a.csv").provenance["scene"]["solver"]["exudyn"]
    assert (solver["formulation"], solver["tolerance"], solver["step"]) == ("tree", 1e-9, 1e-4)


def test_settings_that_are_measured_are_recommended_and_drawn(scene_file, capsys):
    assert main(["settings", scene_file("own"), "--set", "drive.cycles=1", "--out", "deep/wp.svg", "-q"]) == 0
    *lines, picture = capsys.readouterr().out.splitlines()
    assert "errors of slider_x against reference minimal, tolerance 1e-13, where exudyn tree" in lines[0]
    drawn = Path(picture).read_text()
    assert all(
        f">{model}</text>" in drawn for model in ("Pareto front", "reference, minimal", "exudyn, tree")
    )
    commands = [line for line in lines if line.startswith("  sixbar run ")]
    assert commands
    assert all("--set drive.cycles=1 " in command for command in commands)


def test_without_time_nothing_is_known_of_settings_and_an_interrupt_prints_what_is(
    scene_file, monkeypatch, capsys
):
    assert main(["settings", scene_file("own"), "--seconds", "1e-9", "-q"]) == 0
    heading, _, *rows = capsys.readouterr().out.splitlines()
    assert heading == "no two runs have a result: errors are unknown"
    assert {row.split("  ")[-1].strip() for row in rows} == {"not begun"}

    def interrupted(attempt, tasks, *_, **__):
        for number, (name, task) in enumerate(tasks):
            if number == 5:
                raise KeyboardInterrupt
            yield name, attempt(task, lambda _: None)

    monkeypatch.setattr(work_precision, "work", interrupted)
    assert main(["settings", scene_file("own"), "-q"]) == 130
    out, err = capsys.readouterr()
    assert err == "sixbar: interrupted; the other settings were not measured\n"
    assert "1e-13" in out.split("not begun")[0]
