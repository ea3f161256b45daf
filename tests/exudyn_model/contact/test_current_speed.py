"""Damping without memory: the impact speed is replaced by the present depth rate, floored smoothly."""

import numpy as np
import pytest

from exudyn_model import simulate
from exudyn_model.contact.corners import slider_force
from exudyn_model.contact.gaps import contact_law
from exudyn_model.contact.laws import LAWS
from exudyn_model.contact.point import damped
from exudyn_model.contact.states import contact_states

FLOOR, DAMPING = 1e-4, 0.1425


@pytest.fixture
def law_of(guide, slider):
    """Function from changes of the paper's guide, without memory, to its record."""
    return lambda **changes: contact_law(guide(impact_speed="current", **changes), slider, 1e-6)


@pytest.mark.parametrize("rate", [-2.0, -1e-4, -1e-7, 0.0, 3e-5, 0.05])
def test_factor_of_the_damping(law_of, rate):
    expected = 100.0 * (1 + DAMPING * rate / np.hypot(rate, FLOOR))
    assert damped(100.0, rate, 0.05, law_of()[0]) == pytest.approx(expected, rel=1e-14)


def test_a_wall_does_not_pull_without_memory(law_of):
    assert damped(100.0, -1.0, 0.05, law_of(damping=1.2)[0]) == 0.0


@pytest.mark.parametrize("kind", LAWS)
def test_force_does_not_depend_on_the_speed_of_the_touch(law_of, kind):
    state, forces = (WALL_AND_DEPTH, 1e-5, 0.01, 0.3, 0.2), []
    for speed in (1e-3, 0.1):
        corners = contact_states()
        corners["impact_speed"] = speed
        forces.append(slider_force(*state, law_of(law=kind, friction=0.0), corners))
    assert forces[0] == forces[1]
    assert forces[0][0] < 0.0


WALL_AND_DEPTH = 2e-4 + 1e-6


@pytest.mark.parametrize("kind", ["hertz-corners", "strip", "foundation"])
def test_each_law_is_damped_by_the_present_rate(law_of, guide, slider, kind):
    """Straight into the right wall at 3e-4 m/s: one rate for all corners and for the side."""
    corners = contact_states()
    corners["impact_speed"] = 1.0
    state = WALL_AND_DEPTH, 0.0, 3e-4, 0.0, 0.0
    elastic = slider_force(*state, contact_law(guide(law=kind, damping=0.0), slider, 1e-6), corners)
    found = slider_force(*state, law_of(law=kind), corners)
    assert found[0] / elastic[0] == pytest.approx(1 + DAMPING * 3 / np.sqrt(10), rel=1e-12)


TREE = {"formulation": "tree", "method": "dopri5", "step": 1e-4, "tolerance": 1e-9}
FULL = {"formulation": "full", "method": "generalized-alpha", "step": 1e-6, "tolerance": 1e-7}


def run(make_scene, solver, impact_speed, **changes):
    changes = {key.replace("__", "."): value for key, value in changes.items()}
    return simulate(
        make_scene(changes | {"contact.impact_speed": impact_speed, "solver.exudyn": dict(solver)})
    )


@pytest.mark.parametrize("pin", ["ideal", "clearance"])
@pytest.mark.parametrize("law", ["hertz-corners", "foundation"])
@pytest.mark.parametrize("solver", [TREE, FULL], ids=["tree", "full"])
def test_without_loss_both_speeds_give_the_same_motion_to_the_last_digit(make_scene, solver, law, pin):
    changes = {"contact__law": law, "joints__crank_pin": pin, "contact__restitution": 1.0}
    frozen, current = (
        run(make_scene, solver, speed, drive__cycles=0.05, **changes) for speed in ("frozen", "current")
    )
    assert len(frozen.events["start"]) > 1
    for name, column in frozen.columns.items():
        np.testing.assert_array_equal(current.columns[name], column, err_msg=name)
    for name, column in frozen.events.items():  # the speed at the touch, too
        np.testing.assert_array_equal(current.events[name], column, err_msg=name)


@pytest.mark.parametrize("law", ["hertz-corners", "foundation"])
def test_five_bodies_approach_the_tree_without_memory(make_scene, error, law):
    """0.06 cycles; the damping turns at the end of an approach within 1e-4 m/s, a part of a longer step."""
    exact = run(make_scene, TREE, "current", contact__law=law, drive__cycles=0.06)
    frozen = run(make_scene, TREE, "frozen", contact__law=law, drive__cycles=0.06)
    assert error(frozen, exact, "slider_x") > 1e-5
    errors = []
    for step in (2.5e-7, 6.25e-8):
        close = run(make_scene, FULL | {"step": step}, "current", contact__law=law, drive__cycles=0.06)
        assert close.status == "success"
        errors.append(error(close, exact, "slider_x"))
    assert errors[0] > 4 * errors[1]
    # Measured 7.0e-6 and 4.6e-8 m on the foundation, 1.9e-10 and 9e-12 m with Hertz's corners
    assert errors[1] < 1.5e-7


def test_where_the_iteration_goes_back_and_forth_the_step_is_divided(make_scene):
    """Hertz's corners at 2e-6 s: the damping turns within the floor of the impact speed in less than a step.

    Undivided, Newton's method ended the run. Impulses are 5.5e-5 apart, as measured; ten times that.
    """
    divided = run(make_scene, FULL | {"step": 2e-6}, "current", drive__cycles=0.03)
    exact = run(make_scene, TREE, "current", drive__cycles=0.03)
    assert divided.status == exact.status == "success"
    assert list(divided.events["corner"]) == list(exact.events["corner"])
    np.testing.assert_allclose(divided.events["impulse"], exact.events["impulse"], rtol=5e-4)
