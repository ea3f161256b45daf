"""The command line: exit codes, one-line errors, nothing half-written. The models are fakes."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from comparison.accuracy.levels import expected
from comparison.cli import main
from comparison.scene import load_scene
from comparison.tables.table_files import read
from comparison.verdict.results import exit_code
from comparison.verdict.shipped import Departure

pytestmark = pytest.mark.usefixtures("fake_models")


def test_version(capsys):
    assert main(["--version"]) == 0
    assert capsys.readouterr().out.startswith("sixbar-crossval ")


@pytest.mark.parametrize(
    ("arguments", "rule"),
    [
        (["swim"], "No such command 'swim'"),
        (["run", "ideal"], "Missing option '--model'"),
        (
            ["run", "ideal", "--model", "adams", "--out", "a.csv"],
            "model 'adams' is not known; available: reference, exudyn",
        ),
        (["run", "ideal", "--model", "reference", "--out", "a.xls"], "must end in .csv or .parquet"),
        (["run", "idael", "--model", "reference", "--out", "a.csv"], "did you mean 'ideal'"),
        (
            ["run", "ideal", "--model", "reference", "--out", "a.csv", "--set", "drive.speed_rpm=0"],
            "must not be zero",
        ),
        (
            ["run", "ideal", "--model", "reference", "--out", "a.csv", "--accuracy", "1e-30", "--no-check"],
            "smallest error bound",
        ),
        (["validate", "--jobs", "0"], "--jobs"),
        (["validate", "nowhere.toml"], "neither a shipped scene nor a file"),
        (["compare", "a.csv", "b.csv"], "a.csv: No such file"),
        (["compare", "a.csv", "b.csv", "--tolerance", "-1"], "must be a positive number"),
    ],
)
def test_mistakes_are_one_line_on_stderr_and_exit_code_2(arguments, rule, capsys):
    assert main(arguments) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert rule in err
    assert err.startswith("sixbar: ")
    assert err.count("\n") == 1
    assert list(Path.cwd().iterdir()) == []


def test_run_writes_the_table_and_says_where(scene_file, capsys):
    assert (
        main(
            [
                "run",
                scene_file("own"),
                "--model",
                "exudyn",
                "--out",
                "deep/own.csv",
                "--set",
                "drive.cycles=1",
                "-q",
            ]
        )
        == 0
    )
    out, err = capsys.readouterr()
    assert (out.splitlines(), err) == (["deep/own.events.csv", "deep/own.json", "deep/own.csv"], "")
    table = read("deep/own.csv")
    assert len(table.frame) == 101
    assert table.provenance["scene"]["drive"]["cycles"] == 1.0
    assert {p.name for p in Path("deep").iterdir()} == {"own.csv", "own.events.csv", "own.json"}


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


@pytest.mark.parametrize(
    ("what", "code", "reported"),
    [
        ("refuse", 2, "contact.law = 'foundation' is not simulated yet"),
        ("nan", 2, "slider_vy is nan in data row 8"),
        ("crash", 70, "its process ended with code 3"),
        ("bug", 70, "RuntimeError: index out of range"),
    ],
)
def test_a_run_that_fails_writes_no_table(scene_file, gravity, capsys, what, code, reported):
    path = scene_file("own", getattr(gravity, what))
    assert main(["run", path, "--model", "exudyn", "--out", "a.csv", "-q"]) == code
    out, err = capsys.readouterr()
    assert out == ""
    assert reported in err
    assert err.count("\n") == 1
    # Of an engine's own error where it came from is kept, and nothing else.
    assert [path.name for path in Path.cwd().iterdir()] == (["a.traceback.txt"] if what == "bug" else [])


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


def test_without_out_the_report_goes_to_a_folder_named_after_the_scene(scene_file, capsys):
    assert main(["validate", scene_file("one")]) == 0
    assert capsys.readouterr().out.splitlines()[-1].startswith("reports/out/one/")


def test_one_scene_that_fails_leaves_the_others_compared_and_reported(scene_file, gravity, capsys):
    failing = scene_file("bad", gravity.fail)
    Path("v/tables").mkdir(parents=True)
    stale = [Path(f"v/tables/bad-exudyn.{end}csv") for end in ("", "events.", "pulses.")]
    for path in stale:
        path.write_text("of an earlier call")
    assert main(["validate", failing, scene_file("good"), "--out", "v"]) == 2
    out = capsys.readouterr().out
    assert "bad    standard  cannot compare       n/a           n/a  the exudyn run did" in out
    assert "good   standard  agree " in out
    summary = json.loads(Path("v/summary.json").read_text())
    assert [scene["verdict"] for scene in summary["scenes"]] == ["cannot compare", "agree"]
    assert summary["scenes"][0]["reason"] == (
        "scene 'bad': the exudyn run did not succeed: newton-failed; try a smaller step"
    )
    assert not [path for path in stale if path.exists()]
    assert "newton-failed" in Path(out.splitlines()[-1]).read_text()


@pytest.mark.parametrize(
    ("what", "code"), [("differ", 1), ("crash", 70), ("nan", 2), ("short", 2), ("refuse", 2)]
)
def test_validate_exits_with_the_worst_of_its_scenes(scene_file, gravity, what, code):
    assert (
        main(["validate", scene_file("bad", getattr(gravity, what)), scene_file("good", 9.0), "--out", "v"])
        == code
    )
    assert json.loads(Path("v/summary.json").read_text())["exit_code"] == code


def test_indeterminate_is_3_unless_it_is_allowed(scene_file, capsys):
    coarse = scene_file("coarse", extra="[solver.exudyn]\nstep = 2e-3\n")
    assert main(["validate", coarse]) == 3
    assert main(["validate", coarse, "--allow-indeterminate"]) == 0
    assert "coarse  standard  indeterminate" in capsys.readouterr().out


def test_two_scenes_of_one_name_are_refused(scene_file, tmp_path, capsys):
    (tmp_path / "other").mkdir()
    namesake = tmp_path / "other" / "one.toml"
    namesake.write_text(Path(scene_file("one")).read_text())
    assert main(["validate", scene_file("one"), str(namesake)]) == 2
    assert "two scenes have this name" in capsys.readouterr().err


def test_the_order_of_the_exit_codes():
    assert exit_code([0, 3]) == 3
    assert exit_code([0, 3, 1]) == 1
    assert exit_code([1, 2, 3]) == 2
    assert exit_code([2, 70]) == 70
    assert exit_code([3, 1], allow_indeterminate=True) == 1


def test_quick_is_the_standard_tier_of_the_main_scene(scene_file):
    assert main(["validate", "--quick", "--out", "v"]) == 0
    summary = json.loads(Path("v/summary.json").read_text())
    (scene,) = summary["scenes"]
    assert (scene["name"], scene["tier"], scene["tight"]) == ("150rpm-0.2mm", "standard", None)
    assert summary["command"] == "sixbar validate --quick"
    assert main(["validate", scene_file("one"), "--quick", "--out", "w"]) == 0
    (scene,) = json.loads(Path("w/summary.json").read_text())["scenes"]
    assert (scene["name"], scene["tight"]) == ("one", None)
