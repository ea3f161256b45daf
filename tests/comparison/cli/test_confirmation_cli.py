"""What `sixbar validate` makes of differences, and of runs that break an invariant. The models are fakes."""

from __future__ import annotations

import json
import re
from itertools import pairwise
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest

from comparison.cli import main
from comparison.scene import load_scene
from comparison.tables.table_files import read
from comparison.verdict.validate import validate

pytestmark = pytest.mark.usefixtures("fake_models")


def confirmations(capsys) -> list[str]:
    """The sentences on the console, of `--verbose`: wrapped, in a paragraph each."""
    paragraphs = re.split(r"^ {4}(?! )", capsys.readouterr().out, flags=re.MULTILINE)
    said = [" ".join(each.split()) for each in paragraphs]
    return [each.removeprefix("confirmation ") for each in said if each.startswith("confirmation ")]


def test_a_confirmed_difference_is_1_and_stands_in_every_output_in_one_sentence(
    scene_file, gravity, capsys, fake_models
):
    assert main(["validate", scene_file("apart", gravity.differ), "--out", "v", "--jobs", "2", "-v"]) == 1
    reported = confirmations(capsys)
    # Five bodies at the standard tier have no ensemble of their own, the tree at the tight one has.
    assert reported[0].startswith("difference confirmed from 0")
    assert (
        "by 99 reference runs from moved starts: the exudyn run is outside those of reference" in reported[0]
    )
    assert "by 99 reference and 30 exudyn runs from moved starts" in reported[1]
    (scene,) = json.loads(Path("v/summary.json").read_text())["scenes"]
    for tier, sentence in zip((scene, scene["tight"]), reported, strict=True):
        assert (tier["verdict"], tier["confirmation"]["outcome"]) == ("differ", "confirmed")
        assert tier["confirmation"]["sentence"] == sentence
    page, job = Path("v/report.html").read_text(), Path("v/summary.md").read_text()
    cases = ET.parse("v/junit.xml").iter("failure")
    messages = [case.get("message") for case in cases]
    for sentence in reported:
        assert sentence.replace("'", "&#39;") in page
        assert sentence in job
        assert any(f"differ: {sentence}. " in message for message in messages)
    assert "confirmed by at least 30 runs" in page
    # The ensembles are kept like all other runs.
    count = len(fake_models.read_text().splitlines())
    assert main(["validate", scene_file("apart", gravity.differ), "--out", "v"]) == 1
    assert len(fake_models.read_text().splitlines()) == count


def test_an_uncertainty_that_was_too_small_by_chance_is_no_difference(scene_file, gravity, capsys):
    assert main(["validate", scene_file("lucky", gravity.lucky), "--out", "v", "--jobs", "2", "-v"]) == 0
    reported = confirmations(capsys)
    summary = json.loads(Path("v/summary.json").read_text())
    (scene,) = summary["scenes"]
    assert summary["exit_code"] == 0
    page, job = Path("v/report.html").read_text(), Path("v/summary.md").read_text()
    for tier, sentence in zip((scene, scene["tight"]), reported, strict=True):
        assert sentence.startswith("no difference of models, the uncertainty was underestimated by a ")
        assert (tier["verdict"], tier["confirmation"]["outcome"]) == ("agree", "underestimated")
        assert sentence in page
        assert sentence in job
    # At the tight tier u was some 1e-10 and the ensemble is 1e-5 wide.
    assert scene["tight"]["confirmation"]["suspicious"]
    assert f'<p class="warning"><b>{reported[1]}' in page
    assert "2 of these verdicts rest on a corrected uncertainty." in page


def test_progress_starts_anew_for_every_ensemble(gravity):
    scene = load_scene(
        "150rpm-0.2mm", {"output.samples_per_cycle": 50, "environment.gravity": gravity.differ}
    )
    shares: list[float] = []
    (result,) = validate([scene], n_jobs=2, tiers=("standard",), on_progress=shares.append)
    assert result.comparison.confirmation.outcome == "confirmed"
    # The runs, two finer levels, the tree's runs and its two ensembles, the ensemble of the finest level.
    assert shares.count(1.0) == pytest.approx(7, abs=1)
    assert sum(later < earlier for earlier, later in pairwise(shares)) == 6


def test_a_run_that_breaks_an_invariant_cannot_be_compared_and_its_table_is_kept(scene_file, gravity, capsys):
    path = scene_file("wall", gravity.violate)
    Path("v/tables").mkdir(parents=True)
    for stale in ("wall.tight-exudyn-finer.partial.csv", "wall.tight-exudyn-finer.partial.json"):
        Path("v/tables", stale).write_text("of an earlier call")
    assert main(["validate", path, scene_file("good"), "--out", "v", "--jobs", "2"]) == 2
    out = " ".join(capsys.readouterr().out.split())
    assert "wall standard cannot compare n/a n/a the exudyn run did" in out
    kept = Path("v/tables/wall.standard-exudyn-base.partial.csv")
    assert f"201 samples of the standard exudyn base run are in {kept}" in out
    table = read(kept)
    assert len(table.frame) == 201
    assert table.provenance["status"] == "invariant-violated"
    assert table.events is not None
    assert Path("v/tables/wall.tight-exudyn-base.partial.csv").is_file()
    assert not list(Path("v/tables").glob("wall.tight-exudyn-finer*"))
    assert not Path("v/tables/wall-exudyn.csv").exists()
    first, second = json.loads(Path("v/summary.json").read_text())["scenes"]
    assert (first["verdict"], second["verdict"]) == ("cannot compare", "agree")
    assert first["reason"].startswith("scene 'wall': the exudyn run did not succeed: invariant-violated; ")
    assert "open-depth: corner ul is 2e-07 m inside its wall at 0.247 s" in first["reason"]
    assert "invariant-violated" in Path("v/report.html").read_text()


def test_an_ensemble_whose_runs_break_an_invariant_confirms_nothing(scene_file, gravity, monkeypatch, capsys):
    from comparison.verdict import confirmation

    usual = confirmation.moved_starts
    monkeypatch.setattr(
        confirmation,
        "moved_starts",
        lambda scene, model, shift: [
            start.with_values(
                {"environment.gravity": gravity.violate} if model == "exudyn" and n >= 5 else {}
            )
            for n, start in enumerate(usual(scene, model, shift))
        ],
    )
    assert main(["validate", scene_file("apart", gravity.differ), "--out", "v", "--jobs", "2", "-v"]) == 1
    reported = confirmations(capsys)
    assert "difference confirmed" in reported[0]
    assert "differ (unconfirmed, 5 runs) from" in reported[1]
    assert reported[1].endswith("fewer than 19 runs from moved starts succeeded")


def test_models_of_other_packages_are_confirmed_too_where_they_have_an_uncertainty(
    install, scene_file, capsys
):
    source = """
import importlib, sys
from types import SimpleNamespace
import numpy as np


def simulate(scene, *, progress=None):
    import reference_model

    own = dict(scene["solver"]["mine"])
    scene["solver"]["reference"]["tolerance"] = own["tolerance"]
    result = reference_model.simulate(scene)
    columns = dict(result.columns)
    columns["slider_x"] = columns["slider_x"] + own.get("apart", 0.0)
    return SimpleNamespace(
        columns=columns, events=result.events, extrema={}, provenance={}, status="success", remedy=""
    )
"""
    install("mine", source, {"mine": "mine:simulate"})
    extra = "[solver.mine]\ntolerance = 1e-9\napart = {apart}\n"
    for apart, code in ((0.0, 0), (1e-6, 1)):
        path = scene_file(f"by-{code}", extra=extra.format(apart=apart))
        options = ["--models", "reference,mine", "--out", "v", "--jobs", "2", "-v"]
        assert main(["validate", path, *options]) == code
    reported = confirmations(capsys)
    assert len(reported) == 1
    assert "by 99 reference and 30 mine runs from moved starts" in reported[0]
