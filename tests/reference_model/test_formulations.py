"""The formulations against each other, and how well the multiplier form keeps its constraints."""

import numpy as np
import pytest
from reference_states import EACH, IDEAL, MULTIPLIER

from reference_model import simulate
from reference_model.contact import TAIL
from reference_model.multiplier import drift, press
from reference_model.observation import all_bodies
from reference_model.parameters import read_parameters
from reference_model.reactions import REACTIONS
from reference_model.running import formulation, start

BDF, TOLERANCE = {"solver.reference.method": "BDF"}, "solver.reference.tolerance"
JOINTS = {"output.groups": ["accelerations", "joints", "energy"]}
FORMULATIONS = pytest.mark.parametrize("changes", EACH.values(), ids=EACH.keys())
GAINS = pytest.mark.parametrize("gain", [3.0, 30.0, 300.0])


def stabilized(gain):
    return MULTIPLIER | dict.fromkeys([f"solver.reference.baumgarte_{k}" for k in ("alpha", "beta")], gain)


@GAINS
def test_the_multiplier_form_is_the_minimal_one_for_gains_over_two_decades(scene, gain):
    """The ideal mechanism to 1e-10 m, reactions to 1e-6 of range; with contacts to 1e-8 m over a cycle."""
    for changes, bound in ((IDEAL | JOINTS, 1e-10), ({}, 1e-8)):
        cycle = {**changes, "drive.cycles": 1.0, TOLERANCE: 1e-12}
        exact, full = (simulate(scene(cycle | values)).columns for values in ({}, stabilized(gain)))
        for name in ("slider_x", "slider_y"):
            assert np.abs(full[name] - exact[name]).max() < bound
        for name in REACTIONS[:13] if changes else ():
            assert np.abs(full[name] - exact[name]).max() <= 1e-6 * np.ptp(exact[name])


# Scipy's solvers take what is recorded from the same places for all formulations.
SOLVED = [*((name, "dop853") for name in EACH), ("slider", "LSODA"), ("multiplier", "LSODA")]


@pytest.mark.parametrize(("name", "method"), SOLVED)
def test_what_is_asked_for_beyond_the_motion_does_not_change_it(scene, name, method):
    """Motion, its extrema and the contacts, where nothing else is computed and where everything is."""
    changes = EACH[name]
    short = {**changes, "solver.reference.method": method, "drive.cycles": 0.1}
    few, all_ = (
        simulate(scene({**short, "output.groups": groups}))
        for groups in ([], ["accelerations", "corners", "joints", "energy"])
    )
    assert len(few.columns) == 7
    # The same formulas of the same states, but for the order of their terms: rounding of 0.55 m and some m/s,
    # and of angles that go through a tangent and back.
    for channel, values in few.columns.items():
        np.testing.assert_allclose(values, all_.columns[channel], rtol=0, atol=1e-14)
    for channel, values in few.extrema.items():
        for end in ("min", "max"):
            assert values[end] == pytest.approx(all_.extrema[channel][end], rel=0, abs=1e-14)
    for column, values in few.events.items():
        np.testing.assert_array_equal(values, all_.events[column])
    assert ("constraints" in few.provenance) == (changes.keys() >= MULTIPLIER.keys())


@FORMULATIONS
def test_energy_residual(scene, changes):
    """At strict tolerance at most 1e-8 of damping and friction so far, or of the largest kinetic energy.

    The first losses are no measure yet: below a hundredth of the cycle's, that hundredth counts.
    """
    columns = simulate(scene({**changes, **JOINTS, TOLERANCE: 1e-14, "drive.cycles": 1.0})).columns
    lost = columns["energy_damping"] + columns["energy_friction"]
    scale = np.where(lost > 0.0, np.maximum(lost, 1e-2 * lost.max()), columns["energy_kinetic"].max())
    assert np.abs(columns["energy_residual"] / scale).max() < 1e-8


@FORMULATIONS
def test_start_is_consistent(scene, changes):
    """Phi = 0 and Phi' = 0 at t = 0; also of a pin with clearance, which starts centred and at rest in it."""
    free = {"initial.slider_angle": 1e-3, "initial.slider_vx": 0.01, "initial.slider_omega": 0.5}
    p = read_parameters(scene({**free, **changes}))
    model, _ = formulation(p)
    if model is None:  # the ideal mechanism has no state
        return
    y = np.concatenate([start(p, model), np.zeros(TAIL)])[:, None]
    bodies = all_bodies(model, p.mechanism, np.zeros(1), y, np.zeros_like(y))[:, :, 0]
    linkage = press(p.mechanism, p.load, ideal_slider=p.ideal_slider, baumgarte=(0.0, 0.0))
    q, computed = np.concatenate([bodies[:, :3].ravel(), bodies[:, 3:6].ravel()]), np.empty((2, 1))
    drift(linkage, np.zeros(1), q[:, None], computed)
    # A few roundings of coordinates up to 0.55 m and angles up to 3 rad; speeds up to 20 rad/s.
    assert computed[0, 0] < 2e-15
    assert computed[1, 0] < 2e-14


def drift_of(scene, gain, cycles, changes):
    values = {**stabilized(gain), **changes, "drive.cycles": cycles, "output.groups": []}
    result = simulate(scene(values))
    assert result.status == "success"
    return result.provenance["constraints"]


def test_constraints_drift_quadratically_without_stabilization(scene):
    """Phi'' = 0 keeps an error of Phi', and Phi grows with it: like t^2 while BDF adds to it."""
    cycles = np.array([2.0, 4.0, 8.0, 16.0])
    drifts = [drift_of(scene, 0.0, n, IDEAL | BDF | {TOLERANCE: 1e-8}) for n in cycles]
    # A steady error of Phi'' would be 2, one of random sign 1.5; of Phi' 1 and 0.5.
    for what, least, most in (("position", 1.4, 2.2), ("velocity", 0.4, 1.2)):
        assert least < np.polyfit(np.log(cycles), np.log([d[what] for d in drifts]), 1)[0] < most


@GAINS
def test_baumgarte_bounds_the_drift(scene, gain):
    """After some 1 / alpha it is no longer a matter of time, and with contacts far below the tolerance."""
    early, late = (drift_of(scene, gain, n, IDEAL | BDF | {TOLERANCE: 1e-8}) for n in (8.0, 16.0))
    # Eight cycles are 3.2 s, ten times the slowest 1 / alpha; without the terms Phi grows fourfold.
    assert all(late[what] < 1.3 * early[what] for what in ("position", "velocity"))
    drift = drift_of(scene, gain, 2.0, {TOLERANCE: 1e-10})
    assert drift["position"] < 1e-10
    assert drift["velocity"] < 1e-7  # a local error of velocities, 1e-10 m in 1e-3 s
    assert 0.0 <= drift["position_time_s"] <= 0.8


@pytest.mark.parametrize("tolerance", [1e-6, 1e-9])
def test_error_of_the_ideal_mechanism_is_that_of_its_constraints(scene, tolerance):
    """Phi = 0 alone says where the ideal mechanism is: what y is off by is Phi times the levers."""
    ideal = IDEAL | {"drive.cycles": 1.0}
    run = simulate(scene(ideal | MULTIPLIER | BDF | {TOLERANCE: tolerance}))
    error = np.abs(run.columns["slider_y"] - simulate(scene(ideal)).columns["slider_y"]).max()
    # The slider moves by 2.84 times what the pin A does; 15 rows and arms of 0.3 m may add up, or cancel.
    assert 0.1 < error / run.provenance["constraints"]["position"] < 10.0
