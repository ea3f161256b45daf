"""Exudyn's own contact object against the user function, and what it reports of its contacts."""

import numpy as np
import pytest

from exudyn_model import simulate
from exudyn_model.five_bodies.native_contact import proportional_zone, restitution
from exudyn_model.reading import read_scene

NATIVE = {"solver.exudyn.formulation": "native"}


def distance(make_scene, changes, name="slider_x"):
    user, native = (simulate(make_scene(changes | extra)).columns[name] for extra in ({}, NATIVE))
    return np.max(np.abs(user - native))


def test_coefficients(make_scene):
    contact = read_scene(make_scene({})).contact
    # 1 - (1 - 0.9^2) / 2
    assert restitution(contact) == pytest.approx(0.905, rel=1e-12)
    assert proportional_zone(contact) == 1e-3


def test_agrees_with_the_user_function_through_the_first_impacts(make_scene):
    """The first 0.04 s, seven contacts; Exudyn freezes the impact speed at the end of a step."""
    changes = {"drive.cycles": 0.1}
    # Measured 4.8e-9 m at 2e-6 s: 2.5e-6 m/s of the impact speed, of which damping takes a tenth
    assert distance(make_scene, changes) < 1e-8
    assert distance(make_scene, changes | {"solver.exudyn.step": 2.5e-7}) < 2.5e-9
    # 10 nm less in 5 um of a corner's stiffness would be seen
    assert distance(make_scene, changes | {"contact.restitution": 0.5}) < 1e-7


@pytest.mark.slow
def test_agrees_with_the_user_function_over_the_first_cycle(make_scene):
    # Measured 3.7e-8 m, 4e-6 rad
    assert distance(make_scene, {"drive.cycles": 1.0}) < 1e-7


def test_without_friction_nothing_but_the_impact_speed_differs(make_scene):
    changes = {"drive.cycles": 0.05, "friction.coefficient": 0.0, "contact.restitution": 1.0}
    # Undamped: what longer steps in flight leave; measured 2.9e-11
    assert distance(make_scene, changes) < 1e-10


def test_opposite_corners(make_scene):
    """A slider that rotates until it is wedged between both walls."""
    changes = {"drive.cycles": 0.005, "initial.slider_omega": 5.0, "initial.slider_offset": 0.0}
    user, native = (simulate(make_scene(changes | extra)) for extra in ({}, NATIVE))
    assert set(user.events["corner"]) == set(native.events["corner"]) == {"ul", "lr"}
    # The sphere's 1e-4 m (6e-3)^2 / 2 = 2e-9 m of 0.2 mm, at 0.2 m/s: 1e-8 s of 1 ms; the impact speeds
    np.testing.assert_allclose(native.events["start"], user.events["start"], rtol=0, atol=5e-8)
    np.testing.assert_allclose(native.events["impulse"], user.events["impulse"], rtol=1e-3)
    for name in ("slider_x", "slider_angle"):
        assert np.max(np.abs(user.columns[name] - native.columns[name])) < 1e-3 * np.ptp(user.columns[name])


def test_events_and_forces_are_exudyn_s(make_scene):
    changes = {
        "drive.cycles": 0.1,
        "output.groups": ["accelerations", "corners", "energy"],
        "solver.exudyn.method": "auto",
    }
    user, native = (simulate(make_scene(changes | extra)) for extra in ({}, NATIVE))
    assert list(native.columns) == list(user.columns)
    assert list(native.events["corner"]) == list(user.events["corner"])
    # Times follow 5e-9 m at 30 mm/s; speeds are those of a step's end, at 60 m/s^2; forces follow both
    np.testing.assert_allclose(native.events["start"], user.events["start"], rtol=0, atol=1e-6)
    np.testing.assert_allclose(native.events["normal_speed"], user.events["normal_speed"], rtol=0, atol=1e-4)
    np.testing.assert_allclose(native.events["impulse"], user.events["impulse"], rtol=2e-4)
    np.testing.assert_allclose(native.events["peak_force"], user.events["peak_force"], rtol=1e-3)
    # Both audits close alike: forces and gaps recorded are those that acted
    residual = [np.max(np.abs(run.columns["energy_residual"])) for run in (user, native)]
    assert residual[1] < 2 * residual[0]
    assert native.provenance["formulation"] == "five bodies, native contact"


def test_a_start_inside_the_wall_begins_a_contact(make_scene):
    changes = {"initial.slider_offset": 2.02e-4, "initial.slider_vx": 0.03, "drive.cycles": 0.002}
    user, native = (simulate(make_scene(changes | extra)) for extra in ({}, NATIVE))
    assert native.events["start"][0] == pytest.approx(0.0, abs=1e-12)
    # The impact speed is that after a step of 2 us at up to 1400 m/s^2: 10 % of 0.03 m/s, a hundredth of it
    # in the speed afterwards, over 0.8 ms
    np.testing.assert_allclose(native.columns["slider_x"], user.columns["slider_x"], rtol=0, atol=2e-7)


def test_a_start_at_rest_inside_a_wall_is_refused(make_scene):
    changes = {"solver.exudyn.formulation": "native", "initial.slider_offset": 2.01e-4, "drive.cycles": 0.01}
    with pytest.raises(ValueError, match=r"1e-06 m inside a wall.*use 'full'"):
        simulate(make_scene(changes))
    # On the wall it begins with the touch
    assert simulate(make_scene(changes | {"initial.slider_offset": 2e-4})).status == "success"


def test_a_corner_that_comes_out_behind_its_wall_stops_the_run(make_scene):
    """So soft that the corners are pressed in by 1 mm: Exudyn's sphere of 0.1 mm would let them through."""
    soft = {"contact.youngs_modulus": 1e6, "drive.cycles": 0.2, "solver.exudyn.step": 8e-6}
    result = simulate(make_scene(soft | {"solver.exudyn.formulation": "native"}))
    assert result.status == "out-of-range"
    assert "'full'" in result.remedy
    # What was recorded before is what the user function gives
    whole = simulate(make_scene(soft))
    assert whole.status == "success"
    until = len(result.columns["slider_x"]) - 2
    assert 1 < until < 190
    # Up to the radius; but for the impact speed at the step's end the contact is the same
    assert abs(result.columns["slider_x"][:until] - whole.columns["slider_x"][:until]).max() < 2e-6
