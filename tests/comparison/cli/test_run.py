"""`sixbar run` with an estimate of its error, and `sixbar settings`. The models are fakes."""

from __future__ import annotations

import json
import shlex
from pathlib import Path

import numpy as np
import pytest

from comparison.accuracy import work_precision
from comparison.accuracy.measured import expected
from comparison.cli import main
from comparison.scene import load_scene
from comparison.tables.table_files import read

pytestmark = pytest.mark.usefixtures("fake_models", "wide")
UNMEASURED = "[clearance]\nslider = 3e-4\n"


def run(path, *options):
    return main(["run", path, "--model", "exudyn", "--formulation", "tree", "--out", "a.csv", "-q", *options])


def record():
    return json.loads(Path("a.json").read_text())["accuracy"]


def test_metres_are_estimated_on_a_scene_that_nobody_measured(scene_file, capsys, fake_models):
    path = scene_file("own", extra=UNMEASURED)
    for _ in range(2):  # then all runs are cached
        assert run(path, "--accuracy", "1e-8") == 0
        assert len(fake_models.read_text().splitlines()) == 5
    first, second, *files = capsys.readouterr().out.splitlines()[:5]
    assert first.startswith("begins at solver.exudyn.tolerance = 1e-08, with 4 further runs: some ")
    assert second.startswith(
        "slider_x is within 1e-08 m on all of the run (solver.exudyn.tolerance = 1e-08; 5 "
    )
    assert files == ["a.events.csv", "a.json", "a.csv"]
    assert (record()["wanted_m"], record()["kept"], record()["coverage"]) == (1e-8, True, 1.0)


@pytest.mark.parametrize("options", [["--no-check"], []])
def test_one_run_without_the_check_or_where_the_scene_was_measured(scene_file, capsys, fake_models, options):
    path = scene_file("own", extra=UNMEASURED) if options else "150rpm-0.2mm"
    assert run(path, "--accuracy", "1e-8", *options) == 0
    said = capsys.readouterr().out
    assert said.startswith("solver.exudyn.tolerance = 1e-08: expected: 2e-09 m of slider_x")
    assert len(fake_models.read_text().splitlines()) == 1
    assert record()["from"] == "measured on 150rpm-0.2mm"
    assert bool(record()["cautions"]) == bool(options)


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


def test_settings_that_are_recommended_run_and_keep_their_error(scene_file, fake_model, capsys):
    path = scene_file("own")
    assert main(["settings", path, "--set", "drive.cycles=1", "--out", "deep/wp.svg", "-q"]) == 0
    *lines, picture = capsys.readouterr().out.splitlines()
    assert "errors of slider_x against reference minimal, tolerance 1e-13, where exudyn tree" in lines[0]
    assert Path(picture).read_text().startswith("<svg")
    pairs = [(line, lines[n + 1]) for n, line in enumerate(lines) if line.endswith("processor time:")]
    assert pairs
    for said, command in pairs:
        smallest = float(said.split(" m on ")[0].split(" to ")[-1])
        assert main([*shlex.split(command)[1:], "-q"]) == 0
        assert "--set drive.cycles=1 " in command
        table = read("own+drive.cycles=1.csv")
        right = fake_model.signals(table.provenance["scene"])["slider_x"]
        assert np.abs(table.values("slider_x") - right).max() <= smallest


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
