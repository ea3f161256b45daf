"""Contacts that begin or end inside a step are found, however the gap reverses there."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.polynomial import Polynomial

from exudyn_model.assembly import assemble
from exudyn_model.constants import linkage_record
from exudyn_model.contact.gaps import contact_law
from exudyn_model.contact.journal import journal_law, pin_motion
from exudyn_model.contact.states import CONTACTS, PIN, contact_states
from exudyn_model.reading import read_scene
from exudyn_model.tree.isolation import GAP_TOLERANCE, gap_within, smooth_distance
from exudyn_model.tree.motion import MOTION, crank_and_rod2_at, has_clearance, interpolate
from exudyn_model.tree.step_bounds import (
    corner_acceleration_bounds,
    pin_acceleration_bounds,
    point_acceleration_bounds,
    rotation_bounds,
    slider_acceleration_bounds,
)
from exudyn_model.tree.switching import locate

LR = CONTACTS.index("lr")
UNIT = 1e-7  # m, of the polynomials below: angles small enough for a sine to be straight
STEP = 1e-5  # s
LEAST = 1e-12  # s, the shortest step that ends at a touch
T = Polynomial([0.0, 1.0])


@pytest.fixture(scope="module")
def located(make_scene):
    """Function from lr's gap, a polynomial of the step's fraction, to what ``locate`` says of the step.

    The press stands still but for the slider, which rotates: lr's gap is clearance - x - arm sin(angle). With
    ``closed`` the corner is in contact at the start.
    """
    parameters = read_scene(make_scene({}))
    linkage = linkage_record(parameters)
    linkage["omega"] = linkage["tip_jerk"] = 0.0
    pin_law, theta4 = journal_law(parameters, np.nan), assemble(parameters).positions[3, 2]
    arm, rotated = parameters.mechanism.slider.length / 2, 1e-4  # rotated so that ur stays away from its wall

    def find(gap, closed=False):
        law = contact_law(parameters.contact, parameters.mechanism.slider, np.nan)
        law["half_width"] = law["clearance"] = 0.0
        ends = np.zeros(2, MOTION)
        ends["time"], ends["theta4"], ends["theta5"] = [0.0, STEP], theta4, rotated
        law["clearance"] = UNIT * gap(0.0) - gap_within(LR, *ends, 0.0, linkage[0], law[0], pin_law[0])[0]
        angle = rotated - UNIT / (arm * np.cos(rotated)) * (gap - gap(0.0))
        for number, name in enumerate(("theta5", "w5", "a5")):
            ends[name] = (angle.deriv(number) if number else angle)(np.array([0.0, 1.0])) / STEP**number
        contacts = contact_states()
        for number in range(4):
            found = gap_within(number, *ends, 0.0, linkage[0], law[0], pin_law[0])
            contacts[number]["gap"], contacts[number]["rate"] = found
        contacts[LR]["impact_speed"] = contacts[LR]["closed"] = 1.0 if closed else 0.0
        return locate(*ends, linkage, law, pin_law, contacts, LEAST)

    return find


def first_change(located, gap, closed=False):
    """Share of the step at which an integration stops that takes, time and again, what ``locate`` says."""
    start, end = 0.0, 1.0
    for _ in range(20):
        fraction = located(gap(start + (end - start) * T), closed)
        if fraction < 1.0:
            end = start + fraction * (end - start)
        elif end == 1.0 or abs(gap(end)) < 1e-14 / UNIT:
            return end
        else:  # rounded towards the start: a step more
            start, end = end, 1.0
    raise AssertionError("no step is accepted")


def turning(*places, sign=1.0):
    """Polynomial with turning points there, that rises after the last one; -1: that falls."""
    return sign * Polynomial.fromroots(places).integ() * 20.0 * 10.0 ** (len(places) - 2)


# Turning points, and whether the gap rises after the last one; the dip that is to be found, of the minima
DIPS = {
    "in and out": ([0.5], 1, 0.5),
    "both ends opening": ([0.2, 0.7], 1, 0.7),
    "both ends closing": ([0.3, 0.8], -1, 0.3),
    "two dips": ([0.2, 0.5, 0.8], 1, 0.2),
    "two bumps": ([0.1, 0.4, 0.9], -1, 0.4),
    "two dips, both ends closing": ([0.15, 0.4, 0.65, 0.9], -1, 0.15),
    "two dips, both ends opening": ([0.05, 0.35, 0.6, 0.85], 1, 0.35),
}


@pytest.mark.parametrize("closed", [False, True], ids=["touch", "leaving"])
@pytest.mark.parametrize("depth", [1e-2, 1e-6])
@pytest.mark.parametrize(("places", "sign", "dip"), DIPS.values(), ids=DIPS)
def test_the_first_dip_inside_a_step_is_found(located, places, sign, dip, depth, closed):
    shape = turning(*places, sign=sign)
    gap = shape - shape(dip) - depth
    roots = gap.roots()
    roots = np.sort(roots[(abs(roots.imag) < 1e-12) & (roots.real > 0.0) & (roots.real < dip)].real)
    assert gap(0.0) > 0.0
    fraction = first_change(located, -gap if closed else gap, closed)
    # Gaps are rounded to 1e-16 m, which is this much of the step at the crossing's slope
    assert fraction == pytest.approx(roots[-1], abs=1e-8 / abs(gap.deriv()(roots[-1])))


@pytest.mark.parametrize("closed", [False, True], ids=["touch", "leaving"])
@pytest.mark.parametrize(("places", "sign"), [case[:2] for case in DIPS.values()], ids=DIPS)
def test_a_gap_that_reverses_just_before_the_wall_is_none(located, places, sign, closed):
    """1e-14 m before it, which is five times what counts as none."""
    shape = turning(*places, sign=sign)
    lowest = min(shape(place) for place in places)
    gap = shape - lowest + 1e-14 / UNIT
    if gap(1.0) < 0.0:
        pytest.skip("closes at the end")
    assert located(-gap if closed else gap, closed) == 1.0


@pytest.mark.parametrize("closed", [False, True], ids=["touch", "leaving"])
def test_a_dip_before_the_end_that_has_crossed_is_found_first(located, closed):
    gap = turning(0.3, 0.6, sign=-1.0)
    gap = gap - gap(0.3) - 1e-3
    assert gap(1.0) < 0.0
    first = min(root.real for root in gap.roots() if 0.0 < root.real < 1.0 and abs(root.imag) < 1e-12)
    assert first < 0.3
    assert first_change(located, -gap if closed else gap, closed) == pytest.approx(first, abs=1e-6)


def test_what_has_just_left_comes_back_in_the_same_step(located):
    """Three gaps that are zero at the start and open: back inside the step, or at its very end not yet."""
    assert first_change(located, 40.0 * T * (0.6 - T)) == pytest.approx(0.6, abs=1e-8)
    assert first_change(located, 40.0 * T * (0.6 - T) * (0.8 - T)) == pytest.approx(0.6, abs=1e-8)
    assert located(40.0 * T * (1.01 - T)) == 1.0


def test_what_rests_at_the_wall_and_is_pressed_touches_at_once(located):
    assert located(-40.0 * T * T) == 0.5  # the step is to be tried again, with the contact


def test_a_gap_at_rest_near_the_wall_needs_no_shorter_step(located):
    """1e-13 m over the whole step, which the bound of the second derivative alone does not settle."""
    assert located(1e-13 / UNIT + 0.1 * (T - 0.5) ** 2) == 1.0
    assert located(Polynomial([1e-13 / UNIT])) == 1.0


ANGLES = st.tuples(*[st.floats(-1.0, 1.0)] * 12)


@pytest.fixture(scope="module")
def presses(make_scene):
    """Records of both trees and their angles at the start."""
    made = {}
    for pin in ("ideal", "clearance"):
        parameters = read_scene(make_scene({"joints.crank_pin": pin}))
        linkage = linkage_record(parameters)
        law = contact_law(parameters.contact, parameters.mechanism.slider, np.nan)
        made[pin] = linkage, law, journal_law(parameters, np.nan), assemble(parameters).positions[:, 2]
    return made


def random_step(presses, pin, step, numbers):
    """Ends of a step from twelve numbers: accelerations as in free flight and in contact, rates that fit."""
    linkage, law, pin_law, angles = presses[pin]
    ends = np.zeros(2, MOTION)
    ends["time"] = 0.1, 0.1 + step
    bodies = "45" if pin == "ideal" else "2345"
    for row, body in enumerate(bodies):
        scale = 3e4 if body == "5" else 3e3
        a0, a1, w0 = scale * numbers[3 * row], scale * numbers[3 * row + 1], 5.0 * numbers[3 * row + 2]
        rise = angles[int(body) - 1] + 1e-3 * numbers[(3 * row + 5) % 12]
        ends[f"a{body}"] = a0, a1
        ends[f"w{body}"] = w0, w0 + step * (a0 + a1) / 2
        # What is missing to the mean of the rates bends the angle once more
        missing = step**2 * scale * numbers[(3 * row + 7) % 12] / 20
        ends[f"theta{body}"] = rise, rise + step * (w0 + step * (2 * a0 + a1) / 6) + missing
    return ends, linkage, law.copy(), pin_law.copy()


@settings(max_examples=60, deadline=None)
@given(pin=st.sampled_from(["ideal", "clearance"]), exponent=st.floats(-7.0, -2.5), numbers=ANGLES)
def test_gaps_bend_within_the_bounds(presses, pin, exponent, numbers):
    step = 10.0**exponent
    ends, linkage, law, pin_law = random_step(presses, pin, step, numbers)
    laws = linkage[0], law[0], pin_law[0]
    first, last = ends
    state = interpolate(first, last, 1.0, linkage[0])
    rotations = {
        body: rotation_bounds(*(end[part + body] for end in ends for part in ("theta", "w", "a")), step)
        for body in "2345"
    }
    x_bounds = slider_acceleration_bounds(step, state, rotations["3"], rotations["4"], linkage[0])
    fractions = np.linspace(0.0, 1.0, 33)
    for number in range(5):
        if not has_clearance(number, linkage[0]):
            continue
        if number == PIN:
            journal = pin_motion(crank_and_rod2_at(state, linkage[0], pin_law[0]), pin_law[0])
            least, greatest = pin_acceleration_bounds(
                journal, step, rotations["2"], rotations["3"], state.w2, linkage[0], pin_law[0]
            )
        else:
            least, greatest = corner_acceleration_bounds(
                number, *x_bounds, state.theta5, rotations["5"], law[0]
            )
        gaps = np.array([gap_within(number, first, last, fraction, *laws)[0] for fraction in fractions])
        if number == PIN and np.min(gaps) < 0.0:
            greatest = np.inf  # holds as long as the pin is open
        distances = np.array([smooth_distance(number, gap, pin_law[0]) for gap in gaps])
        # Means of the second derivative over two intervals, and the rounding of what they are made of
        bends, rounding = np.diff(distances, 2) * 32**2, 32**2 * 4e-15 * max(1.0, np.max(abs(gaps)) / 1e-4)
        assert np.min(bends) >= least * step**2 - rounding
        assert np.max(bends) <= greatest * step**2 + rounding


@settings(max_examples=80, deadline=None)
@given(
    pin=st.sampled_from(["ideal", "clearance"]),
    exponent=st.floats(-7.0, -3.0),
    numbers=ANGLES,
    number=st.integers(0, 4),
    closed=st.booleans(),
    depth=st.floats(-1.0, 1.0),
)
def test_no_crossing_stays_inside_an_accepted_step(presses, pin, exponent, numbers, number, closed, depth):
    """The clearance is such that the gap's extremum lies near the wall; all others are far away or closed."""
    step = 10.0**exponent
    ends, linkage, law, pin_law = random_step(presses, pin, step, numbers)
    if not has_clearance(number, linkage[0]):
        return
    sign, fractions = -1.0 if closed else 1.0, np.linspace(0.0, 1.0, 401)

    def gaps():
        laws = linkage[0], law[0], pin_law[0]
        return np.array([gap_within(number, *ends, fraction, *laws)[0] for fraction in fractions])

    chosen = pin_law if number == PIN else law
    found = sign * gaps()
    chosen["clearance"] -= sign * (np.min(found) - depth * np.ptp(found))
    found = sign * gaps()
    if found[0] < 1e-12 or not chosen["clearance"][0] > 0.0:
        return
    contacts = contact_states()
    for other in range(5):
        gap, rate = gap_within(other, *ends, 0.0, linkage[0], law[0], pin_law[0])
        contacts[other]["gap"], contacts[other]["rate"] = gap, rate
        contacts[other]["impact_speed"] = contacts[other]["closed"] = 1.0 if gap < 0.0 else 0.0
    fraction = locate(*ends, linkage, law, pin_law, contacts, LEAST)
    # Nothing has passed before; where another contact did, nothing is said of what comes later
    assert np.min(found[fractions < fraction]) >= -GAP_TOLERANCE - 1e-15
    if fraction == 1.0:
        assert np.min(found) >= -GAP_TOLERANCE - 1e-15


@pytest.mark.parametrize("w0", [0.0, 30.0, -4.0])
def test_what_is_carried_bends_within_the_bounds_of_a_wide_rotation(w0):
    """A constant acceleration, for which the bounds of the angle's own motion leave nothing to spare."""
    acceleration, step = 100.0, 0.05
    end = 0.4 + w0 * step + acceleration * step**2 / 2
    rotation = rotation_bounds(0.4, w0, acceleration, end, w0 + acceleration * step, acceleration, step)
    assert rotation[:2] == pytest.approx((acceleration, acceleration))
    times = np.linspace(0.0, step, 101)
    w, angle = w0 + acceleration * times, 0.4 + w0 * times + acceleration * times**2 / 2
    for along, across in ((0.24, 0.0), (0.0, 0.05), (-0.1, 0.2)):
        least, greatest = point_acceleration_bounds(along, across, end, rotation)
        bends = acceleration * (across * np.cos(angle) - along * np.sin(angle))
        bends -= w**2 * (along * np.cos(angle) + across * np.sin(angle))
        assert least <= np.min(bends)
        assert np.max(bends) <= greatest
