"""How well the constraints are met: exactly at the start, and how far Baumgarte's terms let them drift."""

import numpy as np
import pytest

from reference_model import simulate
from reference_model.bodies import ideal_motion
from reference_model.constants import Formulation, as_record
from reference_model.formulations import state_size
from reference_model.mechanism import fill_bodies
from reference_model.multiplier import ROWS_IDEAL, drift, solve_definite
from reference_model.reading import read_parameters
from reference_model.start import start

IDEAL_SLIDER = {"joints.slider": "ideal"}
FREE_SLIDER = {"initial.slider_angle": 1e-3, "initial.slider_vx": 0.01, "initial.slider_omega": 0.5}
MULTIPLIER = {"solver.reference.formulation": "multiplier"}


def drift_of(scene, gain, cycles, changes):
    gains = {"solver.reference.baumgarte_alpha": gain, "solver.reference.baumgarte_beta": gain}
    result = simulate(scene({**MULTIPLIER, **gains, **changes, "drive.cycles": cycles, "output.groups": []}))
    assert result.status == "success"
    return result.provenance["constraints"]


@pytest.mark.parametrize(
    ("kind", "changes"),
    [
        (Formulation.IDEAL, IDEAL_SLIDER),
        (Formulation.SLIDER, FREE_SLIDER),
        (Formulation.PIN, IDEAL_SLIDER),
        (Formulation.BOTH, FREE_SLIDER),
        (Formulation.MULTIPLIER, FREE_SLIDER),
        (Formulation.MULTIPLIER_IDEAL, IDEAL_SLIDER),
    ],
    ids=lambda value: value.name if isinstance(value, Formulation) else "",
)
def test_start_is_consistent(scene, kind, changes) -> None:
    """Phi = 0 and Phi' = 0 at t = 0; also of a pin with clearance, which starts centred and at rest in it."""
    p = read_parameters(scene(changes))
    if kind is Formulation.IDEAL:
        c = as_record(p.constants, kind)
        bodies = ideal_motion(c, np.zeros(1))[..., 0]
    else:
        c, head = start(p, kind)
        y, bodies = np.zeros(state_size(c)), np.empty((5, 9))
        y[: head.size] = head
        fill_bodies(c, 0.0, y, np.zeros(y.size), bodies)
    state = np.concatenate([bodies[:, :3].ravel(), bodies[:, 3:6].ravel()])
    rows = ROWS_IDEAL if p.ideal_slider else ROWS_IDEAL - 2
    position, velocity = drift(c, 0.0, state, rows)
    # A few roundings of coordinates up to 0.55 m and angles up to 3 rad; speeds up to 20 rad/s.
    assert position < 2e-15
    assert velocity < 2e-14


def test_constraints_drift_quadratically_without_stabilization(scene) -> None:
    """Phi'' = 0 keeps an error of Phi', and Phi grows with it: like t^2 while BDF adds to it."""
    changes = {**IDEAL_SLIDER, "solver.reference.method": "BDF", "solver.reference.tolerance": 1e-8}
    cycles = np.array([2.0, 4.0, 8.0, 16.0])
    drifts = [drift_of(scene, 0.0, n, changes) for n in cycles]
    # A steady error of Phi'' would be 2, one of random sign 1.5; of Phi' 1 and 0.5.
    assert 1.4 < np.polyfit(np.log(cycles), np.log([d["position"] for d in drifts]), 1)[0] < 2.2
    assert 0.4 < np.polyfit(np.log(cycles), np.log([d["velocity"] for d in drifts]), 1)[0] < 1.2


@pytest.mark.parametrize("gain", [3.0, 30.0, 300.0])
def test_baumgarte_bounds_the_drift(scene, gain) -> None:
    """For alpha = beta over two decades the drift is, after some 1 / alpha, no longer a matter of time."""
    changes = {**IDEAL_SLIDER, "solver.reference.method": "BDF", "solver.reference.tolerance": 1e-8}
    early, late = (drift_of(scene, gain, n, changes) for n in (8.0, 16.0))
    # Eight cycles are 3.2 s, ten times the slowest 1 / alpha; without the terms Phi grows fourfold.
    assert late["position"] < 1.3 * early["position"]
    assert late["velocity"] < 1.3 * early["velocity"]


@pytest.mark.parametrize("gain", [3.0, 30.0, 300.0])
def test_drift_stays_far_below_the_tolerance_of_the_press(scene, gain) -> None:
    """With contacts and by the compiled integrator: what they kick must not stay in the constraints."""
    drift = drift_of(scene, gain, 2.0, {"solver.reference.tolerance": 1e-10})
    assert drift["position"] < 1e-10
    # Phi' follows a local error of velocities, 1e-10 m in 1e-3 s.
    assert drift["velocity"] < 1e-7
    assert 0.0 <= drift["position_time_s"] <= 0.8


def test_error_of_the_ideal_mechanism_is_that_of_its_constraints(scene) -> None:
    """Phi = 0 alone says where the ideal mechanism is: what y is off by is Phi times the levers."""
    ideal = {**IDEAL_SLIDER, "drive.cycles": 1.0}
    exact = simulate(scene(ideal)).columns["slider_y"]
    for tolerance in (1e-6, 1e-9):
        settings = {"solver.reference.method": "BDF", "solver.reference.tolerance": tolerance}
        run = simulate(scene({**ideal, **MULTIPLIER, **settings}))
        error = np.abs(run.columns["slider_y"] - exact).max()
        # The slider moves by 2.84 times what the pin A does; 15 rows and arms of 0.3 m may add up, or cancel.
        assert 0.1 < error / run.provenance["constraints"]["position"] < 10.0


def test_only_the_multiplier_form_has_constraints_to_report(scene) -> None:
    assert "constraints" not in simulate(scene({"drive.cycles": 0.05})).provenance


def test_a_definite_system_is_solved_within_its_rounding() -> None:
    """Of random matrices A A^T: the error is at most n^2 rounding units times the condition number."""
    rng = np.random.default_rng(3)
    for _ in range(50):
        factor, expected = rng.normal(size=(13, 13)), rng.normal(size=13)
        matrix = factor @ factor.T
        found = matrix @ expected
        solve_definite(matrix.copy(), found)
        error = np.linalg.norm(found - expected) / np.linalg.norm(expected)
        assert error <= 13**2 * np.finfo(float).eps * np.linalg.cond(matrix)


def test_of_dependent_constraints_no_solution_is_returned() -> None:
    """Two equal rows of exact numbers: the last pivot is exactly zero."""
    found = np.ones(2)
    solve_definite(np.array([[4.0, 4.0], [4.0, 4.0]]), found)
    assert not np.isfinite(found).any()
