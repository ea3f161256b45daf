"""How well the constraints are met: exactly at the start, and how far Baumgarte's terms let them drift."""

import numpy as np
import pytest

from reference_model import simulate

IDEAL_SLIDER = {"joints.slider": "ideal"}
MULTIPLIER = {"solver.reference.formulation": "multiplier"}


def drift_of(scene, gain, cycles, changes):
    gains = {"solver.reference.baumgarte_alpha": gain, "solver.reference.baumgarte_beta": gain}
    result = simulate(scene({**MULTIPLIER, **gains, **changes, "drive.cycles": cycles, "output.groups": []}))
    assert result.status == "success"
    return result.provenance["constraints"]


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
