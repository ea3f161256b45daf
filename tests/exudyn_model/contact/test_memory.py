"""The corners' memory, fed by hand with states of a slider that goes straight into the right wall and out."""

import numpy as np
import pytest

from exudyn_model.contact.gaps import contact_law
from exudyn_model.contact.memory import EVENT, update_corners
from exudyn_model.contact.states import contact_states

STEP = 1e-3
WALL = 2e-4


@pytest.fixture
def update(guide, slider):
    """Function that takes offset and speed of the next state; attributes hold what it changes."""
    contact = guide(clearance=WALL, damping=0.0)
    law = contact_law(contact, slider, STEP)

    def update(offset, speed, slip=0.0):
        count, *force = update_corners(
            update.index * STEP,
            np.array([offset, 0.0, 0.0]),
            np.array([speed, slip, 0.0]),
            law,
            update.corners,
            update.events,
            update.count,
        )
        update.index, update.count = update.index + 1, count
        return force

    update.index, update.count = 0, 0
    update.corners, update.events = contact_states(), np.zeros(8, EVENT)
    return update


def test_impact_speed_is_frozen_from_touch_to_leaving_and_then_forgotten(update):
    update(WALL - 1e-5, 0.02)
    assert not update.corners["impact_speed"].any()
    update(WALL + 1e-5, 0.02)
    # Right corners only; straight flight, round-off of lengths of 0.025 m
    np.testing.assert_allclose(update.corners["impact_speed"], [0, 0.02, 0, 0.02, 0], rtol=1e-9)
    update(WALL + 2e-5, 0.001)
    update(WALL + 1e-5, -0.02)
    np.testing.assert_allclose(update.corners["impact_speed"], [0, 0.02, 0, 0.02, 0], rtol=1e-9)
    assert update.count == 0
    update(WALL - 1e-5, -0.02)
    assert not update.corners["impact_speed"].any()
    assert update.count == 2
    update(WALL - 1e-5, 0.03)
    update(WALL + 1e-5, 0.03)
    assert update.corners["impact_speed"][1] == pytest.approx(0.03, rel=1e-9)


def test_contact_is_timed_and_integrated_from_inside_the_steps(update):
    update(WALL - 0.5e-5, 0.02)
    update(WALL + 1.5e-5, 0.02)  # touches after a quarter of the step
    deepest = -update(WALL + 2e-5, 0.0)[0] / 2
    update(WALL + 0.5e-5, -0.02)
    update(WALL - 1.5e-5, -0.02)  # leaves after a quarter
    for event in update.events[:2]:
        assert event["start"] == pytest.approx(0.25 * STEP, rel=1e-9)
        assert event["end"] == pytest.approx(3.25 * STEP, rel=1e-9)
        assert event["normal_speed"] == pytest.approx(0.02, rel=1e-9)
        assert event["largest_depth"] == pytest.approx(2e-5, rel=1e-9)
        assert event["peak_force"] == deepest == pytest.approx(4.8e9 * 2e-5**1.5, rel=1e-9)
        forces = 4.8e9 * np.array([0, 1.5e-5, 2e-5, 0.5e-5, 0]) ** 1.5
        trapezoids = np.trapezoid(forces, np.array([0.25, 1, 2, 3, 3.25]) * STEP)
        assert event["impulse"] == pytest.approx(trapezoids, rel=1e-9)
    assert sorted(update.events["corner"][:2]) == [1, 3]


def test_resultant_of_both_corners(update):
    fx, fy, moment = update(WALL + 1e-5, 0.0, slip=0.5)
    normal = 4.8e9 * 1e-5**1.5
    assert fx == pytest.approx(-2 * normal, rel=1e-9)
    assert fy == pytest.approx(-0.15 * 2 * normal, rel=1e-9)
    # Both at r_x = 0.025 m; the normal forces' moments about the centre cancel
    assert moment == pytest.approx(0.025 * fy, rel=1e-9)
