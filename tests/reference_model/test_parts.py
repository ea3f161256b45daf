"""The pieces that a run is made of: isolation of zeros, the step, angles."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from reference_model import dop853, events
from reference_model.compiled import kernel
from reference_model.dop853 import END, START
from reference_model.events import ABSCISSAE, BELOW, CROSSES, RESOLUTION, SETTLED, UNCLEAR
from reference_model.formulations import formulation, start
from reference_model.parameters import read_parameters
from reference_model.state import Mode, new_nodes, records
from reference_model.trigonometry import LARGEST, cos_sin

EPS = np.finfo(float).eps


@kernel
def classified(values, starting):
    return events.classify(values, starting)


@kernel
def crossed(values):
    return events.crossing(values)


@kernel
def norm(h, k, free, tolerance):
    return dop853.error_norm(h, k, free, tolerance)


@kernel
def stepped(model, t, h, modes, nodes, f):
    dop853.evaluate_nodes(model, t, 0.0, START, START, modes, nodes)
    dop853.evaluate_nodes(model, t, h, dop853.FIRST, END, modes, nodes)
    dop853.evaluate_nodes(model, t, h, dop853.FIRST_DENSE, dop853.LAST_DENSE, modes, nodes)
    dop853.prepare_dense(h, nodes.y, nodes.dy, f)
    dop853.dense(0.5, nodes.y.shape[1], nodes.y, f)


@kernel
def turned(angles, computed):
    for i in range(angles.size):
        computed[0, i], computed[1, i] = cos_sin(angles[i])


@pytest.mark.parametrize(
    ("function", "starting", "expected"),
    [
        (lambda x: 1.0 + x, False, {SETTLED}),
        (lambda x: 0.3 - x, False, {CROSSES}),
        (lambda x: -0.1 - x, False, {BELOW}),
        (lambda x: (x - 0.3) * (x - 0.6), False, {UNCLEAR}),
        (lambda x: np.sin(40.0 * x) + 1.5, False, {UNCLEAR}),  # nine points cannot tell
        (lambda x: (x - 0.4142) ** 2 - 1e-9, False, {UNCLEAR}),
        # What starts wrong and turns right has not ended, unless it is not the start.
        (lambda x: x - 1e-3, True, {SETTLED}),
        (lambda x: x - 1e-3, False, {CROSSES, BELOW, UNCLEAR}),
    ],
)
def test_classes(function, starting, expected):
    assert classified(function(ABSCISSAE), starting) in expected


@settings(max_examples=60)
@given(root=st.floats(0.01, 0.99), frequency=st.floats(0.1, 2.0), scale=st.sampled_from([1e-9, 1e-5, 1e-2]))
def test_the_zero_of_the_interpolant_is_that_of_the_function(root, frequency, scale):
    def gap(x):
        return scale * np.sin(frequency * (root - x)) * (1.0 + x)

    computed = gap(ABSCISSAE)
    assume(classified(computed, False) == CROSSES)  # else not resolved by nine points, or too flat
    assert abs(gap(crossed(computed))) <= 2.0 * RESOLUTION


@pytest.mark.parametrize("stage", [0, 5, 11])
def test_a_step_whose_stages_are_absurd_is_never_accepted(stage):
    """In a stiff contact they grew until their squares were infinite, and an error over infinity was 0."""
    k = np.zeros((dop853.ROWS, 4))
    assert norm(1e-6, k, 4, 1e-10) == 0.0
    for size in (*np.geomspace(1e3, 1e300, 2000), np.inf, np.nan):
        k[stage] = size
        assert not norm(1e-6, k, 4, 1e-10) <= 1.0, size


def test_order_on_a_stretch_without_contacts(scene):
    """Eighth order at the steps' ends and, its local error being of that order, of the dense output."""
    p = read_parameters(scene())
    model, _ = formulation(p)

    def flight(steps):
        nodes, h = new_nodes(start(p, model), 4), 0.2 / steps
        f, computed = np.empty((7, nodes.y.shape[1])), np.empty((2, steps, 4))
        for i in range(steps):
            stepped(model, i * h, h, records(Mode, 4), nodes, f)
            nodes.y[START], computed[:, i] = nodes.y[END], nodes.y[[END, dop853.POINT], :4]
        return computed

    exact = flight(400)[0]

    def order(counts, error):
        return -np.polyfit(np.log(counts), np.log([error(n, 400 // n) for n in counts]), 1)[0]

    # From where the leading term rules to where errors of some 1e-14 meet the rounding of 400 steps.
    at_end = order([4, 5, 8, 10], lambda n, _: np.abs(flight(n)[0][-1] - exact[-1]).max())
    between = order([10, 20, 25, 40], lambda n, s: np.abs(flight(n)[1] - exact[s // 2 - 1 :: s]).max())
    assert [at_end, between] == pytest.approx([8.0, 8.0], abs=0.3)


@pytest.mark.parametrize("size", [1e-9, 0.01, 1.0, 8.0, 1e3, LARGEST])
def test_cosine_and_sine_to_a_unit_in_the_last_place(size):
    """Also at quarter turns, where the quadrant changes; the sine of a small angle keeps its digits."""
    centres = np.arange(-40, 41) * (np.pi / 4.0)
    angles = np.random.default_rng(3).uniform(-size, size, 20_000)
    angles = np.concatenate([angles, centres, np.nextafter(centres, np.inf), np.nextafter(centres, -np.inf)])
    computed = np.empty((2, angles.size))
    turned(angles, computed)
    np.testing.assert_allclose(computed, [np.cos(angles), np.sin(angles)], rtol=0.0, atol=2.0 * EPS)
    small = np.abs(angles) < 0.7
    np.testing.assert_allclose(computed[1, small], np.sin(angles[small]), rtol=2.0 * EPS)
