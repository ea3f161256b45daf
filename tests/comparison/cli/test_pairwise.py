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
def test_an_interruption_ends_all_pairs(scene_file, monkeypatch, capsys):
    asked = []

    def interrupted(*_, models, **__):
        asked.append(models)
        raise KeyboardInterrupt

    monkeypatch.setattr("comparison.verdict.validate.validate", interrupted)
    assert main(["validate", scene_file("same"), *MODELS, "--out", "all"]) == 130
    assert asked == [("reference", "exudyn")]
    assert not Path("all/summary.json").exists()
    assert capsys.readouterr().err.endswith("sixbar: interrupted; finished runs are cached\n")
