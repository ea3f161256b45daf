"""Which of three or more models is the outlier."""

import pytest

from comparison.verdict.validate import pairs, standing

THREE = ("one", "two", "three")


@pytest.mark.parametrize(
    ("verdicts", "outcome", "outlier"),
    [
        ("differ, differ, agree", "outlier", "one"),
        ("differ, agree, differ", "outlier", "two"),
        ("agree, agree, agree", "agree", ""),
        ("agree, agree, differ", "differ", ""),  # near the threshold agreement is not transitive
        ("differ, differ, differ", "differ", ""),
        ("indeterminate, differ, differ", "undecided", ""),
        ("agree, cannot compare, cannot compare", "agree", ""),
        ("differ, cannot compare, cannot compare", "differ", ""),
        ("agree, agree, cannot compare", "undecided", ""),
        ("cannot compare, cannot compare, cannot compare", "cannot compare", ""),
    ],
)
def test_the_model_that_differs_from_two_that_agree_is_the_outlier_else_none(verdicts, outcome, outlier):
    result = standing(THREE, dict(zip(pairs(THREE), verdicts.split(", "), strict=True)))
    assert (result.outcome, result.outlier) == (outcome, outlier)


def test_one_of_four_is_the_outlier_only_if_the_three_others_all_agree():
    models = (*THREE, "four")
    verdicts = {pair: "differ" if "four" in pair else "agree" for pair in pairs(models)}
    assert standing(models, verdicts).outlier == "four"
    assert standing(models, verdicts | {("one", "two"): "differ"}).outlier == ""
