"""The command line: exit codes, one-line errors, nothing half-written. The models are fakes."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from comparison.accuracy.measured import expected
from comparison.cli import main
from comparison.scene import load_scene
from comparison.tables.table_files import read
from comparison.verdict.shipped import Departure

pytestmark = pytest.mark.usefixtures("fake_models")


@pytest.mark.parametrize(
    ("options", "said"),
    [([], True), (["--accuracy", "draft"], False), (["--models", "exudyn,reference"], False)],
)
def test_validate_says_last_where_a_verdict_is_not_the_one_on_record(options, said, capsys, monkeypatch):
    """Of the scenes as they are shipped at their own settings: with others verdicts may well be others."""
    monkeypatch.setattr(
        "comparison.verdict.shipped.departures",
        lambda scenes, *_: [Departure(scenes[0].name, "tight", "agree", "differ")],
    )
    assert main(["validate", "ideal", "--out", "v", *options]) == 0
    *_, before, page = capsys.readouterr().out.splitlines()
    assert Path(page).is_file()
    assert ("ideal, tight: agree, not differ" in before) == said


def error_bound(path, **solver):
    """Return the error bound of Exudyn at these settings, as text for --accuracy."""
    scene = load_scene(path, {f"solver.exudyn.{key}": value for key, value in solver.items()})
    return str(expected(scene, "exudyn").error)


def test_accuracy_and_set_reach_the_model(scene_file, capsys):
    path = scene_file("own")
    metres = error_bound(path, step=5e-7)
    for options in (["--accuracy", "strict"], ["--accuracy", metres], ["--set", "solver.exudyn.step=5e-7"]):
        assert main(["run", path, "--model", "exudyn", "--out", "a.csv", *options]) == 0
        assert read("a.csv").provenance["scene"]["solver"]["exudyn"]["step"] == 5e-7
        reported = capsys.readouterr().out
        said = " ".join(reported.split())
    assert (f"solver.exudyn.step = 5e-07: expected: {float(metres):.2g} m of slider_x" in said) == (
        "--accuracy" in options
    )


def test_accuracy_is_that_of_the_formulation(scene_file):
    path = scene_file("own")
    options = ["--formulation", "tree", "--accuracy", error_bound(path, formulation="tree", tolerance=1e-9)]
    assert main(["run", path, "--model", "exudyn", "--out", "a.csv", *options]) == 0
    solver = read("a.csv").provenance["scene"]["solver"]["exudyn"]
    assert (solver["formulation"], solver["tolerance"], solver["step"]) == ("tree", 1e-9, 1e-4)


def test_validate_writes_report_summary_and_tables(scene_file, capsys):
    assert main(["validate", scene_file("one"), scene_file("two", 9.0), "--out", "v", "--jobs", "2"]) == 0
    heading, *lines = capsys.readouterr().out.splitlines()
    assert heading.split()[:4] == ["scene", "tier", "verdict", "coverage"]
    assert [line.split()[:3] for line in lines[:-2]] == [
        [name, tier, "agree"] for name in ("one", "two") for tier in ("standard", "tight")
    ]
    assert lines[-2] == "At the standard tier all 2 agree; at the tight tier all 2 agree."
    assert Path(lines[-1]).is_file()
    assert Path(lines[-1]).suffix == ".html"
    summary = json.loads(Path("v/summary.json").read_text())
    assert summary["exit_code"] == 0
    assert [scene["verdict"] for scene in summary["scenes"]] == ["agree", "agree"]
    assert summary["scenes"][0]["channels"]["slider_x"]["explained"] == 1.0
    reliability = summary["scenes"][0]["tight"]["reliability"]["quantities"]["acceleration"]
    assert reliability["verdict"] == "agree"
    assert len(reliability["models"]["exudyn"]["reliability"]) == len(reliability["angle_deg"]) == 10
    assert summary["scenes"][0]["command"] == f"sixbar validate {scene_file('one')}"
    assert set(summary["scenes"][0]["provenance"]) == {
        f"{model}{kind}"
        for model in ("reference", "exudyn")
        for kind in ("", " finer", " perturbed", " other perturbed", " coarser")
    }
    assert {path.name for path in Path("v/tables").glob("*.csv") if "events" not in path.name} == {
        "one-reference.csv", "one-exudyn.csv", "two-reference.csv", "two-exudyn.csv",
    }  # fmt: skip


def test_quick_is_the_standard_tier_of_the_main_scene(scene_file):
    assert main(["validate", "--quick", "--out", "v"]) == 0
    summary = json.loads(Path("v/summary.json").read_text())
    (scene,) = summary["scenes"]
    assert (scene["name"], scene["tier"], scene["tight"]) == ("150rpm-0.2mm", "standard", None)
    assert summary["command"] == "sixbar validate --quick"
    assert main(["validate", scene_file("one"), "--quick", "--out", "w"]) == 0
    (scene,) = json.loads(Path("w/summary.json").read_text())["scenes"]
    assert (scene["name"], scene["tight"]) == ("one", None)
