"""A side on an elastic foundation: pressure, damping, friction, and which corner names a contact."""

import numpy as np
import pytest

from exudyn_model.contact.corners import frozen_slider_force, slider_force
from exudyn_model.contact.foundation import foundation_forces
from exudyn_model.contact.gaps import CornerMotion, contact_law, corner_motion
from exudyn_model.contact.laws import elastic_normals, side_energy
from exudyn_model.contact.memory import EVENT, update_corners
from exudyn_model.contact.states import CONTACTS, contact_states

K_S, LENGTH, STEP, WALL = 2.88e10, 0.07, 1e-6, 2e-4
PARTIAL = [(1e-6, -3e-7), (-2e-5, 4e-8), (3e-8, -1e-12)]
BOTH = [(1e-6, 4e-7), (2e-9, 2e-9), (1e-12, 3e-6)]
LL, LR, UL, UR = range(4)


@pytest.fixture
def law(guide, slider):
    """Record of the paper's guide on a foundation."""
    return contact_law(guide(law="foundation", clearance=WALL), slider, STEP)


def motion(depth, depth_rate=0.0, slip=0.0):
    return CornerMotion(-depth, -depth_rate, slip, 0.0, 0.0)


@pytest.mark.parametrize("depths", PARTIAL + BOTH)
def test_corner_forces_are_equivalent_to_the_pressure_along_the_side(law, depths):
    """K_s / L times the depth, where that is positive, by Gauss-Legendre over the part that is inside."""
    lower, upper = depths
    zero = lower / (lower - upper) if lower * upper < 0 else 1.0
    start, end = (zero, 1.0) if lower < 0 else (0.0, zero)
    nodes, weights = np.polynomial.legendre.leggauss(4)  # exact for the parabola of the moment
    at = start + (nodes + 1) * (end - start) / 2
    pressures = K_S * (lower + at * (upper - lower)) * weights * (end - start) / 2
    expected = pressures @ (1 - at), pressures @ at
    # Depths of 1e-12 m beside 3e-8: some roundings of their difference
    np.testing.assert_allclose(elastic_normals(*depths, False, law[0]), expected, rtol=1e-11)


@pytest.mark.parametrize("depths", BOTH)
def test_both_inside_it_is_the_paper_s_surface(guide, slider, law, depths):
    paper = contact_law(guide(law="paper-switching"), slider, STEP)[0]
    assert elastic_normals(*depths, True, law[0]) == elastic_normals(*depths, True, paper)
    assert side_energy(*depths, law[0]) == side_energy(*depths, paper)
    total = sum(depths)
    lower, upper = elastic_normals(*depths, True, law[0])
    assert lower + upper == pytest.approx(K_S * total / 2, rel=1e-14)
    centroid = LENGTH * (depths[1] - depths[0]) / (6 * total)
    assert LENGTH / 2 * (upper - lower) / (upper + lower) == pytest.approx(centroid, abs=1e-16)


def test_forces_and_their_derivatives_are_continuous_where_the_second_corner_goes_in(law):
    depth, small = 1e-6, 1e-10

    def normals(second):
        return np.array(elastic_normals(depth, second, second > 0, law[0]))

    before, at, after = normals(-small), normals(0.0), normals(small)
    np.testing.assert_allclose(at, [K_S * depth / 3, K_S * depth / 6], rtol=1e-15)
    # dN1/dd2 = K_s/6 and dN2/dd2 = K_s/3 from either side; the next term is d2 / d1 of that
    for slope in ((at - before) / small, (after - at) / small):
        np.testing.assert_allclose(slope, [K_S / 6, K_S / 3], rtol=4 * small / depth)


def test_force_begins_and_ends_without_a_jump(law):
    """Of a side that is tilted by 1e-5 m: K_s d^2 / (2 1e-5 m) at a depth d."""
    assert sum(elastic_normals(1e-10, -1e-5, False, law[0])) == pytest.approx(K_S * 1e-20 / 2e-5, rel=2e-5)
    assert elastic_normals(0.0, -1e-5, False, law[0]) == (0.0, 0.0)
    assert elastic_normals(-1e-9, -1e-5, False, law[0]) == (0.0, 0.0)


@pytest.mark.parametrize("depths", PARTIAL + BOTH)
def test_damping_and_friction_are_the_side_s(law, depths):
    normals = np.array(elastic_normals(*depths, min(depths) > 0, law[0]))
    shares = normals / normals.sum()
    forces = foundation_forces(motion(depths[0], 0.03, 2e-4), motion(depths[1], -0.01, 9e-4), 0.05, law[0])
    factor = 1 + 0.1425 * (shares @ [0.03, -0.01]) / 0.05
    np.testing.assert_allclose(forces[:2], normals * factor, rtol=1e-14)
    slip = shares @ [2e-4, 9e-4]  # on the rising part of Eq. 13, from 1e-4 to 1e-3 m/s
    friction = -0.15 * (slip - 1e-4) / 9e-4 * normals.sum() * factor
    np.testing.assert_allclose(forces[2:4], friction * shares, rtol=1e-12)
    assert forces.slip == pytest.approx(slip, rel=1e-14)
    fast = foundation_forces(motion(depths[0], -1.0), motion(depths[1], -1.0), 0.05, law[0])
    assert fast[:4] == (0.0, 0.0, 0.0, 0.0)  # the wall does not pull


def in_contact(*numbers):
    corners = contact_states()
    corners["impact_speed"][list(numbers)] = 0.05
    return corners


@pytest.mark.parametrize("name", [LR, UR])
def test_resultant_acts_in_its_point_of_the_side_whichever_corner_names_the_contact(law, slider, name):
    """The right side, its upper end outside: two forces in the point that divides it, by cross product."""
    x, angle, v = 2.5e-4, 1.5e-3, (0.01, 0.3, 0.4)
    corners = [corner_motion(n, x, angle, *v, law[0]) for n in (LR, UR)]
    assert corners[0].gap < 0 < corners[1].gap
    lower, upper = elastic_normals(-corners[0].gap, -corners[1].gap, False, law[0])
    share = upper / (lower + upper)
    rotation = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    arm = rotation @ [slider.width / 2, slider.length * (share - 0.5)]
    velocity = v[0] - v[2] * arm[1], v[1] + v[2] * arm[0]
    normal = (lower + upper) * (1 + 0.1425 * velocity[0] / 0.05)
    force = np.array([-normal, -0.15 * normal])
    found = frozen_slider_force(x, angle, *v, law, in_contact(name))
    np.testing.assert_allclose(found[:2], force, rtol=1e-9)  # depths round to 1e-18 m of some 1e-8
    assert found[2] == pytest.approx(arm[0] * force[1] - arm[1] * force[0], rel=1e-9)


def test_mirror_images_of_a_state_have_mirror_images_of_its_force(law):
    random, tilted = np.random.default_rng(3), 0
    for _ in range(100):
        x, angle = random.choice([-1, 1]) * WALL + random.normal(0, 1e-6), random.normal(0, 3e-5)
        vx, vy, omega = random.normal(0, [0.01, 1e-3, 0.3])
        found = np.array(slider_force(x, angle, vx, vy, omega, law, in_contact(LL, LR)))
        tilted += found[2] != 0
        across = slider_force(-x, -angle, -vx, vy, -omega, law, in_contact(LL, LR))
        along = slider_force(x, -angle, vx, -vy, -omega, law, in_contact(UL, UR))
        np.testing.assert_array_equal(across, found * [-1, 1, -1])
        np.testing.assert_allclose(along, found * [1, -1, -1], rtol=1e-12)
    assert tilted > 30


def test_no_force_before_the_side_s_contact_begins(law):
    state = WALL + 1e-7, 1e-6, 0.01, 0.2, 0.0
    assert frozen_slider_force(*state, law, contact_states()) == (0.0, 0.0, 0.0)
    corners = contact_states()
    corners["gap"], corners["rate"] = 1e-9, -0.2
    assert slider_force(*state, law, corners)[0] < 0.0
    law["stays_open"] = 1.0
    assert slider_force(*state, law, corners) == (0.0, 0.0, 0.0)


@pytest.fixture
def follow(law):
    """Function that takes depths of lr and ur and their rates in the next accepted state, 1 us later."""

    def follow(lower, upper, lower_rate, upper_rate):
        angle, omega = (lower - upper) / LENGTH, (lower_rate - upper_rate) / LENGTH
        x, vx = WALL + (lower + upper) / 2, (lower_rate + upper_rate) / 2
        follow.count, *force = update_corners(
            follow.index * STEP,
            np.array([x, 0.0, angle]),
            np.array([vx, 0.5, omega]),
            law,
            *follow.kept,
            follow.count,
        )
        follow.index += 1
        return force

    follow.index, follow.count, follow.kept = 0, 0, (contact_states(), np.zeros(8, EVENT))
    return follow


def test_one_row_for_a_side_named_by_the_corner_that_touches_first(follow):
    """ur touches after a quarter of a step, lr after a half; ur leaves, then lr after three quarters."""
    contacts, events = follow.kept
    follow(-4e-8, -1e-8, 0.08, 0.04)
    follow(4e-8, 3e-8, 0.08, 0.04)
    np.testing.assert_allclose(contacts["impact_speed"], [0, 0, 0, 0.04, 0], rtol=1e-6)
    assert list(contacts["closed"]) == [0, 1, 0, 1, 0]
    forces = [follow(6e-8, 1e-8, 0.0, -0.02)[0]]
    forces.append(follow(3e-8, -1e-8, -0.04, -0.02)[0])
    # It goes on under its name, and both corners bear a part
    assert (contacts["impact_speed"] > 0).tolist() == [False, False, False, True, False]
    assert contacts["normal"][UR] > 0
    assert follow.count == 0
    follow(-1e-8, -3e-8, -0.04, -0.02)
    assert not contacts["impact_speed"].any()
    assert not contacts["closed"].any()
    assert follow.count == 1
    row = events[0]
    assert CONTACTS[row["corner"]] == "ur"
    # Straight flight; angles round depths of 1e-8 m to 1e-17 m
    assert row["start"] == pytest.approx(0.25 * STEP, rel=1e-6)
    assert row["end"] == pytest.approx(3.75 * STEP, rel=1e-6)
    assert row["normal_speed"] == pytest.approx(0.04, rel=1e-6)
    assert row["largest_depth"] == pytest.approx(6e-8, rel=1e-6)
    assert row["peak_force"] >= -min(forces)


def test_the_step_is_solved_with_the_speed_that_is_then_frozen(follow, law):
    """Trial state and accepted state alike: whichever of both corners has touched first."""
    contacts, _ = follow.kept
    follow(-4e-8, -1e-8, 0.08, 0.04)
    state = WALL + 3.5e-8, 1e-8 / LENGTH, 0.06, 0.5, 0.04 / LENGTH
    trial = slider_force(*state, law, contacts)
    accepted = follow(4e-8, 3e-8, 0.08, 0.04)
    np.testing.assert_allclose(trial, accepted, rtol=1e-12)


@pytest.mark.parametrize(("lower", "upper", "named"), [(1e-8, 1e-8, LR), (1e-8, 2e-8, UR), (2e-8, 1e-8, LR)])
def test_at_the_start_the_deeper_corner_names_the_contact_and_else_the_lower(follow, lower, upper, named):
    follow(lower, upper, 0.01, 0.01)
    assert np.flatnonzero(follow.kept[0]["impact_speed"]).tolist() == [named]
