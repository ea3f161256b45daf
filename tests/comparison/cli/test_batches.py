"""What is finished survives: an interruption, a fault in one scene, and then the report of the others."""

from __future__ import annotations

import json
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest

from comparison.accuracy.levels import AccuracyError
from comparison.cli import batches, main
from comparison.cli.progress import progress
from comparison.execution.job import MODELS
from comparison.scene import load_scene
from comparison.verdict.results import no_comparison
from comparison.verdict.validate import Validation

pytestmark = pytest.mark.usefixtures("fake_models")


@pytest.fixture
def stop(monkeypatch):
    """Let the validation of a scene raise an error."""

    def at(name: str, error: BaseException) -> None:
        usual = batches.validate

        def validate(scenes, **options):
            if any(scene.name == name for scene in scenes):
                raise error
            return usual(scenes, **options)

        monkeypatch.setattr(batches, "validate", validate)

    return at


def test_an_interruption_leaves_the_report_of_what_is_finished(stop, scene_file, capsys):
    stop("two", KeyboardInterrupt())
    Path("v/tables").mkdir(parents=True)
    Path("v/tables/two-exudyn.csv").write_text("of an earlier call")
    files = [scene_file(name) for name in ("one", "two", "three")]
    assert main(["validate", *files, "--out", "v", "--jobs", "1", "-q"]) == 130
    out, err = capsys.readouterr()
    assert err == "sixbar: interrupted; finished runs are cached\n"
    assert "Incomplete: interrupted after 1 of 3 scenes. Not compared: two, three." in out
    assert out.splitlines()[-1] == "v/report.html"
    summary = json.loads(Path("v/summary.json").read_text())
    assert (summary["exit_code"], summary["not_compared"]) == (130, ["two", "three"])
    assert [scene["name"] for scene in summary["scenes"]] == ["one"]
    assert "(incomplete: 1 of 3 scenes)" in Path("v/report.html").read_text()
    assert "Incomplete: " in Path("v/summary.md").read_text()
    errors = [
        case.get("classname")
        for case in ET.parse("v/junit.xml").iter("testcase")
        if case.find("error") is not None
    ]
    assert len(errors) == 2
    assert Path("v/tables/one-exudyn.csv").is_file()
    assert not Path("v/tables/two-exudyn.csv").exists()


def test_an_interruption_before_anything_is_finished_writes_nothing(stop, scene_file, capsys):
    stop("one", KeyboardInterrupt())
    assert main(["validate", scene_file("one"), "--out", "v"]) == 130
    assert capsys.readouterr().out == ""
    assert not Path("v").exists()


def test_a_fault_in_one_scene_costs_that_scene_alone(stop, scene_file, capsys):
    stop("two", ZeroDivisionError("a\nb"))
    files = [scene_file(name) for name in ("one", "two", "three")]
    assert main(["validate", *files, "--out", "v", "--jobs", "8"]) == 70
    scenes = json.loads(Path("v/summary.json").read_text())["scenes"]
    assert [scene["verdict"] for scene in scenes] == ["agree", "cannot compare", "agree"]
    assert scenes[1]["reason"].startswith(
        "scene 'two': internal error: ZeroDivisionError: a b at test_batches"
    )
    assert "internal error" in Path("v/report.html").read_text()
    assert "three  standard  agree" in capsys.readouterr().out


def test_a_refusal_before_anything_is_finished_is_one_line(stop, scene_file, capsys):
    stop("one", AccuracyError("out of reach"))
    assert main(["validate", scene_file("one"), "--out", "v"]) == 2
    assert capsys.readouterr() == ("", "sixbar: out of reach\n")
    assert not Path("v").exists()


def test_as_many_scenes_at_a_time_as_keep_the_workers_busy_and_the_share_only_grows(monkeypatch):
    scenes = [
        load_scene(name, {"drive.cycles": 1}) for name in ("ideal", "wedge", "crank-pin", "69GPa", "ideal")
    ]
    sizes, shares = [], []

    def validate(batch, *, on_progress, **_):
        sizes.append(len(batch))
        for share in (0.0, 1.0, 0.2):  # an ensemble starts anew
            on_progress(share)
        return [
            Validation(no_comparison(scene, "none", labels=MODELS, command="", tier="standard"), {})
            for scene in batch
        ]

    monkeypatch.setattr(batches, "validate", validate)
    with progress("", quiet=True) as report:
        monkeypatch.setattr(type(report), "__call__", lambda _, share: shares.append(share))
        found = batches.validate_batches(scenes, models=MODELS, n_jobs=4, accuracy=None, report=report)
    assert sizes == [2, 2, 1]
    assert [result.comparison.name for result in found.results] == [scene.name for scene in scenes]
    assert shares == sorted(shares)
    assert shares[-1] == pytest.approx(1.0)


def test_changed_keys_reach_the_runs_and_the_commands_on_record(scene_file):
    options = ["--set", "drive.cycles=1", "--set", "drive.speed_rpm=140"]
    assert main(["validate", scene_file("one"), "--out", "v", "-q", *options]) == 0
    summary = json.loads(Path("v/summary.json").read_text())
    (scene,) = summary["scenes"]
    command = f"sixbar validate {scene_file('one')} --set drive.cycles=1 --set drive.speed_rpm=140"
    assert summary["command"] == scene["command"] == scene["tight"]["command"] == command
    assert scene["provenance"]["exudyn"]["scene"]["drive"]["speed_rpm"] == 140
