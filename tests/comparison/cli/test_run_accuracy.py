"""``sixbar run`` with an estimate of the error: what is said, written and returned. The models are fakes."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from comparison.cli import main

pytestmark = pytest.mark.usefixtures("fake_models", "wide")


def run(path, *options, model="exudyn"):
    return main(["run", path, "--model", model, "--formulation", "tree", "--out", "a.csv", "-q", *options])


def record():
    return json.loads(Path("a.json").read_text())["accuracy"]


def test_metres_are_estimated_on_a_scene_that_nobody_measured(scene_file, capsys, fake_models):
    path = scene_file("own", extra="[clearance]\nslider = 3e-4\n")
    assert run(path, "--accuracy", "1e-8") == 0
    said = capsys.readouterr().out.splitlines()
    assert said[0].startswith("begins at solver.exudyn.tolerance = 1e-08, with 4 further runs: some ")
    assert said[1].startswith(
        "slider_x is within 1e-08 m on all of the run (solver.exudyn.tolerance = 1e-08; 5 "
    )
    assert said[2:] == ["a.events.csv", "a.json", "a.csv"]
    assert len(fake_models.read_text().splitlines()) == 5
    assert (record()["wanted_m"], record()["kept"], record()["coverage"]) == (1e-8, True, 1.0)
    assert run(path, "--accuracy", "1e-8") == 0  # all runs are cached
    assert len(fake_models.read_text().splitlines()) == 5


@pytest.mark.parametrize("options", [["--no-check"], []])
def test_one_run_without_the_check_or_where_the_scene_was_measured(scene_file, capsys, fake_models, options):
    path = scene_file("own", extra="[clearance]\nslider = 3e-4\n") if options else "150rpm-0.2mm"
    assert run(path, "--accuracy", "1e-8", *options) == 0
    said = capsys.readouterr().out
    assert said.startswith("solver.exudyn.tolerance = 1e-08: expected: 2e-09 m of slider_x")
    assert len(fake_models.read_text().splitlines()) == 1
    assert record()["from"] == "measured on 150rpm-0.2mm"
    assert bool(record()["cautions"]) == bool(options)


@pytest.mark.parametrize(("what", "code"), [("fail", 2), ("crash", 70), ("refuse", 2)])
def test_where_no_run_succeeds_it_fails_as_a_single_one_does(scene_file, gravity, capsys, what, code):
    assert run(scene_file("own", getattr(gravity, what)), "--accuracy", "1e-8") == code
    err = capsys.readouterr().err
    assert err.count("\n") == 1
    assert [path.name for path in sorted(Path.cwd().iterdir())] == (
        ["a.partial.csv", "a.partial.events.csv", "a.partial.json"] if what == "fail" else []
    )


def test_a_plain_run_says_where_its_error_was_not_measured(scene_file, capsys):
    assert run(scene_file("own", extra="[clearance]\nslider = 3e-4\n")) == 0
    err = capsys.readouterr().err
    assert (
        err.count("was not measured on this scene (on 150rpm-0.2mm it is 3e-11 m): estimate it by --check")
        == 1
    )
    own = scene_file("own", extra="[clearance]\nslider = 3e-4\n")
    for options in (["150rpm-0.2mm"], [own, "--check"], [own, "--no-check"]):
        assert run(*options) == 0
        assert "not measured" not in capsys.readouterr().err
