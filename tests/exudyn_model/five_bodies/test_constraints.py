"""What a run says of its violated constraints is what was violated."""

import numpy as np
import pytest

from exudyn_model import simulate
from exudyn_model.assembly import assemble
from exudyn_model.five_bodies.constraints import Constraints
from exudyn_model.five_bodies.mechanism import build
from exudyn_model.five_bodies.recording import Recorder
from exudyn_model.five_bodies.step_choice import StepChoice
from exudyn_model.reading import read_scene


def assembled(make_scene, changes):
    parameters = read_scene(make_scene(changes))
    state = assemble(parameters)
    q, v = state.positions.ravel(), state.velocities.ravel()
    q[12] -= parameters.mechanism.guide_x
    constraints = Constraints(parameters)

    def violation(time, q, off=0.0):
        return constraints.violation(np.array([time]), q[np.newaxis], (v + off)[np.newaxis])[:, 0]

    return violation, q, parameters


@pytest.mark.parametrize("ideal", ["clearance", "ideal"])
def test_an_assembled_mechanism_violates_nothing(make_scene, ideal):
    violation, q, _ = assembled(make_scene, {"joints.slider": ideal})
    position, velocity = violation(0.0, q)
    assert position < 1e-15  # coordinates of some 0.5 m, rounded
    assert velocity < 1e-14  # by a linear solve


@pytest.mark.parametrize("coordinate", range(15))
def test_a_rate_that_does_not_fit_violates_as_much_as_it_opens_in_time(make_scene, coordinate):
    violation, q, _ = assembled(make_scene, {})
    unit, interval = np.eye(15)[coordinate], 1e-6
    opened = violation(0.0, q + 1e-3 * interval * unit)[0]
    # The joints rotate on by 1e-9 rad times the square of the rate
    assert violation(0.0, q, 1e-3 * unit)[1] == pytest.approx(opened / interval, rel=1e-6, abs=1e-9)


@pytest.mark.parametrize("body", range(5))
@pytest.mark.parametrize("coordinate", [0, 1])
def test_a_body_out_of_place_opens_its_joints_by_as_much(make_scene, body, coordinate):
    violation, q, _ = assembled(make_scene, {})
    q[3 * body + coordinate] += 1e-6
    assert violation(0.0, q)[0] == pytest.approx(1e-6, rel=1e-9)


def test_the_drive_counts_in_radians_and_an_ideal_slider_keeps_its_line(make_scene):
    violation, q, parameters = assembled(make_scene, {})
    # The crank stays where it was while the drive has gone on
    assert violation(1e-6, q)[0] == pytest.approx(1e-6 * parameters.drive.omega, rel=1e-9)
    q[14] += 0.1  # a slider with clearance may rotate
    assert violation(0.0, q)[0] < 1e-15
    violation, q, _ = assembled(make_scene, {"joints.slider": "ideal"})
    q[14] += 1e-3
    assert violation(0.0, q)[0] == pytest.approx(1e-3)


@pytest.mark.parametrize("pin", ["ideal", "clearance"])
def test_a_pin_with_clearance_is_no_constraint(make_scene, pin):
    """Rod 2 rotated about B opens A alone."""
    violation, q, parameters = assembled(make_scene, {"joints.crank_pin": pin})
    rod2, rotation = parameters.mechanism.rod2, 1e-6
    along = np.array([np.cos(q[5]), np.sin(q[5])])
    q[3:5] += rod2.to_tip * rotation * np.array([along[1], -along[0]])
    q[5] += rotation
    opened = rod2.length * rotation * np.abs([along[1], along[0]]).max()
    # The rotation is taken as small: its square is 1e-12 of half a length
    assert violation(0.0, q)[0] == pytest.approx(0.0 if pin == "clearance" else opened, abs=3e-13)


@pytest.mark.parametrize("slider", ["clearance", "ideal"])
def test_states_together_violate_what_each_does(make_scene, slider):
    parameters = read_scene(make_scene({"joints.slider": slider}))
    constraints, random = Constraints(parameters), np.random.default_rng(1)
    times, q, v = random.random(7), *random.standard_normal((2, 7, 15))
    together = constraints.violation(times, q, v)
    assert together.shape == (2, 7)
    for n in range(7):
        one = slice(n, n + 1)
        # Sums of seven numbers of some 1, in another order
        np.testing.assert_allclose(
            together[:, one], constraints.violation(times[one], q[one], v[one]), rtol=1e-14
        )


@pytest.mark.parametrize("worst", [0, 255, 256, 700, 799])
def test_no_state_is_left_out(make_scene, worst):
    """Neither at the ends of a run nor where the recorder judges those that it has kept."""
    parameters = read_scene(make_scene({}))
    state = assemble(parameters)
    model = build(parameters, state, 1e-9)
    choice = StepChoice(model.constants, model.contacts, 1e-9, 1, 1)
    recorder = Recorder(model, choice, 800, 0.4, np.zeros(0), Constraints(parameters))
    q, v = state.positions.ravel(), state.velocities.ravel()
    q[12] -= parameters.mechanism.guide_x
    recorder.follow(q, v, np.zeros(13))
    for number in range(800):
        q[3] += 1e-3 * (number == worst)
        recorder.accept()
        q[3] -= 1e-3 * (number == worst)
        choice.choose()
    # The joints are closed to 1e-15 m; the drive goes on by 1e-5 rad while the state is held
    assert recorder.drift()["position"] == (pytest.approx(1e-3, abs=2e-15), worst * 1e-9)


@pytest.mark.parametrize("method", ["generalized-alpha", "trapezoidal-index2"])
def test_a_run_tells_the_largest_violation(make_scene, method):
    """At position level what Newton's tolerance leaves; at velocity level what the steps add up to."""
    found = []
    for step in (8e-6, 4e-6):
        changes = {"drive.cycles": 0.1, "solver.exudyn.step": step, "solver.exudyn.method": method}
        recorded = simulate(make_scene(changes)).provenance["constraints"]
        # In flight steps are up to 32 times as long, 8 times for index 2: measured 5e-7 m/s and 7e-9 m
        for name, bound in (("position", 1e-8), ("velocity", 1e-6)):
            assert 0.0 <= recorded[f"{name}_time_s"] <= 0.04
            assert 0.0 < recorded[name] < bound
        found.append(recorded["position"])
    assert max(found) < 1e-8
    assert min(found) > 0.0
