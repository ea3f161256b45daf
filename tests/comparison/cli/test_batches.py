"""What is finished survives: an interruption, a fault in one scene, and then the report of the others."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from comparison.cli import main
from comparison.models import MODELS
from comparison.verdict import validate as judge
from comparison.verdict.results import no_comparison
from comparison.verdict.validate import Validation

pytestmark = pytest.mark.usefixtures("fake_models")


@pytest.fixture
def stop(monkeypatch):
    """Let the validation of a scene raise an error."""

    def at(name: str, error: BaseException) -> None:
        usual = judge.validate

        def validate(scenes, **options):
            if any(scene.name == name for scene in scenes):
                raise error
            return usual(scenes, **options)

        monkeypatch.setattr(judge, "validate", validate)

    return at


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


def test_as_many_scenes_at_a_time_as_keep_the_workers_busy_and_the_share_only_grows(monkeypatch):
    names = ["ideal", "wedge", "crank-pin", "69GPa", "surface"]
    sizes, shares = [], []

    def validate(batch, *, on_progress, **_):
        sizes.append(len(batch))
        for share in (0.0, 1.0, 0.2):  # an ensemble starts anew
            on_progress(share)
        return [
            Validation(no_comparison(scene, "none", labels=MODELS, command="", tier="standard"), {})
            for scene in batch
        ]

    monkeypatch.setattr(judge, "validate", validate)
    monkeypatch.setattr("comparison.cli.progress._Silence.__call__", lambda _, share: shares.append(share))
    assert main(["validate", *names, "--set", "drive.cycles=1", "--jobs", "4", "-q", "--out", "v"]) == 2
    assert sizes == [2, 2, 1]
    written = json.loads(Path("v/summary.json").read_text())["scenes"]
    assert [scene["name"] for scene in written] == [f"{name}+drive.cycles=1" for name in names]
    assert shares == sorted(shares)
    assert shares[-1] == pytest.approx(1.0)
