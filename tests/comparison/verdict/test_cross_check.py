"""The main job in Python, with fakes; and once, slowly, with the two models."""

from __future__ import annotations

import pytest

from comparison.accuracy.levels import AccuracyError, finer
from comparison.agreement import planned_runs
from comparison.execution.job import MODELS, VIOLATED, Job, Outcome
from comparison.execution.run import run_all
from comparison.scene import load_scene
from comparison.verdict import validate as judge
from comparison.verdict.compare import Runs, compare
from comparison.verdict.refinement import Settled
from comparison.verdict.validate import validate
from comparison.words.verdicts import reasons, scene_reason


@pytest.mark.usefixtures("fake_models")
def test_each_model_runs_three_levels_and_two_perturbed_runs_and_the_ideal_scene_none(scene, fake_models):
    ideal = load_scene("ideal", {"output.samples_per_cycle": 50})
    with_clearance, without = validate([scene, ideal], n_jobs=2)
    assert len(with_clearance.runs["exudyn"].perturbed_runs) == 2
    assert without.runs["exudyn"].perturbed_runs == ()
    # At the tight tier the tree's five; the ideal scene's five bodies run as at the standard one. Of the
    # reference's, the coarser run of the strict level is the finer one of the standard level. The ideal
    # mechanism runs at two levels; by the reference the ideal scene's are these already.
    # All but those of the ideal mechanism run once more with the samples of the reliability.
    assert len(fake_models.read_text().splitlines()) == 2 * ((10 + 6) + (5 + 4)) + 2 + (4 + 2)
    finer = with_clearance.comparison.provenance["exudyn finer"]["scene"]["solver"]
    assert finer["exudyn"]["step"] == 1e-6
    coarser = with_clearance.comparison.provenance["exudyn coarser"]["scene"]["solver"]
    assert coarser["exudyn"]["step"] == 4e-6
    for kind in ("perturbed", "other perturbed"):
        perturbed = with_clearance.comparison.provenance[f"exudyn {kind}"]["scene"]
        assert perturbed["solver"]["exudyn"] == coarser["exudyn"]
        assert perturbed["initial"] != scene.data["initial"]
    assert finer["reference"]["tolerance"] == 1e-10


@pytest.mark.usefixtures("fake_models")
def test_accuracy_sets_both_models_and_stands_in_the_command(scene):
    (result,) = validate([scene], accuracy="strict")
    solver = result.comparison.scene["solver"]
    assert (solver["reference"]["tolerance"], solver["exudyn"]["step"]) == (1e-12, 5e-7)
    assert result.comparison.command == (
        "sixbar validate 150rpm-0.2mm --set output.samples_per_cycle=200 --accuracy strict"
    )
    assert result.comparison.closer_command == ""  # strict it is already
    with pytest.raises(AccuracyError, match="out of reach of the exudyn model"):
        validate([scene], accuracy=1e-10)


@pytest.mark.usefixtures("fake_models")
def test_the_reliability_is_a_finding_of_its_own_and_a_failed_ideal_run_only_reported(scene, gravity):
    good, differing = (
        scene.with_values({"environment.gravity": g}) for g in (gravity.normal, gravity.differ)
    )
    agreeing, apart = (result.comparison for result in validate([good, differing], n_jobs=2))
    # One in a thousand of the motion across the guide is seen in the channels, hardly in the reliability.
    assert (agreeing.verdict, apart.verdict) == ("agree", "differ")
    for comparison in (agreeing, apart, agreeing.tight, apart.tight):
        assert list(comparison.reliability.quantities) == ["displacement", "velocity", "acceleration"]
    assert agreeing.reliability.verdict == "agree"
    bare = scene.with_values({"output.groups": []})
    (without,) = validate([bare], tiers=("standard",))
    # The runs with more samples have accelerations, whether or not the scene asks for them.
    assert list(without.comparison.reliability.quantities) == ["displacement", "velocity", "acceleration"]


@pytest.mark.usefixtures("fake_models")
@pytest.mark.parametrize(
    ("steps", "verdict", "refined"),
    [
        # A coarser run is there for the uncertainty of the base run, and may violate an invariant.
        ([4e-6], "agree", 0),
        # The remedy of a violation is a smaller step: that is tried, once.
        ([2e-6], "agree", 1),
        ([2e-6, 4e-6], "agree", 1),
        ([1e-6], "cannot compare", 0),
        ([2e-6, 1e-6], "cannot compare", 0),
    ],
)
def test_where_five_bodies_violate_an_invariant_they_run_at_half_the_step(
    scene, steps, verdict, refined, monkeypatch
):
    def violated(jobs, *arguments):
        return [
            Outcome(VIOLATED, "lower the step", partial=outcome.table)
            if job.model == "exudyn" and job.scene.data["solver"]["exudyn"]["step"] in steps
            else outcome
            for job, outcome in zip(jobs, run_all(jobs, *arguments), strict=True)
        ]

    monkeypatch.setattr(judge, "run_all", violated)
    (result,) = validate([scene], tiers=("standard",))
    assert (result.comparison.verdict, result.comparison.refined) == (verdict, refined)
    assert ("lower the step" in scene_reason(result.comparison)) == (verdict == "cannot compare")
    assert any("lower the step" in warning for warning in result.comparison.warnings) == bool(refined)


@pytest.mark.usefixtures("fake_models")
def test_where_the_ideal_mechanism_cannot_be_run_the_verdict_stands(scene, gravity, monkeypatch):
    usual = planned_runs.ideal_scenes
    monkeypatch.setattr(
        planned_runs,
        "ideal_scenes",
        lambda scene, model: {
            kind: ideal.with_values({"environment.gravity": gravity.fail})
            for kind, ideal in usual(scene, model).items()
        },
    )
    (result,) = validate([scene], tiers=("standard",))
    assert result.comparison.verdict == "agree"
    assert not result.crashed
    assert result.comparison.reliability.quantities == {}
    assert "newton-failed; try a smaller step" in result.comparison.reliability.missing
    assert dict(reasons(result.comparison))["reliability"].startswith("not available: ")


@pytest.mark.usefixtures("fake_models")
def test_a_verdict_is_settled_with_finer_runs_of_both_models_or_none(scene, gravity, monkeypatch):
    given = []

    def settle(result, runs, *, scene, run_families, **__):
        closer = finer("exudyn", finer("reference", scene))
        given.append((run_families(closer), run_families(closer.with_values({fails: gravity.fail}))))
        return Settled(result, runs, scene)

    fails = "environment.gravity"
    monkeypatch.setattr(judge, "settle", settle)
    validate([scene], tiers=("standard",))
    ((families, failed),) = given
    assert failed is None
    settings = [
        of.base.provenance["scene"]["solver"][model] for model, of in zip(MODELS, families, strict=True)
    ]
    assert (settings[0]["tolerance"], settings[1]["step"]) == (1e-11, 1e-6)
    assert all(of.finer and of.coarser and len(of.perturbed_runs) == 2 for of in families)


@pytest.mark.slow
def test_the_two_models_agree_on_the_first_impacts_and_a_wrong_restitution_is_found(tmp_path, monkeypatch):
    monkeypatch.setenv("SIXBAR_CACHE_DIR", str(tmp_path))
    # Up to 0.06 s: the first impacts, before the slider chatters and nothing is predictable.
    scene = load_scene("150rpm-0.2mm", {"drive.cycles": 0.15})
    (result,) = validate([scene], n_jobs=2)
    assert result.comparison.verdict == "agree", scene_reason(result.comparison)
    wrong = scene.with_values({"contact.restitution": 0.891})
    (faulty,) = validate([wrong], n_jobs=2)
    mixed = compare(result.runs["reference"], faulty.runs["exudyn"], scene=scene, labels=MODELS)
    assert mixed.verdict == "differ"
    assert mixed.channels["slider_x"].verdict == "differ"


@pytest.mark.slow
@pytest.mark.parametrize("model", MODELS)
def test_a_models_table_has_the_channels_and_times_that_the_scene_asks_for(model, tmp_path, monkeypatch):
    monkeypatch.setenv("SIXBAR_CACHE_DIR", str(tmp_path))
    scenes = [load_scene(name, {"drive.cycles": 0.02}) for name in ("90rpm-0.5mm", "ideal")]
    outcomes = run_all([Job(scene, model) for scene in scenes], 2)
    assert [(o.status, o.message) for o in outcomes] == [("success", "")] * 2
    table = outcomes[0].table
    assert compare(Runs(table), Runs(table), scene=scenes[0], tolerance=1e-12).verdict == "agree"
