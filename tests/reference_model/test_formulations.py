"""The formulations against each other: from the same state, and along trajectories."""

import numpy as np
import pytest

from reference_model import simulate
from reference_model.reactions import REACTIONS

MULTIPLIER = {"solver.reference.formulation": "multiplier"}
JOINTS = {"output.groups": ["accelerations", "joints", "energy"]}


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
