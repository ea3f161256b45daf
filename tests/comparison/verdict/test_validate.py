"""The main job in Python, with fake models in this process; verdicts on record; three models."""

import re
import tomllib
from dataclasses import replace

import pytest

from comparison.accuracy.levels import AccuracyError
from comparison.execution.run import VIOLATED, Outcome
from comparison.scene import load_scene
from comparison.verdict import validate as judge
from comparison.verdict.compare import compare
from comparison.verdict.validate import as_toml, departures, pairs, standing, validate
from comparison.words import verdicts as words
from comparison.words.reliability import missing

STANDARD = ("standard",)


def test_each_model_runs_three_levels_and_two_perturbed_runs_and_the_ideal_scene_none(scene, ran):
    ideal = load_scene("ideal", {"output.samples_per_cycle": 50})
    with_clearance, without = validate([scene, ideal])
    assert [len(result.runs["exudyn"].perturbed_runs) for result in (with_clearance, without)] == [2, 0]
    # Ten at the standard tier. At the tight one the tree has five and the reference four: its coarser run is
    # the finer one of the standard tier. The ideal mechanism runs at two levels by each model.
    # The ideal scene: by the reference two runs at each tier, since its base run is that of the ideal
    # mechanism and its coarser one at the tight tier the finer one of the other; three by five bodies at both
    # tiers. Of its ideal mechanism only the coarser runs have other samples.
    assert len(ran) == (10 + 9 + 4) + (2 + 2 + 3 + 2)
    levels = ("finer", "coarser", "perturbed", "other perturbed")
    scenes = {kind: with_clearance.comparison.provenance[f"exudyn {kind}"]["scene"] for kind in levels}
    assert [scenes[kind]["solver"]["exudyn"]["step"] for kind in levels] == [1e-6, 4e-6, 4e-6, 4e-6]
    assert [scenes[kind]["initial"] == scene.data["initial"] for kind in levels] == [True, True, False, False]
    assert scenes["finer"]["solver"]["reference"]["tolerance"] == 1e-10


@pytest.mark.usefixtures("ran")
def test_accuracy_sets_both_models_and_stands_in_the_command(scene):
    (result,) = validate([scene], accuracy="strict")
    solver = result.comparison.scene["solver"]
    assert (solver["reference"]["tolerance"], solver["exudyn"]["step"]) == (1e-12, 5e-7)
    command = "sixbar validate 150rpm-0.2mm --set output.samples_per_cycle=200 --accuracy strict"
    # Strict it is already.
    assert (result.comparison.command, result.comparison.closer_command) == (command, "")
    with pytest.raises(AccuracyError, match="'fine' must be draft, standard, strict or a positive number"):
        validate([scene], accuracy="fine")


@pytest.mark.usefixtures("ran")
def test_the_reliability_is_a_finding_of_its_own_and_a_failed_ideal_run_only_reported(
    scene, gravity, monkeypatch
):
    # Accelerations are there whether or not the scene asks for them.
    bare = scene.with_values({"output.groups": []})
    (agreeing,) = (result.comparison for result in validate([bare]))
    (apart,) = (
        result.comparison
        for result in validate([bare.with_values({"environment.gravity": gravity.differ})], tiers=STANDARD)
    )
    # One in a thousand of the motion across the guide is seen in the channels, hardly in the reliability.
    assert (agreeing.verdict, apart.verdict) == ("agree", "differ")
    for comparison in (agreeing, agreeing.tight, apart):
        assert list(comparison.reliability.quantities) == ["displacement", "velocity", "acceleration"]
    assert agreeing.reliability.verdict == "agree"
    usual, fails = judge.ideal_scenes, {"environment.gravity": gravity.fail}

    def failing(*arguments):
        return {kind: ideal.with_values(fails) for kind, ideal in usual(*arguments).items()}

    monkeypatch.setattr(judge, "ideal_scenes", failing)
    (result,) = validate([scene], tiers=STANDARD)
    assert (result.comparison.verdict, result.crashed) == ("agree", False)
    assert result.comparison.reliability.quantities == {}
    assert "newton-failed; try a smaller step" in missing(result.comparison.reliability)
    assert dict(words.reasons(result.comparison))["reliability"].startswith("not available: ")


@pytest.mark.usefixtures("ran")
@pytest.mark.parametrize(
    ("steps", "verdict", "refined"),
    [
        # A coarser run is there for the uncertainty of the base run, and may violate an invariant.
        ([4e-6], "agree", 0),
        # The remedy of a violation is a smaller step: that is tried, once.
        ([2e-6, 4e-6], "agree", 1),
        ([2e-6, 1e-6], "cannot compare", 0),
    ],
)
def test_where_five_bodies_violate_an_invariant_they_run_at_half_the_step(
    scene, steps, verdict, refined, monkeypatch
):
    run_all = judge.run_all

    def violated(jobs, *arguments):
        return [
            Outcome(VIOLATED, "lower the step", partial=outcome.table)
            if job.model == "exudyn" and job.scene.data["solver"]["exudyn"]["step"] in steps
            else outcome
            for job, outcome in zip(jobs, run_all(jobs, *arguments), strict=True)
        ]

    monkeypatch.setattr(judge, "run_all", violated)
    (result,) = validate([scene], tiers=STANDARD)
    comparison = result.comparison
    assert (comparison.verdict, comparison.refined) == (verdict, refined)
    assert any("lower the step" in warning for warning in comparison.warnings) == bool(refined)
    if verdict == "cannot compare":  # what there is of the run that is named
        assert list(result.partial) == ["standard exudyn base"]
        said = f"scene {scene.name!r}: the exudyn run did not succeed: {VIOLATED}; lower the step"
        assert words.scene_reason(comparison) == said


def test_verdicts_of_shipped_scenes_are_compared_with_those_on_record(scene, make_runs):
    sides = make_runs(1e-8), make_runs(2e-8)
    usual, tight = (compare(*sides, scene=scene, tier=tier) for tier in ("standard", "tight"))
    both = replace(usual, tight=tight)
    made = {"machine": 'A "x", numpy 2', "date": "2030-01-01"}
    record = tomllib.loads(as_toml([scene], [both], made))

    def said(scenes, comparisons, record=record):
        return words.departures(departures(scenes, comparisons, record), record["made"])

    assert (record["made"], said([scene], [both])) == (made, "")
    now = replace(both, tight=replace(tight, verdict="differ"))
    assert said([scene, scene], [both, now]) == (
        f'not the verdicts on record (on A "x", numpy 2; 2030-01-01): {scene.name}, tight: differ, not agree'
    )
    # Neither a changed scene under the name on record, nor one that is not shipped, nor another tier.
    changed = scene.variant({"contact.youngs_modulus": 1e9})
    assert said([changed, load_scene("wedge")], [now, now]) == ""
    assert said([scene], [now], tomllib.loads(as_toml([scene], [usual], made))) == ""


# Three or more models

THREE = ("one", "two", "three")


@pytest.mark.parametrize(
    ("verdicts", "outcome", "said"),
    [
        (
            ("differ", "differ", "agree"),
            "outlier",
            "One is the outlier: it differs from two and three, which",
        ),
        (("differ", "agree", "differ"), "outlier", "Two is the outlier"),
        (("agree", "agree", "agree"), "agree", "All 3 agree."),
        # Near the threshold agreement is not transitive.
        (("agree", "agree", "differ"), "differ", "No model is the outlier: two and three differ"),
        (("differ", "differ", "differ"), "differ", "one and three differ"),
        (("indeterminate", "differ", "differ"), "undecided", "one and two: indeterminate"),
        (("agree", "cannot compare", "cannot compare"), "agree", "; three cannot be compared."),
        (("differ", "cannot compare", "cannot compare"), "differ", "one and two differ"),
        (("agree", "agree", "cannot compare"), "undecided", "two and three: cannot compare"),
        (("cannot compare",) * 3, "cannot compare", "one, two and three cannot be compared"),
    ],
)
def test_the_model_that_differs_from_two_that_agree_is_the_outlier_else_none(verdicts, outcome, said):
    result = standing(THREE, dict(zip(pairs(THREE), verdicts, strict=True)))
    assert (result.outcome, bool(result.outlier)) == (outcome, outcome == "outlier")
    assert said in words.standing(result)
    assert words.standings([result]) == words.standing(result)  # of one scene nothing is counted
    assert re.fullmatch(r"Of 2 scenes: [^;]* on 2\.", words.standings([result, result]))


def test_one_of_four_is_the_outlier_only_if_the_three_others_all_agree():
    models = (*THREE, "four")
    verdicts = {pair: "differ" if "four" in pair else "agree" for pair in pairs(models)}
    assert standing(models, verdicts).outlier == "four"
    assert standing(models, verdicts | {("one", "two"): "differ"}).outlier == ""
