"""The law foundation in single states: potential, statics of the pressure, friction, damping."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from reference_model.constants import Formulation, as_record
from reference_model.energy import contact_energy
from reference_model.forces import (
    CLIPPED,
    CONTACTS,
    FRICTION,
    GAP,
    INSIDE,
    MEMORY,
    MODES,
    NORMAL,
    RATE,
    REGIME,
    SLIP,
    slider_forces,
)
from reference_model.foundation import foundation_energy, resultant
from reference_model.friction import friction_regime
from reference_model.parameters import LAWS
from reference_model.reading import read_parameters

DEPTHS = st.floats(-1e-4, 1e-5)
ROUNDING = 1e-14
"""Of some products and quotients."""


@pytest.fixture(scope="session")
def constants(scene):
    def make(changes=None):
        parameters = read_parameters(scene({"contact.law": "foundation", **(changes or {})}))
        return as_record(parameters.constants, Formulation.SLIDER)

    return make


def forces(c, d1, d2):
    """N1, N2 of a side, N."""
    total, share = resultant(c, d1, d2)
    return np.array([total * share, total * (1.0 - share)])


def pushed(c, slider, impact_speed=0.02, clipped=False):
    """Force, moment, power losses, contact states (also before) and modes of a pose with sides in contact.

    As in a run, but each side's contact is its lower corner's.
    """
    modes, contacts = np.zeros((MODES, CONTACTS)), np.zeros((5, CONTACTS))
    slider_forces(c, slider, modes, contacts)
    own = contacts.copy()
    modes[INSIDE, :4] = contacts[GAP, :4] < 0.0
    for side in range(2):
        if modes[INSIDE, [side, side + 2]].any():
            share = resultant(c, -contacts[GAP, side], -contacts[GAP, side + 2])[1]
            slip = share * contacts[SLIP, side] + (1.0 - share) * contacts[SLIP, side + 2]
            modes[[MEMORY, REGIME, CLIPPED], side] = impact_speed, friction_regime(c, slip), clipped
    return slider_forces(c, slider, modes, contacts), contacts, own, modes


@given(d1=DEPTHS, d2=DEPTHS)
def test_forces_are_the_slope_of_the_potential(constants, d1, d2) -> None:
    """By central differences over e = 1e-4 of the smaller depth: e^2 of truncation, 1e-16 / e of U."""
    c, step = constants(), 1e-4 * min(abs(d1), abs(d2))
    if max(d1, d2) < 1e-9 or step < 1e-14 or abs(d1 - d2) < 1e-9:
        return
    slopes = [
        (foundation_energy(c, d1 + step, d2) - foundation_energy(c, d1 - step, d2)) / (2.0 * step),
        (foundation_energy(c, d1, d2 + step) - foundation_energy(c, d1, d2 - step)) / (2.0 * step),
    ]
    bound = 1e-15 * foundation_energy(c, d1, d2) / step
    np.testing.assert_allclose(slopes, forces(c, d1, d2), rtol=1e-6, atol=bound)


@given(a=st.tuples(DEPTHS, DEPTHS), b=st.tuples(DEPTHS, DEPTHS), share=st.floats(0.01, 0.99))
def test_the_potential_is_convex(constants, a, b, share) -> None:
    c = constants()
    between = share * np.array(a) + (1.0 - share) * np.array(b)
    chord = share * foundation_energy(c, *a) + (1.0 - share) * foundation_energy(c, *b)
    # Depths below 1e-100 m underflow.
    assert foundation_energy(c, *between) <= chord * (1.0 + ROUNDING) + 1e-250


@given(d1=st.floats(1e-9, 1e-5))
def test_forces_and_their_slopes_have_no_jump_where_the_second_corner_goes_in(constants, d1) -> None:
    """Over 2e = 2e-6 of the depth: forces change by some 2e of themselves, slopes by some 2e of K_s."""
    c, e = constants(), 1e-6 * d1
    out, at, inside = (forces(c, d1, d2) for d2 in (-e, 0.0, e))
    np.testing.assert_allclose(out, inside, rtol=4e-6)
    np.testing.assert_allclose((at - out) / e, (inside - at) / e, rtol=0, atol=4e-6 * c.Ks)
    np.testing.assert_allclose(at, [c.Ks * d1 / 3.0, c.Ks * d1 / 6.0], rtol=ROUNDING)


def test_the_touch_of_the_first_corner_has_no_jump_either(constants) -> None:
    """The force rises with the square of the depth, all of it at the corner that touches."""
    c = constants()
    for depth in (1e-9, 1e-10):
        np.testing.assert_allclose(forces(c, depth, -1e-4)[0], 0.5 * c.Ks * depth**2 / 1e-4, rtol=2e-5)
    assert forces(c, 1e-10, -1e-4)[1] < 1e-6 * forces(c, 1e-10, -1e-4)[0]
    assert not forces(c, -1e-9, -1e-4).any()
    assert foundation_energy(c, 0.0, -1e-4) == 0.0


@given(d1=st.floats(1e-9, 1e-5), d2=st.floats(1e-9, 1e-5))
def test_a_side_wholly_inside_is_eqs_7_and_8(constants, d1, d2) -> None:
    """Force K_s (d1 + d2)/2 at the centroid of the trapezoid, by the textbook formula of that centroid."""
    c = constants()
    total, share = resultant(c, d1, d2)
    assert total == pytest.approx(c.Ks * (d1 + d2) / 2.0, rel=ROUNDING)
    assert 1.0 - share == pytest.approx((d1 + 2.0 * d2) / (3.0 * (d1 + d2)), rel=ROUNDING)


@pytest.mark.parametrize(("d1", "d2"), [(3e-6, 1e-6), (2e-6, -5e-6), (-1e-4, 4e-7), (1e-7, -1e-7)])
def test_the_resultant_is_that_of_the_pressure(constants, d1, d2) -> None:
    """Integrals of the pressure K_s depth along the face, where that is positive, by quadrature to 1e-10."""
    c = constants()
    edge = [d1 / (d1 - d2)] if d1 * d2 < 0.0 else None

    def pressure(x):
        return c.Ks * max(0.0, d1 + (d2 - d1) * x)

    total, _ = quad(pressure, 0.0, 1.0, points=edge, epsrel=1e-12)
    first, _ = quad(lambda x: x * pressure(x), 0.0, 1.0, points=edge, epsrel=1e-12)
    found, share = resultant(c, d1, d2)
    assert found == pytest.approx(total, rel=1e-10)
    assert 1.0 - share == pytest.approx(first / total, rel=1e-10)
    # Seen from the other corner it is the same.
    assert resultant(c, d2, d1) == (found, pytest.approx(1.0 - share, rel=ROUNDING))


POSES = {
    "one corner": (1.995e-4, 5e-4),
    "both corners": (2.02e-4, 2e-5),
    "the other corner": (1.995e-4, -5e-4),
    "left": (-2.01e-4, 3e-5),
}


@pytest.mark.parametrize("pose", POSES)
@pytest.mark.parametrize("vx", [0.01, -0.005])
def test_the_slider_feels_one_force_at_one_point_of_its_face(constants, pose, vx) -> None:
    """Force, moment and losses from the resultant's point as a point of the rigid slider."""
    c = constants()
    offset, angle = POSES[pose]
    x = 0.5 * (c.wall_left + c.wall_right) + offset
    w, vy, speed = 0.3, 0.004, 0.02
    (Fx, Fy, M, damping, friction), contacts, own, _ = pushed(c, (x, 0.0, angle, vx, vy, w), speed)
    side = 0 if offset < 0.0 else 1
    elastic, share = resultant(c, -own[GAP, side], -own[GAP, side + 2])
    sx, normal_x = (-c.half_width, 1.0) if side == 0 else (c.half_width, -1.0)
    sy = c.half_length * (1.0 - 2.0 * share)
    rx = sx * np.cos(angle) - sy * np.sin(angle)
    ry = sx * np.sin(angle) + sy * np.cos(angle)
    depth_rate, slip = -normal_x * (vx - w * ry), vy + w * rx
    normal = elastic * (1.0 + c.C * depth_rate / speed)
    correction = np.clip((abs(slip) - c.v0) / (c.v1 - c.v0), 0.0, 1.0)
    assert correction > 0.0
    drag = -c.c_f * correction * normal * np.sign(slip)
    # The arms, 0.04 m, are found by other ways; 1e-12 of all that is added up.
    assert Fx == pytest.approx(normal_x * normal, rel=1e-12)
    assert Fy == pytest.approx(drag, rel=1e-11)
    assert pytest.approx(rx * drag - ry * normal_x * normal, abs=1e-12 * normal) == M
    assert damping == pytest.approx((normal - elastic) * depth_rate, rel=1e-10)
    assert friction == pytest.approx(-drag * slip, rel=1e-11)
    assert friction > 0.0
    corners = [side, side + 2]
    np.testing.assert_allclose(contacts[NORMAL, corners], normal * np.array([share, 1 - share]), rtol=1e-12)
    np.testing.assert_allclose(contacts[FRICTION, corners], drag * np.array([share, 1 - share]), rtol=1e-11)
    # The corner outside its wall carries a force, too.
    assert np.all(contacts[NORMAL, corners] > 0.0)
    # The sum of each corner's share times its own slip is the power of the whole.
    assert -contacts[FRICTION, corners] @ own[SLIP, corners] == pytest.approx(friction, rel=1e-11)
    assert -contacts[RATE, corners] @ contacts[NORMAL, corners] == pytest.approx(
        normal * depth_rate, rel=1e-10
    )


def test_a_clipped_side_has_no_force(constants) -> None:
    c = constants()
    x = 0.5 * (c.wall_left + c.wall_right) + 2.02e-4
    found, contacts, own, modes = pushed(c, (x, 0.0, 0.0, -1.0, 0.1, 0.0), 0.02, clipped=True)
    assert found[:3] == (0.0, 0.0, 0.0)
    assert not contacts[[NORMAL, FRICTION]].any()
    # What the spring gives back then is lost.
    energy = 0.5 * c.Ks * own[GAP, 1] ** 2
    assert contact_energy(c, modes, contacts) == pytest.approx(energy, rel=1e-9)
    assert found[3] == pytest.approx(-c.Ks * own[GAP, 1] * 1.0, rel=1e-9)


def test_both_sides_have_contacts_of_their_own(constants) -> None:
    """A slider wedged between both walls: opposite corners, forces of a couple."""
    c = constants()
    angle = 2.1e-4 / c.half_length
    (Fx, _, M, _, _), contacts, _, _ = pushed(c, (0.5 * (c.wall_left + c.wall_right), 0.0, angle, 0, 0, 0))
    left, right = contacts[NORMAL, [0, 2]].sum(), contacts[NORMAL, [1, 3]].sum()
    assert left == pytest.approx(right, rel=1e-9)  # depths of 1e-5 m from coordinates of 0.5 m
    assert abs(Fx) < 1e-9 * left
    assert M * angle < 0.0


def test_the_law_is_numbered_as_it_is_read(constants) -> None:
    assert LAWS[int(constants().law)] == "foundation"
