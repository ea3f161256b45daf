"""What is said of the magnification that is the contact law's memory: no more than the exponents tell."""

import numpy as np
import pytest

from comparison.models import MODELS
from comparison.studies.nonlinear.methods.lyapunov import Exponent
from comparison.studies.nonlinear.scenes import FORGETTING, MAIN, USUAL
from comparison.studies.nonlinear.tables import without_memory


def said(without: Exponent, scatter: float) -> str:
    best = {(MAIN, model, USUAL[model]): Exponent(10.0, 9.0, 11.0, 0.0) for model in MODELS}
    best |= {(FORGETTING, model, USUAL[model]): without for model in MODELS}
    return without_memory(best, {MAIN: np.array([1e-9, 1e-3]), FORGETTING: np.array([1e-13, scatter])})


def test_two_measured_exponents_are_divided():
    assert "60 % of the exponent is the law's memory" in said(Exponent(4.0, 3.0, 5.0, 0.0), 1e-3)
    assert "all of the magnification" in said(Exponent(-1.0, -2.0, -0.5, 0.0), 1e-9)


@pytest.mark.parametrize(("scatter", "repeats"), [(1e-7, True), (5e-4, False)])
def test_an_upper_bound_is_not_taken_for_an_exponent(scatter, repeats):
    """Whose cycles all collapsed may contract: only the scatter tells."""
    sentence = said(Exponent(4.0, 3.0, 5.0, 1.0), scatter)
    assert "no exponent is measured" in sentence
    assert "%" not in sentence
    assert ("the cycles of this scene repeat" in sentence) == repeats
