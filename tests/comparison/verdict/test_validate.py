"""Which of three or more models is the outlier."""

import pytest

from comparison.verdict.validate import pairs, standing
from comparison.words import verdicts as words

THREE = ("one", "two", "three")


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
