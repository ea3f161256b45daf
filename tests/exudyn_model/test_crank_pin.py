"""Five bodies with clearance at the crank pin: statics, and the force while the journal is in contact."""

import numpy as np
import pytest

CRANK_PIN = {"joints.crank_pin": "clearance", "joints.slider": "ideal"}


def test_pin_settles_into_static_equilibrium(run):
    """At creep speed and with the strongest damping: joint A bears what it bears without clearance."""
    changes = {
        "joints.slider": "ideal", "drive.speed_rpm": 0.1, "drive.cycles": 5e-5,
        "mechanism.crank_angle_deg": 60.0, "contact.restitution": 0.0, "friction.coefficient": 0.0,
        "clearance.crank_pin": 1e-6, "output.groups": ["joints"], "solver.exudyn.method": "auto",
        "solver.exudyn.step": 1e-6, "output.samples_per_cycle": 200_000,
    }  # fmt: skip
    pin, ideal = run(changes, CRANK_PIN), run(changes).columns
    for name in ("reaction_A_x", "reaction_A_y", "reaction_H_y", "crank_torque", "guide_force"):
        scale = 1.0 if name != "crank_torque" else 0.045
        # Of forces of some 10 N; the bounces of some 1e-8 m have not quite died away
        assert pin.columns[name][-1] == pytest.approx(ideal[name][-1], abs=1e-2 * scale), name
    assert pin.events["end"][-1] == pytest.approx(0.03)
    assert np.hypot(ideal["reaction_A_x"][-1], ideal["reaction_A_y"][-1]) > 1


@pytest.mark.parametrize("slider", ["ideal", "clearance"])
def test_joint_a_bears_a_force_exactly_while_the_journal_is_in_contact(run, slider):
    groups = {
        "output.groups": ["accelerations", "corners", "joints", "energy"],
        "solver.exudyn.method": "auto",
    }
    result = run(CRANK_PIN, groups, {"joints.slider": slider, "drive.cycles": 0.05})
    assert ("guide_force" in result.columns) == (slider == "ideal") != ("corner_ll_gap" in result.columns)
    time, pin = result.columns["time"], result.events["corner"] == "pin"
    closed = np.zeros(len(time), bool)
    for start, end in zip(result.events["start"][pin], result.events["end"][pin], strict=True):
        closed |= (time > start) & (time < end)
    force = np.hypot(result.columns["reaction_A_x"], result.columns["reaction_A_y"])
    assert np.array_equal(force > 0, closed)
    # Of normal force N and friction up to 0.15 N
    peak = np.max(result.events["peak_force"][pin])
    assert np.max(force) <= peak * np.hypot(1, 0.15)
    extrema = [result.extrema[f"reaction_A_{axis}"] for axis in "xy"]
    assert peak <= np.hypot(*(max(abs(axis["min"]), abs(axis["max"])) for axis in extrema))
