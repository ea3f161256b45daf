"""The pieces that a run is made of: adams-impact, isolation of zeros, the step, angles, Cholesky."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from reference_model import dop853, isolation, multiplier, tableau
from reference_model.compiled import kernel
from reference_model.contact import MODES
from reference_model.dop853 import END, START
from reference_model.isolation import BELOW, CROSSES, NODES, RESOLUTION, SETTLED, UNCLEAR
from reference_model.laws import damped_force, push
from reference_model.parameters import read_parameters
from reference_model.running import formulation, start
from reference_model.trigonometry import LARGEST, cos_sin

EPS = np.finfo(float).eps


@kernel
def impact(law, elastic, depth, rate):
    return damped_force(law, elastic, depth, rate, 1.0), push(law, law.K, depth, rate, 1.0)


@kernel
def classified(values, starting):
    return isolation.classify(values, starting, RESOLUTION)


@kernel
def crossed(values):
    return isolation.crossing(values, RESOLUTION)


@kernel
def last_positive(values):
    return isolation.last_positive(values, RESOLUTION)


@kernel
def norm(h, k, free, tolerance):
    return dop853.error_norm(h, k, free, tolerance)


@kernel
def stepped(model, law, t, h, modes, nodes, f):
    dop853.evaluate_nodes(model, law, t, 0.0, START, START, modes, nodes)
    dop853.evaluate_nodes(model, law, t, h, dop853.FIRST, END, modes, nodes)
    dop853.evaluate_nodes(model, law, t, h, dop853.FIRST_DENSE, dop853.LAST_DENSE, modes, nodes)
    dop853.prepare_dense(h, nodes.y, nodes.dy, f)
    dop853.dense(0.5, nodes.y.shape[1], nodes.y, f)


@kernel
def turned(angles, computed):
    for i in range(angles.size):
        computed[0, i], computed[1, i] = cos_sin(angles[i])


@kernel
def solved(matrix, right):
    multiplier.solve_definite(matrix, right)


def law_of(scene, **contact):
    return read_parameters(scene({f"contact.{key}": value for key, value in contact.items()})).law


@pytest.mark.parametrize("n", [1.0, 1.5, 1.8, 2.0, 2.2, 3.0])
def test_adams_impact_is_damped_by_a_smooth_step_and_pushes_where_its_force_is_positive(scene, n):
    """Force, and the sign of `push` but where rounding decides: 1e-12 of the parts of the force."""
    law = law_of(scene, law="adams-impact", stiffness=3e9 * 1e-5 ** (1.5 - n), exponent=n)
    signs = set()
    for depth in [2e-11, *np.geomspace(1e-9, 1e-4, 26)]:
        s = min(depth / 1e-5, 1.0)
        elastic, c = law.K * depth**n, 260.0 * (3.0 * s**2 - 2.0 * s**3)
        for rate in [0.0, *np.geomspace(1e-6, 1e2, 25), *-np.geomspace(1e-6, 1e2, 25)]:
            computed, margin = impact(law, elastic, depth, rate)
            assert computed == pytest.approx(elastic + c * rate, abs=1e-12 * (elastic + c * abs(rate)))
            if abs(computed) > 1e-12 * (elastic + c * abs(rate)):
                assert (margin > 0.0) == (computed > 0.0)
                signs.add(margin > 0.0)
    assert signs == {True, False}
    assert impact(law, 0.0, -1e-6, 1.0)[0] == 0.0
    given, own = (law_of(scene, law=name, stiffness=7.0) for name in ("adams-impact", "hertz-corners"))
    assert given.K == given.Kj == 7.0 < own.K < own.Kj


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
    assert classified(function(NODES), starting) in expected


@settings(max_examples=60)
@given(root=st.floats(0.01, 0.99), frequency=st.floats(0.1, 2.0), scale=st.sampled_from([1e-9, 1e-5, 1e-2]))
def test_the_zero_of_the_interpolant_is_that_of_the_function(root, frequency, scale):
    def gap(x):
        return scale * np.sin(frequency * (root - x)) * (1.0 + x)

    computed = gap(NODES)
    assume(classified(computed, False) == CROSSES)  # else not resolved by nine points, or too flat
    assert abs(gap(crossed(computed))) <= 2.0 * RESOLUTION


def test_the_last_point_that_is_positive_counts_whatever_is_before_it():
    for last in range(-1, NODES.size):
        for before in (-1.0, 1.0):
            values = np.where(np.arange(NODES.size) < last, before, -RESOLUTION)
            values[last] = 2.0 * RESOLUTION if last >= 0 else 0.5 * RESOLUTION  # the last point in that case
            assert last_positive(values) == last


def test_coefficients_are_scipys_to_the_last_bit():
    from scipy.integrate._ivp import dop853_coefficients as theirs

    np.testing.assert_array_equal(tableau.A[:13, :12], np.vstack([theirs.A[:12, :12], theirs.B]))
    np.testing.assert_array_equal(tableau.A[13:], theirs.A[13:])
    np.testing.assert_array_equal(tableau.D, theirs.D)


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
        nodes, h = dop853.new_nodes(start(p, model)), 0.2 / steps
        f, computed = np.empty((7, nodes.y.shape[1])), np.empty((2, steps, 4))
        for i in range(steps):
            stepped(model, p.law, i * h, h, np.zeros(MODES), nodes, f)
            nodes.y[START], computed[:, i] = nodes.y[END], nodes.y[[END, dop853.POINT], :4]
        return computed

    exact = flight(400)[0]

    def order(counts, error):
        return -np.polyfit(np.log(counts), np.log([error(n, 400 // n) for n in counts]), 1)[0]

    # From where the leading term rules to where errors of some 1e-14 meet the rounding of 400 steps.
    at_end = order([4, 5, 8, 10], lambda n, _: np.abs(flight(n)[0][-1] - exact[-1]).max())
    between = order([10, 20, 25, 40], lambda n, s: np.abs(flight(n)[1] - exact[s // 2 - 1 :: s]).max())
    assert [at_end, between] == pytest.approx([8.0, 8.0], abs=0.3)


def at_all(angles):
    computed = np.empty((2, angles.size))
    turned(angles, computed)
    return computed


@pytest.mark.skipif(np.finfo(np.longdouble).nmant < 63, reason="numpy has no longer floats here")
@pytest.mark.parametrize("size", [1e-9, 0.01, 1.0, 8.0, 1e3, LARGEST])
def test_cosine_and_sine_to_a_unit_in_the_last_place(size):
    """One of 1, 2.2e-16: of two million random angles of each size the worst is 0.65 of that."""
    angles = np.random.default_rng(3).uniform(-size, size, 20_000)
    exact = angles.astype(np.longdouble)
    assert np.abs(at_all(angles) - [np.cos(exact), np.sin(exact)]).max() < EPS


def test_cosine_and_sine_at_quarter_turns_of_small_angles_and_of_what_is_not_finite():
    """There the reduction changes its quadrant; a small angle times an arm is a gap, and keeps its digits."""
    centres = np.arange(-40, 41) * (np.pi / 4.0)
    angles = np.concatenate([centres, np.nextafter(centres, np.inf), np.nextafter(centres, -np.inf)])
    np.testing.assert_allclose(at_all(angles), [np.cos(angles), np.sin(angles)], rtol=0.0, atol=2.0 * EPS)
    small = np.geomspace(1e-300, 0.7, 5000)
    np.testing.assert_allclose(at_all(small)[1], np.sin(small), rtol=2.0 * EPS)
    assert np.isnan(at_all(np.array([np.inf, -np.inf, np.nan]))).all()


def test_a_definite_system_is_solved_within_its_rounding():
    """Of random matrices A A^T: the error is at most n^2 rounding units times the condition number."""
    rng = np.random.default_rng(3)
    for _ in range(50):
        factor, expected = rng.normal(size=(13, 13)), rng.normal(size=13)
        matrix = factor @ factor.T
        computed = matrix @ expected
        solved(matrix.copy(), computed)
        error = np.linalg.norm(computed - expected) / np.linalg.norm(expected)
        assert error <= 13**2 * EPS * np.linalg.cond(matrix)
    computed = np.ones(2)
    solved(np.array([[4.0, 4.0], [4.0, 4.0]]), computed)  # dependent rows: the last pivot is exactly zero
    assert not np.isfinite(computed).any()
