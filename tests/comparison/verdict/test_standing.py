"""Which of three models is the outlier."""

import pytest

from comparison.verdict.several import pairs, standing
from comparison.words import verdicts as words

MODELS = ("one", "two", "three")


def judged(one_two: str, one_three: str, two_three: str):
    return standing(MODELS, dict(zip(pairs(MODELS), (one_two, one_three, two_three), strict=True)))


def test_all_pairs_in_the_order_of_the_models():
    assert pairs(MODELS) == [("one", "two"), ("one", "three"), ("two", "three")]


@pytest.mark.parametrize(
    ("verdicts", "outlier"),
    [
        (("differ", "differ", "agree"), "one"),
        (("differ", "agree", "differ"), "two"),
        (("agree", "differ", "differ"), "three"),
    ],
)
def test_the_model_that_differs_from_two_that_agree_is_the_outlier(verdicts, outlier):
    found = judged(*verdicts)
    assert (found.outcome, found.outlier) == ("outlier", outlier)
    assert words.standing(found).lower().startswith(f"{outlier} is the outlier")


@pytest.mark.parametrize(
    ("verdicts", "outcome", "said"),
    [
        (("agree", "agree", "agree"), "agree", "All 3 agree."),
        # Near the threshold agreement is not transitive.
        (("agree", "agree", "differ"), "differ", "two and three differ"),
        (("differ", "differ", "differ"), "differ", "one and three differ"),
        (("indeterminate", "differ", "differ"), "undecided", "one and two: indeterminate"),
        (("differ", "differ", "indeterminate"), "undecided", "two and three: indeterminate"),
        (("agree", "agree", "indeterminate"), "undecided", "two and three: indeterminate"),
        (("agree", "cannot compare", "cannot compare"), "agree", "; three cannot be compared."),
        (("differ", "cannot compare", "cannot compare"), "differ", "one and two differ"),
        (("agree", "agree", "cannot compare"), "undecided", "two and three: cannot compare"),
        (("cannot compare",) * 3, "cannot compare", "one, two and three cannot be compared"),
    ],
)
def test_else_no_model_is_singled_out(verdicts, outcome, said):
    found = judged(*verdicts)
    assert (found.outcome, found.outlier) == (outcome, "")
    assert said in words.standing(found)


def test_one_of_four_is_the_outlier_only_if_the_three_others_all_agree():
    models = (*MODELS, "four")
    verdicts = dict.fromkeys(pairs(models), "agree") | {
        pair: "differ" for pair in pairs(models) if "four" in pair
    }
    assert standing(models, verdicts).outlier == "four"
    assert standing(models, verdicts | {("one", "two"): "differ"}).outlier == ""
