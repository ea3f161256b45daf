"""One step of a tree in which the crank pin's bearing moves out and back: gap, bounds, touches located."""

import cmath

import numpy as np
import pytest

from exudyn_model.constants import linkage_record
from exudyn_model.contact.gaps import contact_law
from exudyn_model.contact.journal import journal_law, pin_motion
from exudyn_model.contact.states import PIN, contact_states
from exudyn_model.reading import read_scene
from exudyn_model.tree.motion import MOTION, contact_motion, crank_and_rod2_at, interpolate
from exudyn_model.tree.step_bounds import pin_acceleration_bounds, rotation_bounds
from exudyn_model.tree.switching import locate

BOTH = {"joints.crank_pin": "clearance"}


def pin_step(make_scene, eccentricity, change):
    """A step of 10 us in which the bearing moves by ``change`` (m) and back: ends, laws, rod 2's angle."""
    parameters = read_scene(make_scene(BOTH))
    mechanism, step = parameters.mechanism, 1e-5
    linkage = linkage_record(parameters)
    linkage["omega"] = 0.0  # the journal stands still
    laws = (
        linkage[0],
        contact_law(parameters.contact, mechanism.slider, np.nan)[0],
        journal_law(parameters, np.nan)[0],
    )
    journal = mechanism.crank.length * cmath.exp(1j * mechanism.crank_angle)
    theta2, theta3 = 0.3, 2.5
    # The rocker's pivot where it has to be for this position of rod 2's end
    bearing = journal - eccentricity
    pivot = (
        bearing + mechanism.rod2.length * cmath.exp(1j * theta2)
    ) - mechanism.rocker.centroid * cmath.exp(1j * theta3)
    linkage["pivot_x"], linkage["pivot_y"] = pivot.real, pivot.imag
    ends = np.zeros(2, MOTION)
    ends["time"] = 0.0, step
    ends["theta2"], ends["theta3"], ends["theta4"] = theta2, theta3, -1.5
    # Rod 2 rotates out and back: by 4 s (1 - s) times an angle whose arm is its length
    swing = change / mechanism.rod2.length
    ends["w2"] = 4 * swing / step * np.array([1.0, -1.0])
    ends["a2"] = -8 * swing / step**2
    return ends, laws, theta2


def test_a_trial_that_went_astray_begins_no_contact(make_scene):
    """What Exudyn's error control lets pass to the recorder before it takes the step back."""
    ends, laws, _ = pin_step(make_scene, -1.99e-4j * cmath.exp(0.3j), -4e-6)
    contacts = contact_states()
    contacts["gap"], contacts["rate"] = 1e-3, -1e-3
    contacts[PIN]["gap"], contacts[PIN]["rate"] = contact_motion(PIN, interpolate(*ends, 0.0, laws[0]), *laws)
    assert contacts[PIN]["rate"] < 0.0
    for angle in "2345":
        ends[f"theta{angle}"][1], ends[f"w{angle}"][1], ends[f"a{angle}"][1] = -3e13, 4e30, 3e60
    fraction = locate(*ends, *(np.array([law]) for law in laws), contacts, 1e-12)
    assert fraction < 1.0
    assert (contacts["impact_speed"] == 0.0).all()


def test_gap_of_the_pin_and_its_rate(make_scene):
    eccentricity = 1.2e-4 * cmath.exp(1j)
    ends, laws, theta2 = pin_step(make_scene, eccentricity, 5e-5)
    gap, rate = contact_motion(PIN, interpolate(*ends, 0.0, laws[0]), *laws)
    # Sums of lengths near 0.5 m
    assert gap == pytest.approx(2e-4 - 1.2e-4, abs=1e-15)
    # The bearing moves along -1j exp(i theta2), towards which the eccentricity is lost
    velocity = -1j * cmath.exp(1j * theta2) * 4 * 5e-5 / 1e-5
    outward = (eccentricity / abs(eccentricity)).conjugate()
    assert rate == pytest.approx((velocity * outward).real, rel=1e-9)
    fractions = np.linspace(0.1, 0.9, 9)
    for fraction in fractions:
        gaps = [
            contact_motion(PIN, interpolate(*ends, fraction + s, laws[0]), *laws)[0] for s in (-1e-4, 1e-4)
        ]
        rate = contact_motion(PIN, interpolate(*ends, fraction, laws[0]), *laws)[1]
        # Round-off of 1e-16 m over 2e-9 s
        assert rate == pytest.approx((gaps[1] - gaps[0]) / 2e-9, abs=1e-6 * 20)


def test_a_journal_that_touches_and_leaves_inside_a_step_is_located(make_scene):
    """Open by 1 um at both ends; the bearing moves 4 um out and back."""
    eccentricity = -1.99e-4j * cmath.exp(0.3j)
    for sign, touches in ((-1, False), (1, True)):
        ends, laws, _ = pin_step(make_scene, eccentricity, -sign * 4e-6)
        laws[0]["ideal_slider"] = True  # the pin alone
        contacts = contact_states()
        contact = contacts[PIN]
        contact["gap"], contact["rate"] = contact_motion(PIN, interpolate(*ends, 0.0, laws[0]), *laws)
        assert contact["gap"] == pytest.approx(1e-6, rel=1e-6)
        fraction = locate(*ends, *(np.array([law]) for law in laws), contacts, 1e-12)
        # 16 s (1 - s) = 1, and a bearing that rotates on an arm of 0.29 m
        expected = 0.5 - np.sqrt(0.25 - 1 / 16) if touches else 1.0
        assert fraction == pytest.approx(expected, rel=1e-3)


def test_the_bound_of_the_pins_acceleration_is_met_where_the_bearing_moves_along_the_eccentricity(make_scene):
    """Towards the wall by 0.5 um in 5 us, and back; rod 2 alone moves, by its length times its angle."""
    ends, laws, theta2 = pin_step(make_scene, -1.99e-4j * cmath.exp(0.3j), -5e-7)
    assert theta2 == 0.3
    start, end = ends
    rotation2, rotation3 = (
        rotation_bounds(*(side[part + body] for side in ends for part in ("theta", "w", "a")), end["time"])
        for body in "23"
    )
    journal = pin_motion(crank_and_rod2_at(interpolate(*ends, 1.0, laws[0]), *laws[::2]), laws[2])
    least, greatest = pin_acceleration_bounds(
        journal, end["time"], rotation2, rotation3, end["w2"], laws[0], laws[2]
    )
    fractions = np.linspace(0.0, 1.0, 33)
    gaps = np.array(
        [contact_motion(PIN, interpolate(start, end, fraction, laws[0]), *laws)[0] for fraction in fractions]
    )
    bends = np.diff(gaps - 0.5 * gaps**2 / 2e-4, 2) * 32**2 / end["time"] ** 2
    assert np.min(gaps) > 0.0
    assert least <= np.min(bends)
    # 4e4 m/s^2; e is 0.5 % shorter than the clearance, the rate's square over the clearance 0.5 % of it
    assert 0.98 * greatest < np.max(bends) <= greatest
