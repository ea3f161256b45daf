"""The formulations against each other: from the same state, and along trajectories."""

import numpy as np
import pytest

from reference_model import simulate
from reference_model.bodies import ideal_motion
from reference_model.constants import Formulation, as_record
from reference_model.forces import CONTACTS, GAP, MODES, SLIP
from reference_model.formulations import right_hand_side, state_size
from reference_model.friction import friction_regime
from reference_model.linkage import rod4_from_slider
from reference_model.mechanism import fill_bodies
from reference_model.multiplier import constraints, masses, multipliers, weights
from reference_model.reactions import REACTIONS, reactions
from reference_model.reading import read_parameters
from reference_model.start import start

STATES_EACH = 200
MULTIPLIER = {"solver.reference.formulation": "multiplier"}
JOINTS = {"output.groups": ["accelerations", "joints", "energy"]}


def evaluate(c, t, head, modes):
    """Return the derivative of a state, its contacts and the motion of all bodies."""
    y, dy = np.zeros(state_size(c)), np.zeros(state_size(c))
    y[: head.size] = head
    contacts, bodies = np.zeros((5, CONTACTS)), np.empty((5, 9))
    contacts[GAP] = np.inf
    right_hand_side(c, t, y, modes, dy, contacts)
    fill_bodies(c, t, y, dy, bodies)
    return dy, contacts, bodies


def random_states(scene, seed=0):
    """Yield times and states of the press with random corners inside the walls, and their modes."""
    p = read_parameters(
        scene({"solver.reference.baumgarte_alpha": 0.0, "solver.reference.baumgarte_beta": 0.0})
    )
    c, y0 = start(p, Formulation.SLIDER)
    rng = np.random.default_rng(seed)
    for _ in range(STATES_EACH):
        modes = np.zeros((MODES, CONTACTS))
        modes[0, :4] = rng.choice([0.0, 1.0], 4) * rng.uniform(0.01, 0.05, 4)
        head = y0 + rng.normal(size=4) * np.array([5e-4, 2e-3, 0.1, 1.0])
        yield p, c, rng.uniform(0.0, p.period), head, modes


def as_coordinates(bodies):
    return np.concatenate([bodies[:, :3].ravel(), bodies[:, 3:6].ravel()])


def test_accelerations_of_minimal_and_multiplier_agree_from_the_same_state(scene) -> None:
    touched = 0
    for p, c, t, head, modes in random_states(scene):
        # theta_4 must close the chain at another time: move it with the tip.
        head[0] += rod4_from_slider(c, t, p.guide_x, 0.0)[0] - rod4_from_slider(c, 0.0, p.guide_x, 0.0)[0]
        slips = evaluate(c, t, head, modes)[1][SLIP]
        modes[1] = [friction_regime(c, slip) for slip in slips]
        _, contacts, few = evaluate(c, t, head, modes)
        full = as_record(p.constants, Formulation.MULTIPLIER)
        _, _, many = evaluate(full, t, as_coordinates(few), modes)
        touched += contacts[3].any()
        # Gaps are differences of 0.55 m coordinates and round at some 1e-16 m; a force amplifies that by
        # 1.5 K sqrt(depth), an acceleration by the smallest effective inertia on top; 1e-11 of scale remains.
        depth = max(0.0, -contacts[GAP, :4].min())
        force = 4 * (1.5 * c.K * np.sqrt(depth) * 1e-15 + 1e-12 * contacts[3].max())
        np.testing.assert_allclose(many[:, 6:8], few[:, 6:8], rtol=0, atol=force / 0.02 + 1e-11 * 500)
        np.testing.assert_allclose(many[:4, 8], few[:4, 8], rtol=0, atol=force / 0.02 / 0.045 + 1e-11 * 1e4)
        np.testing.assert_allclose(many[4, 8], few[4, 8], rtol=0, atol=force * 0.05 / c.J5 + 1e-11 * 5e4)
    assert touched > STATES_EACH // 10


def test_reactions_are_the_multipliers(scene) -> None:
    """Inverse dynamics body after body against -lambda of the rows, ideal and with a contact force."""
    p = read_parameters(
        scene({"solver.reference.baumgarte_alpha": 0.0, "solver.reference.baumgarte_beta": 0.0})
    )
    c = as_record(p.constants, Formulation.IDEAL)
    rng = np.random.default_rng(1)
    for t in rng.uniform(0.0, p.period, 50):
        bodies = ideal_motion(c, np.array([t]))[..., 0]
        q, v = bodies[:, :3].ravel(), bodies[:, 3:6].ravel()
        acceleration = np.empty(15)
        solution = multipliers(c, t, q, v, weights(c), 15, acceleration)
        np.testing.assert_allclose(
            acceleration, bodies[:, 6:].ravel(), rtol=0, atol=1e-9
        )  # of some 100 m/s^2
        out = np.empty(len(REACTIONS))
        reactions(c, bodies, 0.0, 0.0, True, True, (0.0, 0.0, 0.0, 0.0), out)
        # Rows are in the order O, A, H, B, C, F; the channels in O, A, B, H, C, F.
        order = [0, 1, 2, 3, 6, 7, 4, 5, 8, 9, 10, 11, 12, 13, 14]
        np.testing.assert_allclose(out, -solution[order], rtol=0, atol=1e-11 * 50)  # of some 50 N


def test_constraint_derivatives(scene) -> None:
    """Phi_q and gamma against differences of Phi and of Phi' along a motion."""
    c = as_record(read_parameters(scene()).constants, Formulation.MULTIPLIER_IDEAL)
    rng = np.random.default_rng(2)
    q, v, h = rng.normal(size=15), rng.normal(size=15), 1e-6

    def rows(q, v, t):
        phi, rate, gamma, jacobian = np.empty(15), np.empty(15), np.empty(15), np.empty((15, 15))
        constraints(c, t, q, v, phi, rate, jacobian, gamma)
        return phi, rate, gamma, jacobian

    _, rate, gamma, jacobian = rows(q, v, 0.1)
    for j in range(15):
        step = np.zeros(15)
        step[j] = h
        column = (rows(q + step, v, 0.1)[0] - rows(q - step, v, 0.1)[0]) / (2 * h)
        np.testing.assert_allclose(column, jacobian[:, j], atol=1e-9)  # round-off 1e-16 / 1e-6
    ahead, behind = rows(q + h * v, v, 0.1 + h), rows(q - h * v, v, 0.1 - h)
    np.testing.assert_allclose((ahead[0] - behind[0]) / (2 * h), rate, atol=1e-7)  # Phi grows to omega t
    # Unaccelerated, Phi'' = -gamma.
    np.testing.assert_allclose((ahead[1] - behind[1]) / (2 * h), -gamma, atol=1e-9)
    assert np.all(masses(c) > 0.0)


@pytest.mark.parametrize("gain", [3.0, 30.0, 300.0])
def test_ideal_mechanism_of_the_multiplier_form(scene, gain) -> None:
    """To 1e-10 m, reactions and torque to 1e-6 of range, for Baumgarte's alpha = beta over two decades."""
    changes = {"joints.slider": "ideal", **JOINTS, "drive.cycles": 1.0}
    gains = {"solver.reference.baumgarte_alpha": gain, "solver.reference.baumgarte_beta": gain}
    exact = simulate(scene(changes)).columns
    full = simulate(scene({**changes, **MULTIPLIER, **gains, "solver.reference.tolerance": 1e-12})).columns
    assert np.abs(full["slider_y"] - exact["slider_y"]).max() < 1e-10
    for name in REACTIONS[:13]:
        assert np.abs(full[name] - exact[name]).max() <= 1e-6 * np.ptp(exact[name])


@pytest.mark.parametrize("gain", [3.0, 30.0, 300.0])
def test_slider_clearance_of_the_multiplier_form(scene, gain) -> None:
    """To 1e-8 m over the first cycle, for Baumgarte's alpha = beta over two decades."""
    changes = {"drive.cycles": 1.0, "solver.reference.tolerance": 1e-12}
    gains = {"solver.reference.baumgarte_alpha": gain, "solver.reference.baumgarte_beta": gain}
    few = simulate(scene(changes)).columns
    full = simulate(scene({**changes, **MULTIPLIER, **gains})).columns
    assert np.abs(full["slider_x"] - few["slider_x"]).max() < 1e-8
    assert np.abs(full["slider_y"] - few["slider_y"]).max() < 1e-8


EACH = {
    "slider": {},
    "ideal": {"joints.slider": "ideal"},
    "pin": {"joints.slider": "ideal", "joints.crank_pin": "clearance"},
    "both": {"joints.crank_pin": "clearance"},
    "multiplier": MULTIPLIER,
    "multiplier ideal": {**MULTIPLIER, "joints.slider": "ideal"},
}


@pytest.mark.parametrize("changes", EACH.values(), ids=EACH.keys())
@pytest.mark.parametrize("method", ["dop853", "LSODA"])
def test_what_is_asked_for_beyond_the_motion_does_not_change_it(scene, changes, method) -> None:
    """Motion, its extrema and the contacts, where nothing else is computed and where everything is."""
    short = {**changes, "solver.reference.method": method, "drive.cycles": 0.1}
    few, all_ = (
        simulate(scene({**short, "output.groups": groups}))
        for groups in ([], ["accelerations", "corners", "joints", "energy"])
    )
    assert len(few.columns) == 7
    for name, values in few.columns.items():
        # The same formulas of the same states, but for the order of their terms: rounding of 0.55 m and some
        # m/s, and of angles that go through a tangent and back.
        np.testing.assert_allclose(values, all_.columns[name], rtol=0, atol=1e-14)
    for name, values in few.extrema.items():
        assert values["min"] == pytest.approx(all_.extrema[name]["min"], rel=0, abs=1e-14)
        assert values["max"] == pytest.approx(all_.extrema[name]["max"], rel=0, abs=1e-14)
    assert (few.events["corner"] == all_.events["corner"]).all()
    for name in ("start", "end", "normal_speed", "impulse", "peak_force", "largest_depth"):
        np.testing.assert_array_equal(few.events[name], all_.events[name])


@pytest.mark.parametrize("changes", EACH.values(), ids=EACH.keys())
def test_energy_residual(scene, changes) -> None:
    """At strict tolerance at most 1e-8 of damping and friction so far, or of the largest kinetic energy.

    The first losses are no measure yet: below a hundredth of the cycle's, that hundredth counts.
    """
    strict = {"solver.reference.tolerance": 1e-14, "drive.cycles": 1.0}
    columns = simulate(scene({**changes, **JOINTS, **strict})).columns
    lost = columns["energy_damping"] + columns["energy_friction"]
    scale = np.where(lost > 0.0, np.maximum(lost, 1e-2 * lost.max()), columns["energy_kinetic"].max())
    assert np.abs(columns["energy_residual"] / scale).max() < 1e-8


def test_free_pin_with_a_tiny_clearance_is_the_ideal_pin(scene) -> None:
    """As the clearance at A goes to zero the slider moves as without, at first order in the clearance."""
    ideal = simulate(scene({"joints.slider": "ideal", "drive.cycles": 0.3})).columns["slider_y"]
    deviations = []
    for clearance in (1e-4, 1e-5):
        changes = {
            "joints.slider": "ideal",
            "joints.crank_pin": "clearance",
            "clearance.crank_pin": clearance,
            "drive.cycles": 0.3,
        }
        y = simulate(scene(changes)).columns["slider_y"]
        deviations.append(np.abs(y - ideal).max())
        # A rigid shift of the pin moves the slider by at most 5.67e-4 / 2e-4 = 2.84 times as much; the depth
        # of the contact (a few um) comes on top.
        assert deviations[-1] < 2.9 * (clearance + 1e-5)
    assert deviations[1] < 0.3 * deviations[0]


def test_both_clearances_reduce_to_one(scene) -> None:
    """With a tight bearing at A the four-coordinate form follows the two-coordinate one."""
    changes = {"drive.cycles": 0.1, "solver.reference.tolerance": 1e-11}
    one = simulate(scene(changes)).columns
    both = simulate(scene({**changes, "joints.crank_pin": "clearance", "clearance.crank_pin": 1e-8})).columns
    # The journal sinks in by some um under some 10 N, which moves the slider by up to 2.84 times that.
    assert np.abs(both["slider_y"] - one["slider_y"]).max() < 1e-5
