"""`sixbar validate`: what is finished survives; what it makes of differences; pairs. The models are fakes."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from comparison.cli import main
from comparison.models import MODELS
from comparison.verdict import confirmation
from comparison.verdict import validate as judge
from comparison.verdict.results import no_comparison
from comparison.verdict.shipped import Departure
from comparison.verdict.validate import Validation

pytestmark = pytest.mark.usefixtures("fake_models")


def summary(folder: str = "v") -> list[dict]:
    return json.loads(Path(folder, "summary.json").read_text())["scenes"]


def confirmations(capsys) -> list[str]:
    """The sentences on the console, of `--verbose`: wrapped, in a paragraph each."""
    paragraphs = re.split(r"^ {4}(?! )", capsys.readouterr().out, flags=re.MULTILINE)
    said = [" ".join(each.split()) for each in paragraphs]
    return [each.removeprefix("confirmation ") for each in said if each.startswith("confirmation ")]


@pytest.mark.parametrize(
    ("options", "said"),
    [([], True), (["--accuracy", "draft"], False), (["--models", "exudyn,reference"], False)],
)
def test_it_says_last_where_a_verdict_is_not_the_one_on_record(options, said, capsys, monkeypatch):
    """Of the scenes as they are shipped at their own settings: with others verdicts may well be others."""
    departed = Departure("ideal", "tight", "agree", "differ")
    monkeypatch.setattr("comparison.verdict.shipped.departures", lambda *_: [departed])
    assert main(["validate", "ideal", "--out", "v", *options]) == 0
    *_, before, page = capsys.readouterr().out.splitlines()
    assert Path(page).is_file()
    assert ("ideal, tight: agree, not differ" in before) == said


def test_a_fault_in_one_scene_costs_that_scene_alone(scene_file, monkeypatch, capsys):
    usual = judge.validate

    def validate(scenes, **options):
        if any(scene.name == "two" for scene in scenes):
            raise ZeroDivisionError("a\nb")
        return usual(scenes, **options)

    monkeypatch.setattr(judge, "validate", validate)
    files = [scene_file(name) for name in ("one", "two", "three")]
    assert main(["validate", *files, "--quick", "--out", "v", "--jobs", "8"]) == 70
    assert [scene["verdict"] for scene in summary()] == ["agree", "cannot compare", "agree"]
    reason = "scene 'two': internal error: ZeroDivisionError: a b at test_validate"
    assert summary()[1]["reason"].startswith(reason)
    assert "internal error" in Path("v/report.html").read_text()
    assert "three  standard  agree" in capsys.readouterr().out


def test_as_many_scenes_at_a_time_as_keep_the_workers_busy_and_the_share_only_grows(monkeypatch):
    names = ["ideal", "wedge", "crank-pin", "69GPa", "surface"]
    sizes, shares = [], []

    def validate(batch, *, on_progress, tiers, **_):
        sizes.append((len(batch), len(tiers)))
        for share in (0.0, 1.0, 0.2):  # an ensemble starts anew
            on_progress(share)
        return [
            Validation(no_comparison(scene, "none", labels=MODELS, command="", tier="standard"))
            for scene in batch
        ]

    monkeypatch.setattr(judge, "validate", validate)
    monkeypatch.setattr("comparison.cli.progress._silence", lambda share, _="": shares.append(share))
    assert main(["validate", *names, "--set", "drive.cycles=1", "--jobs", "4", "-q", "--out", "v"]) == 2
    assert sizes == [(1, 1), (2, 2), (2, 2), (1, 2)]  # a first verdict at one tier
    assert [scene["name"] for scene in summary()] == [f"{name}+drive.cycles=1" for name in names]
    assert shares == sorted(shares)
    assert shares[-1] == pytest.approx(1.0)


def test_an_uncertainty_that_was_too_small_by_chance_is_no_difference(scene_file, gravity, capsys):
    assert main(["validate", scene_file("lucky", gravity.lucky), "--out", "v", "--jobs", "2", "-v"]) == 0
    (scene,), page = summary(), Path("v/report.html").read_text()
    for tier, sentence in zip((scene, scene["tight"]), confirmations(capsys), strict=True):
        assert sentence.startswith("no difference of models, the uncertainty was underestimated by a ")
        assert (tier["verdict"], tier["confirmation"]["outcome"]) == ("agree", "underestimated")
        assert tier["confirmation"]["sentence"] == sentence
        assert sentence in page
    # At the tight tier u was some 1e-10 and the ensemble is 1e-5 wide.
    assert scene["tight"]["confirmation"]["suspicious"]
    assert f'<p class="warning"><b>{sentence}' in page
    assert "2 of these verdicts rest on a corrected uncertainty." in page


def test_an_ensemble_whose_runs_break_an_invariant_confirms_nothing(scene_file, gravity, monkeypatch, capsys):
    usual = confirmation.moved_starts

    def starts(scene, model, shift):
        bad = {"environment.gravity": gravity.violate}
        moved = usual(scene, model, shift)
        return [s.with_values(bad if model == "exudyn" and n >= 5 else {}) for n, s in enumerate(moved)]

    monkeypatch.setattr(confirmation, "moved_starts", starts)
    assert main(["validate", scene_file("apart", gravity.differ), "--out", "v", "--jobs", "2", "-v"]) == 1
    standard, tight = confirmations(capsys)
    # Five bodies at the standard tier have no ensemble of their own, the tree at the tight one has.
    assert "by 99 reference runs from moved starts: the exudyn run is outside those of reference" in standard
    assert "differ (unconfirmed, 5 runs) from" in tight
    assert tight.endswith("fewer than 19 runs from moved starts succeeded")


@pytest.fixture
def third(fake_models, install):
    """What the fake reference does, under another name; the log of all runs."""
    install("third_press", "from reference_model import simulate\n", {"third": "third_press:simulate"})
    return fake_models


PAIRS = ["--models", "reference,exudyn,third", "--out", "all"]


def test_each_model_runs_once_for_all_its_pairs(third, scene_file):
    scene = scene_file("same", extra="[solver.third]\ntolerance = 1e-9\n")
    assert main(["validate", scene, "--models", "reference,exudyn", "--out", "two"]) == 0
    before = third.read_text().count("exudyn ")
    assert before > 3
    assert main(["validate", scene, *PAIRS]) == 0
    assert third.read_text().count("exudyn ") == before
    assert summary("all")[0]["outcome"] == "agree"


@pytest.mark.usefixtures("third")
def test_an_interruption_ends_all_pairs(scene_file, monkeypatch, capsys):
    asked = []

    def interrupted(*_, models, **__):
        asked.append(models)
        raise KeyboardInterrupt

    monkeypatch.setattr("comparison.verdict.validate.validate", interrupted)
    assert main(["validate", scene_file("same"), *PAIRS]) == 130
    assert asked == [("reference", "exudyn")]
    assert not Path("all/summary.json").exists()
    assert capsys.readouterr().err.endswith("sixbar: interrupted; finished runs are cached\n")
