"""Verdicts on record; three or more models."""

import tomllib
from dataclasses import replace

import pytest

from comparison.scene import load_scene
from comparison.verdict.compare import compare
from comparison.verdict.overall import as_toml, departures, pairs, standing
from comparison.words import verdicts as words

THREE = ("one", "two", "three")


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


@pytest.mark.parametrize(
    ("verdicts", "outcome", "said"),
    [
        ("differ, differ, agree", "outlier", "One is the outlier: it differs from two and three, which"),
        ("differ, agree, differ", "outlier", "Two is the outlier"),
        ("agree, agree, agree", "agree", "All 3 agree."),
        # Near the threshold agreement is not transitive.
        ("agree, agree, differ", "differ", "No model is the outlier: two and three differ"),
        ("differ, differ, differ", "differ", "one and three differ"),
        ("indeterminate, differ, differ", "undecided", "one and two: indeterminate"),
        ("agree, cannot compare, cannot compare", "agree", "; three cannot be compared."),
        ("differ, cannot compare, cannot compare", "differ", "one and two differ"),
        ("agree, agree, cannot compare", "undecided", "two and three: cannot compare"),
        ("cannot compare, cannot compare, cannot compare", "cannot compare", "one, two and three cannot be"),
    ],
)
def test_the_model_that_differs_from_two_that_agree_is_the_outlier_else_none(verdicts, outcome, said):
    result = standing(THREE, dict(zip(pairs(THREE), verdicts.split(", "), strict=True)))
    assert (result.outcome, bool(result.outlier)) == (outcome, outcome == "outlier")
    assert said in words.standing(result)


def test_one_of_four_is_the_outlier_only_if_the_three_others_all_agree():
    models = (*THREE, "four")
    verdicts = {pair: "differ" if "four" in pair else "agree" for pair in pairs(models)}
    assert standing(models, verdicts).outlier == "four"
    assert standing(models, verdicts | {("one", "two"): "differ"}).outlier == ""
