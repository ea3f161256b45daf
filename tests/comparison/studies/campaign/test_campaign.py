"""The campaign: its population, its stages with made-up runs, who errs, its page; a part of it for real."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from fake_campaign import as_it_is, refuse

from comparison.execution.run import Outcome
from comparison.studies.campaign import stages
from comparison.studies.campaign.adjudication import OPEN
from comparison.studies.campaign.population import cases
from comparison.studies.campaign.stages import examine
from comparison.verdict.results import Confirmation


def test_every_scene_starts_between_its_walls_and_is_the_same_whatever_the_count():
    drawn = cases(300, 1)
    for case in drawn:
        data = case.scene.data
        start, length = data["initial"], data["mechanism"]["slider"]["length"]
        outermost = abs(start["slider_offset"]) + abs(start["slider_angle"]) * length / 2
        assert outermost < data["clearance"]["slider"]
        assert data["drive"]["cycles"] >= 2.0
        assert data["solver"]["reference"]["tolerance"] == 1e-12
        assert (data["solver"]["exudyn"]["formulation"], data["solver"]["exudyn"]["tolerance"]) == (
            "tree",
            1e-11,
        )
    assert [case.scene.hash for case in cases(20, 1)] == [case.scene.hash for case in drawn[:20]]
    assert cases(1, 2)[0].scene.hash != drawn[0].scene.hash
    assert len({case.scene.hash for case in drawn}) == 300


def test_the_population_reaches_its_corners():
    data = [case.scene.data for case in cases(600, 3)]
    speeds = np.array([one["drive"]["speed_rpm"] for one in data])
    assert speeds.min() < -500.0
    assert speeds.max() > 500.0
    assert np.abs(speeds).min() < 15.0
    laws = [one["contact"]["law"] for one in data]
    joints = [tuple(one["joints"].values()) for one in data]
    assert 10 <= laws.count("foundation") <= 50
    assert joints.count(("clearance", "ideal")) > 400
    for rare in (("clearance", "clearance"), ("ideal", "clearance")):
        assert joints.count(rare) >= 10
    # A tenth is drawn; 4 standard deviations of 600 draws are 5 %.
    assert 0.05 < np.mean([case.family for case in cases(600, 3)]) < 0.15


def test_single_runs_that_are_close_are_enough(models, case):
    row = examine(case, models, refuse)
    assert (row["outcome"], row["stage"]) == (stages.AGREE, stages.SCREENED)
    # The reference's family is cheap; of the tree one run.
    assert models.asked == {"reference": 5, "exudyn": 1}
    assert row["screening"]["distance"] < 1e-8


def test_a_drawn_scene_is_compared_in_any_case(models, case):
    row = examine(replace(case, family=True), models, refuse)
    assert (row["outcome"], row["stage"]) == (stages.AGREE, stages.COMPARED)
    assert models.asked == {"reference": 5, "exudyn": 5}


def test_less_than_the_limit_does_not_part_and_more_does(models, case):
    size = case.scene.data["clearance"]["slider"]
    # The sine's angle is twice as large on its scale as its x.
    models.stretch["exudyn"] = 0.45e-8 / size
    assert not examine(case, models, refuse)["screening"]["parted"]
    models.stretch["exudyn"] = 0.55e-8 / size
    found = examine(case, models, as_it_is)["screening"]
    assert found["parted"]
    assert found["distance"] == pytest.approx(1.1e-8, rel=0.05)


def test_what_shows_in_a_velocity_alone_parts_them_too(models, case):
    def faster(table):
        return replace(table, frame=table.frame.assign(slider_omega=table.frame["slider_omega"] * (1 + 1e-3)))

    models.spoil["exudyn"] = faster
    row = examine(case, models, as_it_is)
    assert row["screening"]["channel"] == "slider_omega"
    assert row["outcome"] == stages.DIFFER
    assert row["adjudication"]["channel"] == "slider_omega"


def test_a_difference_is_confirmed_and_stays_open_where_every_opinion_stands_with_its_own(models, case):
    models.stretch["exudyn"] = 1e-3
    row = examine(case, models, as_it_is)
    assert row["outcome"] == stages.DIFFER
    assert row["confirmation"]["sentence"].startswith(
        "difference confirmed by 99 reference and 30 exudyn runs"
    )
    assert row["adjudication"]["errs"] == OPEN
    stands = {(one["model"], one["stands"]) for one in row["adjudication"]["evidence"]}
    assert stands == {("reference", "reference"), ("exudyn", "exudyn")}


def test_the_model_errs_whose_own_code_stands_with_the_other(models, case):
    models.stretch["exudyn"] = 1e-3
    models.of_settings = lambda _, solver: 1e-3 if solver["method"] == "LSODA" else 0.0
    row = examine(case, models, as_it_is)
    assert row["adjudication"]["errs"] == "reference"
    assert "1 of 5 opinions" in row["adjudication"]["why"]
    assert "LSODA" in row["adjudication"]["why"]
    # And the other way round: the tree's finer run stands with the reference.
    models.of_settings = lambda _, solver: -1e-3 if solver.get("step") == 1e-5 else 0.0
    assert examine(case, models, as_it_is)["adjudication"]["errs"] == "exudyn"


def test_an_uncertainty_that_was_too_small_is_a_finding_of_its_own_and_nobody_errs(models, case):
    models.stretch["exudyn"] = 1e-3

    def corrected(result, *_):
        return replace(result, verdict="agree", confirmation=Confirmation("underestimated", factor=6.0))

    row = examine(case, models, corrected)
    assert (row["outcome"], row["adjudication"]) == (stages.UNDERESTIMATED, None)

    def hidden(result, *_):
        return replace(result, verdict="indeterminate", confirmation=Confirmation("underestimated"))

    assert examine(case, models, hidden)["outcome"] == stages.NOT_DECIDED


def test_too_few_predictable_samples_decide_nothing(models, case):
    # Finer and coarser run of the reference are a thousandth of the clearance apart.
    models.of_settings = lambda model, solver: 1e-3 * (model == "reference" and solver["tolerance"] < 1e-12)
    row = examine(case, models, refuse)
    assert (row["outcome"], row["stage"]) == (stages.NOT_DECIDED, stages.SCREENED)
    assert row["coverage"] < 0.25


def test_a_run_that_fails_is_reported_by_model_kind_status_and_invariant(models, case, make_table):
    depth = {"value": 2e-7, "bound": 1e-11, "unit": "m", "time_s": 0.2}
    whole = {"value": 1e-9, "bound": 1e-6, "unit": "1", "time_s": 0.1}
    partial = replace(make_table(), provenance={"invariants": {"open-depth": depth, "energy": whole}})
    models.status["exudyn"] = Outcome("invariant-violated", "open-depth ...", partial=partial)
    row = examine(case, models, refuse)
    assert row["outcome"] == stages.BROKEN
    (failure,) = row["failures"]
    assert (failure["model"], failure["kind"], failure["status"]) == ("exudyn", "base", "invariant-violated")
    assert failure["invariants"] == ["open-depth"]
    models.status["exudyn"] = Outcome("work-limit", "shorten drive.cycles")
    assert examine(case, models, refuse)["outcome"] == stages.FAILED


def test_a_table_that_contradicts_itself_is_compared_and_does_not_count_as_agreement(models, case):
    case = replace(case, scene=case.scene.with_values({"output.groups": ["accelerations", "corners"]}))
    # The sines are in the walls half of the time; that of the other corners no contact accounts for.
    row = examine(case, models, refuse)
    assert (row["outcome"], row["stage"]) == (stages.BROKEN, stages.COMPARED)
    assert row["reason"].startswith("reference: open-depth")
    assert {one["corner"] for one in row["breaches"]["reference"]} == {"lr", "ul", "ur"}
