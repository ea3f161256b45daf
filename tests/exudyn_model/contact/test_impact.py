"""A free body that flies onto one wall in Exudyn, through the press's own contact, against exact facts."""

import numpy as np
import pytest

from exudyn_model.contact.corners import force_user_function
from exudyn_model.contact.gaps import contact_law
from exudyn_model.contact.memory import EVENT, update_corners
from exudyn_model.contact.states import contact_states
from exudyn_model.parameters import Slider

SPEED, DURATION = 0.05, 6e-4
# Flown before the touch: no whole number of steps in any run
DISTANCE = 1.0437e-5
# The two right corners coincide in the mass point: twice the stiffness, which does not change the restitution
POINT = Slider(mass=0.02, inertia=1e-5, length=0.0, width=0.0)


@pytest.fixture
def thrown(fly, guide, plain_contact):
    """Function that throws a mass point onto the right wall: speed at the end, and the table of contacts."""

    def throw(restitution, steps, compiled=True):
        contact = guide(clearance=DISTANCE, damping=0.75 * (1 - restitution**2), friction=0.0)
        step = DURATION / steps
        law, corners, events = contact_law(contact, POINT, step), contact_states(), np.zeros(100, EVENT)
        if compiled:
            force = force_user_function(law, corners)
        else:
            force = plain_contact.corners_user_function(contact, POINT, step, corners)

        def update_guide(done, q, v, count):
            return update_corners(done * step, q, v, law, corners, events, count)[0]

        rates, count = fly([POINT.mass], [complex(SPEED)], force, update_guide, DURATION, steps, 1)
        return rates[0], events[:count]

    return throw


# ln[(1+C)/(1-C e)] = C(1+e) with C = 3(1-c_e^2)/4, solved to ten digits
@pytest.mark.parametrize(
    ("coefficient", "exact"), [(0.9, 0.9131766778), (0.5, 0.7252411140), (0.1, 0.6652654068)]
)
def test_restitution_converges_to_the_exact_value_at_second_order(thrown, coefficient, exact):
    counts = [150, 300, 600, 1200, 2400, 4800]
    errors = [abs(-thrown(coefficient, n)[0] / SPEED - exact) for n in counts]
    order = -np.polyfit(np.log(counts), np.log(errors), 1)[0]
    # Where in its step the touch falls differs from step to step: the errors scatter about the line
    assert order == pytest.approx(2.0, abs=0.2), errors
    # 170 us of contact in 1360 steps: (pi / 1360)^2 / 12 = 4e-7 for a half-wave, with some margin
    assert errors[-1] < 1.5e-6


def test_event_of_an_impact(thrown):
    speed, events = thrown(1.0, 4800)
    assert len(events) == 2  # both right corners, at once
    for event in events:
        # Free flight up to the touch; the rest of that step, 1e-7 s at most, brakes by some 1e-9 m/s already
        assert event["normal_speed"] == pytest.approx(SPEED, rel=1e-7)
        assert event["start"] == pytest.approx(DISTANCE / SPEED, rel=1e-9)
        # Elastic Hertz contact of half the mass a corner, exact; second order in 1/1400 of the contact
        half = POINT.mass / 2
        assert event["end"] - event["start"] == pytest.approx(
            3.2181 * (half**2 / (4.8e9**2 * SPEED)) ** 0.2, rel=3e-5
        )
        assert event["largest_depth"] == pytest.approx((5 * half * SPEED**2 / (4 * 4.8e9)) ** 0.4, rel=1e-5)
        assert event["peak_force"] == pytest.approx(4.8e9 * event["largest_depth"] ** 1.5, rel=1e-12)
        assert event["impulse"] == pytest.approx(half * (SPEED - speed), rel=1e-6)


def test_plain_user_function_gives_the_same_motion(thrown):
    assert thrown(0.5, 300, compiled=False)[0] == pytest.approx(thrown(0.5, 300)[0], rel=1e-10)
