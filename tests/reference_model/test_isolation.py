"""Nine values of a function classify its zeros; a step with absurd stages is not accepted."""

import numpy as np
import pytest

from reference_model import dop853, events
from reference_model.compiled import kernel
from reference_model.events import ABSCISSAE, BELOW, CROSSES, SETTLED, UNCLEAR


@kernel
def classify(values, starting):
    return events.classify(values, starting)


@kernel
def norm(h, k, free, tolerance):
    return dop853.error_norm(h, k, free, tolerance)


@pytest.mark.parametrize(
    ("function", "starting", "expected"),
    [
        (lambda x: 1.0 + x, False, {SETTLED}),
        (lambda x: 0.3 - x, False, {CROSSES}),
        (lambda x: -0.1 - x, False, {BELOW}),
        (lambda x: (x - 0.3) * (x - 0.6), False, {UNCLEAR}),
        (lambda x: np.sin(40.0 * x) + 1.5, False, {UNCLEAR}),  # nine points cannot tell
        (lambda x: (x - 0.4142) ** 2 - 1e-9, False, {UNCLEAR}),
        # A wrong sign that turns right is settled at a start alone.
        (lambda x: x - 1e-3, True, {SETTLED}),
        (lambda x: x - 1e-3, False, {CROSSES, BELOW, UNCLEAR}),
    ],
)
def test_nine_values_classify_a_function(function, starting, expected):
    assert classify(function(ABSCISSAE), starting) in expected


@pytest.mark.parametrize("stage", [0, 5, 11])
def test_a_step_whose_stages_are_absurd_is_never_accepted(stage):
    """Stages in a stiff contact grew until their squares were infinite; an error over infinity was 0."""
    k = np.zeros((dop853.ROWS, 4))
    assert norm(1e-6, k, 4, 1e-10) == 0.0
    for size in (*np.geomspace(1e3, 1e300, 100), np.inf, np.nan):
        k[stage] = size
        assert not norm(1e-6, k, 4, 1e-10) <= 1.0, size
