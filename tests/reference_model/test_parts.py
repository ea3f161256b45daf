"""The pieces that a run is made of: contact laws, friction, isolation of zeros, the step."""

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from comparison.scene import load_scene
from reference_model import friction, isolation, tableau
from reference_model.compiled import kernel
from reference_model.contact import MODES
from reference_model.dop853 import (
    END,
    FIRST,
    FIRST_DENSE,
    LAST_DENSE,
    POINT,
    ROWS,
    START,
    dense,
    error_norm,
    evaluate_nodes,
    new_nodes,
    prepare_dense,
)
from reference_model.isolation import BELOW, CROSSES, NODES, RESOLUTION, SETTLED, UNCLEAR
from reference_model.laws import damping_factor, side_force
from reference_model.parameters import LAWS, read_parameters
from reference_model.running import formulation, start


@kernel
def forces(law, d1, d2, both):
    return side_force(law, d1, d2, both)


@kernel
def factor(law, rate, speed):
    return damping_factor(law, rate, speed)


@kernel
def friction_of(law, normal, slip):
    return friction.friction_force(law, normal, slip, friction.friction_regime(law, slip))


@kernel
def classified(values, starting):
    return isolation.classify(values, starting, RESOLUTION)


@kernel
def crossed(values):
    return isolation.crossing(values, RESOLUTION)


@kernel
def norm(h, k, free, tolerance):
    return error_norm(h, k, free, tolerance)


@kernel
def stepped(model, law, t, h, modes, nodes, f):
    evaluate_nodes(model, law, t, 0.0, START, START, modes, nodes)
    evaluate_nodes(model, law, t, h, FIRST, END, modes, nodes)
    evaluate_nodes(model, law, t, h, FIRST_DENSE, LAST_DENSE, modes, nodes)
    prepare_dense(h, nodes.y, nodes.dy, f)
    dense(0.5, nodes.y.shape[1], nodes.y, f)


@pytest.fixture(params=LAWS)
def law(request, scene):
    return read_parameters(scene({"contact.law": request.param})).law


@pytest.mark.parametrize(("d1", "d2"), [(4e-6, 1e-6), (1e-6, 4e-6), (3e-6, -2e-6), (-1e-6, 2e-6)])
def test_forces_are_the_slope_of_the_potential(law, d1, d2) -> None:
    """Central differences of 1e-10 m: (1e-10 / 1e-6)^2 of the third derivative, rounding of U over 1e-10."""
    both, h = d1 > 0.0 and d2 > 0.0, 1e-10
    f1, f2, energy = forces(law, d1, d2, both)
    slopes = [
        (forces(law, d1 + h * a, d2 + h * b, both)[2] - forces(law, d1 - h * a, d2 - h * b, both)[2])
        / (2.0 * h)
        for a, b in ((1, 0), (0, 1))
    ]
    assert energy > 0.0
    np.testing.assert_allclose([f1, f2], slopes, rtol=1e-6, atol=1e-6 * max(f1, f2))


DEPTHS = st.floats(-1e-4, 1e-5)


@given(a=st.tuples(DEPTHS, DEPTHS), b=st.tuples(DEPTHS, DEPTHS), share=st.floats(0.01, 0.99))
def test_the_potential_of_a_foundation_is_convex(a, b, share) -> None:
    law = read_parameters(load_scene("150rpm-0.2mm", {"contact.law": "foundation"}).data).law
    between = share * np.array(a) + (1.0 - share) * np.array(b)
    chord = share * forces(law, *a, True)[2] + (1.0 - share) * forces(law, *b, True)[2]
    # Rounding of some products and quotients; depths below 1e-100 m underflow.
    assert forces(law, *between, True)[2] <= chord * (1.0 + 1e-14) + 1e-250


@pytest.mark.parametrize(("d1", "d2"), [(3e-6, 1e-6), (2e-6, -5e-6), (-1e-4, 4e-7), (1e-7, -1e-7)])
def test_forces_of_a_foundation_are_those_of_the_pressure(scene, d1, d2) -> None:
    """Integrals of the pressure K_s depth along the face, where that is positive, by quadrature to 1e-10."""
    law = read_parameters(scene({"contact.law": "foundation"})).law
    edge = [d1 / (d1 - d2)] if d1 * d2 < 0.0 else None

    def pressure(x):
        return law.Ks * max(0.0, d1 + (d2 - d1) * x)

    total, _ = quad(pressure, 0.0, 1.0, points=edge, epsrel=1e-12)
    moment, _ = quad(lambda x: x * pressure(x), 0.0, 1.0, points=edge, epsrel=1e-12)
    assert forces(law, d1, d2, True)[:2] == pytest.approx((total - moment, moment), rel=1e-10)


def test_a_side_wholly_inside_is_eqs_7_and_8(scene) -> None:
    """K_s times the mean depth at the trapezoid's centroid: L (d1 - d2) / (6 (d1 + d2)) from the middle."""
    for name in ("paper-switching", "foundation"):
        law = read_parameters(scene({"contact.law": name})).law
        f1, f2, _ = forces(law, 5e-6, 2e-6, True)
        assert f1 + f2 == pytest.approx(law.Ks * 3.5e-6, rel=1e-14)
        assert (f1 - f2) / (f1 + f2) * 0.5 == pytest.approx(3e-6 / (6.0 * 7e-6), rel=1e-14)


def test_a_foundation_has_no_jump_where_a_corner_goes_in(scene) -> None:
    law, tiny = read_parameters(scene({"contact.law": "foundation"})).law, 1e-13
    for d1, d2 in ((3e-6, 0.0), (0.0, -2e-6)):
        outside, inside = (
            np.array(forces(law, d1 + s * (d1 == 0.0), d2 + s * (d1 > 0.0), True)) for s in (-tiny, tiny)
        )
        assert np.abs(inside - outside).max() <= law.Ks * tiny


def test_both_materials_count(scene) -> None:
    """sigma of slider and guide apart: K and K_s of the sum, the journal's of the guide's alone."""
    steel, soft = {"slider": 210e9, "guide": 210e9}, {"slider": 210e9, "guide": 7e9}
    same, one = (read_parameters(scene({"contact.youngs_modulus": value})).law for value in (steel, 210e9))
    assert same == one
    law = read_parameters(
        scene({"contact.youngs_modulus": soft, "contact.poisson": {"slider": 0.3, "guide": 0.2}})
    ).law
    sigma = (1 - 0.3**2) / 210e9 + (1 - 0.2**2) / 7e9
    assert pytest.approx(4.0 / (3.0 * sigma) * math.sqrt(1e-3), rel=1e-14) == law.K
    assert law.Ks == pytest.approx(0.12 / (0.475 * sigma), rel=1e-14)
    radius = 0.01 * 0.0102 / 2e-4
    assert law.Kj == pytest.approx(4.0 / (6.0 * (1 - 0.2**2) / 7e9) * math.sqrt(radius), rel=1e-12)


def test_the_damping_without_memory_never_pulls(scene) -> None:
    law = read_parameters(scene({"contact.impact_speed": "current", "contact.restitution": 0.0})).law
    for rate in np.concatenate([[0.0], np.geomspace(1e-8, 1e3, 40), -np.geomspace(1e-8, 1e3, 40)]):
        assert factor(law, rate, 1e-9) == pytest.approx(1.0 + 0.75 * rate / np.hypot(rate, 1e-4), rel=1e-14)
        assert factor(law, rate, 1e-9) >= 0.25


@pytest.mark.parametrize("static", [1e-4, 0.0])
def test_friction_is_eqs_12_and_13(scene, static) -> None:
    law = read_parameters(scene({"friction.static_speed": static})).law
    for slip in np.concatenate([np.linspace(-2e-3, 2e-3, 81), [-1.0, 1.0]]):
        ramp = min(1.0, max(0.0, (abs(slip) - static) / (1e-3 - static)))
        assert friction_of(law, 50.0, slip) == pytest.approx(-0.15 * 50.0 * ramp * np.sign(slip), abs=1e-12)


def values(function):
    return np.array([function(x) for x in NODES])


def test_classes() -> None:
    assert classified(values(lambda x: 1.0 + x), False) == SETTLED
    assert classified(values(lambda x: 0.3 - x), False) == CROSSES
    assert classified(values(lambda x: -0.1 - x), False) == BELOW
    assert classified(values(lambda x: (x - 0.3) * (x - 0.6)), False) == UNCLEAR
    assert classified(values(lambda x: np.sin(40.0 * x) + 1.5), False) == UNCLEAR  # nine points cannot tell
    # What starts wrong and turns right has not ended, unless it is not the start.
    assert classified(values(lambda x: x - 1e-3), True) == SETTLED
    assert classified(values(lambda x: x - 1e-3), False) != SETTLED
    assert classified(values(lambda x: (x - 0.4142) ** 2 - 1e-9), False) == UNCLEAR


@settings(max_examples=60)
@given(root=st.floats(0.01, 0.99), frequency=st.floats(0.1, 2.0), scale=st.sampled_from([1e-9, 1e-5, 1e-2]))
def test_the_zero_of_the_interpolant_is_that_of_the_function(root, frequency, scale) -> None:
    def gap(x):
        return scale * np.sin(frequency * (root - x)) * (1.0 + x)

    found = values(gap)
    assume(classified(found, False) == CROSSES)  # else not resolved by nine points, or too flat
    assert abs(gap(crossed(found))) <= 2.0 * RESOLUTION


def test_coefficients_are_scipys_to_the_last_bit() -> None:
    from scipy.integrate._ivp import dop853_coefficients as theirs

    np.testing.assert_array_equal(tableau.A[:13, :12], np.vstack([theirs.A[:12, :12], theirs.B]))
    np.testing.assert_array_equal(tableau.A[13:], theirs.A[13:])
    np.testing.assert_array_equal(tableau.D, theirs.D)


@pytest.mark.parametrize("stage", [0, 5, 11])
def test_a_step_whose_stages_are_absurd_is_never_accepted(stage) -> None:
    """In a stiff contact they grew until their squares were infinite, and an error over infinity was 0."""
    k = np.zeros((ROWS, 4))
    assert norm(1e-6, k, 4, 1e-10) == 0.0
    for size in (*np.geomspace(1e3, 1e300, 2000), np.inf, np.nan):
        k[stage] = size
        assert not norm(1e-6, k, 4, 1e-10) <= 1.0, size


def test_order_on_a_stretch_without_contacts(scene) -> None:
    """Eighth order at the steps' ends and, its local error being of that order, of the dense output."""
    p = read_parameters(scene())
    model, _ = formulation(p)

    def flight(steps):
        nodes = new_nodes(start(p, model))
        f = np.empty((7, nodes.y.shape[1]))
        ends, middles, h = np.empty((steps, 4)), np.empty((steps, 4)), 0.2 / steps
        for i in range(steps):
            stepped(model, p.law, i * h, h, np.zeros(MODES), nodes, f)
            nodes.y[START], ends[i], middles[i] = nodes.y[END], nodes.y[END, :4], nodes.y[POINT, :4]
        return ends, middles

    exact, _ = flight(400)

    def order(counts, error):
        return -np.polyfit(np.log(counts), np.log([error(steps) for steps in counts]), 1)[0]

    def between(steps):
        stride = 400 // steps
        return np.abs(flight(steps)[1] - exact[stride // 2 - 1 :: stride]).max()

    # From where the leading term rules to where errors of some 1e-14 meet the rounding of 400 steps.
    assert order(
        [4, 5, 8, 10], lambda steps: np.abs(flight(steps)[0][-1] - exact[-1]).max()
    ) == pytest.approx(8.0, abs=0.3)
    assert order([10, 20, 25, 40], between) == pytest.approx(8.0, abs=0.3)
