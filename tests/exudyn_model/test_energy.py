"""The audit of the energy closes: the motor's work comes from Exudyn's multiplier, the rest from states."""

import numpy as np
import pytest

ENERGY = {"output.groups": ["corners", "energy"], "solver.exudyn.method": "trapezoidal-index2"}
FOUNDATION = {"contact.law": "foundation"}
LOSSLESS = {"contact.restitution": 1.0, "friction.coefficient": 0.0}
STEP = "solver.exudyn.step"
PARTS = ("drive", "gravity", "kinetic", "contact", "damping", "friction", "residual")
# The smallest step's bound in J: 7e-8, 5e-8 and 2e-8 measured. Seven contacts in 0.04 s; at the pin two of up
# to 1.6 kN, where friction reverses
AUDITS = {
    "corners": ({"drive.cycles": 0.1}, (8e-6, 4e-6), 1e-7),
    # Losses in either corner of a side, the one that is outside, too: else the audit would not close
    "foundation": (FOUNDATION | {"drive.cycles": 0.1}, (2.5e-7,), 2e-7),
    "pin": (
        {"joints.crank_pin": "clearance", "joints.slider": "ideal", "drive.cycles": 0.0225,
         "output.samples_per_cycle": 10_000},
        (2e-6, 1e-6, 5e-7),
        5e-8,
    ),
    # From 2 ms before the workpiece; 4e-7 J measured
    "pin, workpiece": (
        {"joints.crank_pin": "clearance", "joints.slider": "ideal", "drive.cycles": 0.03,
         "contact.law": "adams-impact", "load.force": 500.0, "mechanism.crank_angle_deg": 287.76},
        (5e-7,),
        1e-6,
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", AUDITS)
def test_residual_is_of_second_order_and_contacts_only_dissipate(run, name):
    changes, steps, bound = AUDITS[name]
    runs = [run(ENERGY, changes, {STEP: step}).columns for step in steps]
    errors = [np.max(np.abs(columns["energy_residual"])) for columns in runs]
    if len(steps) > 1:
        # Where touches, and friction's pieces, fall in their steps scatters it; 2.0 measured
        assert np.polyfit(np.log(steps), np.log(errors), 1)[0] == pytest.approx(2.0, abs=0.3), errors
    assert errors[-1] < bound
    last = runs[-1]
    for part in ("damping", "friction"):
        lost = last[f"energy_{part}"]
        assert np.all(np.diff(lost) >= 0)
        assert lost[-1] > max(5e-5, 100 * errors[-1])
    assert np.all(last["energy_contact"] >= 0)
    assert name != "pin" or np.max(last["energy_contact"]) > 1e-3
    assert "workpiece" not in name or np.max(last["energy_load"]) > 0.2
    first = {part: last[f"energy_{part}"][0] for part in PARTS}
    assert first.pop("kinetic") > 0
    assert set(first.values()) == {0.0}


def test_nothing_is_lost_on_the_foundation_without_damping_and_friction(run):
    """At the corners by themselves, and of the ideal mechanism: tests/contract."""
    runs = [run(ENERGY, LOSSLESS, FOUNDATION, {"drive.cycles": 0.1, STEP: step}) for step in (5e-7, 2.5e-7)]
    for result in runs:
        assert result.status == "success"
        assert not result.columns["energy_friction"].any()
        # Sums of forces less the same: round-off
        assert np.max(np.abs(result.columns["energy_damping"])) < 1e-15
    # Measured 6.6e-6 and 1.6e-6 of the kinetic energy, within the impact of a whole side
    coarse, fine = (result.provenance["invariants"]["energy"]["value"] for result in runs)
    assert coarse / fine == pytest.approx(4.0, abs=0.5)
    assert fine < 4e-6
