"""Three models against each other on the command line; the models are fakes."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from comparison.cli import main

# What the fake reference does, under another name.
THIRD = "from reference_model import simulate\n"
MODELS = ["--models", "reference,exudyn,third"]


@pytest.fixture
def third(fake_models: Path, install: Callable[..., Path]) -> Path:
    """Install the third model; the log of all runs."""
    install("third_press", THIRD, {"third": "third_press:simulate"})
    return fake_models


def outcome() -> dict:
    return json.loads(Path("all/summary.json").read_text("utf-8"))


@pytest.mark.usefixtures("third")
def test_the_model_that_differs_from_both_others_is_the_outlier(scene_file, gravity, capsys):
    extra = "[solver.third]\ntolerance = 1e-9\n"
    assert main(["validate", scene_file("odd", gravity.differ, extra), *MODELS, "--out", "all"]) == 1
    (found,) = outcome()["scenes"]
    assert (found["outcome"], found["outlier"]) == ("outlier", "exudyn")
    assert found["verdicts"] == {
        "reference and exudyn": "differ", "reference and third": "agree", "exudyn and third": "differ",
    }  # fmt: skip
    lines = capsys.readouterr().out.splitlines()
    assert "odd  Exudyn is the outlier: it differs from reference and third, which agree." in lines
    page = Path("all/report.html").read_text("utf-8")
    for pair in ("reference-exudyn", "reference-third", "exudyn-third"):
        assert f'href="{pair}/report.html"' in page
        assert Path("all", pair, "report.html").is_file()
    assert "Of 1 scene: exudyn is the outlier on 1." in page


@pytest.mark.usefixtures("third")
def test_a_model_that_fails_leaves_the_others_compared(scene_file, gravity):
    scene = scene_file("fails", gravity.fail, "[solver.third]\ntolerance = 1e-9\n")
    assert main(["validate", scene, *MODELS, "--out", "all"]) == 2
    (found,) = outcome()["scenes"]
    assert (found["outcome"], found["outlier"]) == ("agree", "")
    assert "exudyn cannot be compared" in found["sentence"]


def test_each_model_runs_once_for_all_its_pairs(third, scene_file):
    scene = scene_file("same", extra="[solver.third]\ntolerance = 1e-9\n")

    def exudyn_runs() -> int:
        return third.read_text().count("exudyn ")

    assert main(["validate", scene, "--models", "reference,exudyn", "--out", "two"]) == 0
    before = exudyn_runs()
    assert before > 3
    assert main(["validate", scene, *MODELS, "--out", "all"]) == 0
    assert exudyn_runs() == before
    assert outcome()["scenes"][0]["outcome"] == "agree"


@pytest.mark.usefixtures("third")
def test_undecided_is_exit_code_3_unless_allowed(scene_file):
    """Without a tolerance the third model has no uncertainty, so that its pairs are indeterminate."""
    scene = scene_file("vague")
    assert main(["validate", scene, *MODELS, "--out", "all"]) == 3
    assert outcome()["scenes"][0]["outcome"] == "undecided"
    assert main(["validate", scene, *MODELS, "--out", "all", "--allow-indeterminate"]) == 0


@pytest.mark.parametrize(
    ("models", "rule"),
    [
        ("reference,exudyn,adams", "model 'adams' is not known"),
        ("reference,exudyn,reference", "reference is named twice"),
        ("reference,exudyn,", "model '' is not known"),
    ],
)
def test_bad_lists_of_models_are_one_line(fake_models, scene_file, models, rule, capsys):
    assert main(["validate", scene_file("same"), "--models", models, "--out", "all"]) == 2
    err = capsys.readouterr().err
    assert rule in err
    assert err.count("\n") == 1
    assert not Path("all").exists()
    assert fake_models.read_text() == ""
