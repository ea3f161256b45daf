"""Five bodies with clearance at the crank pin: statics."""

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
