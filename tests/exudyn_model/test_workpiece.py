"""The load of a workpiece in every formulation, and where it has kinks."""

import pytest

POWER = {"load.force": 500.0}
TABLE = {"load.table": [[0.0, 0.0], [0.001, 300.0], [0.0015, 50.0], [0.004, 500.0]]}
IMPACT = {"contact.law": "adams-impact"}
IDEAL = {"joints.slider": "ideal"}
PIN = {"joints.crank_pin": "clearance"}
# From 2 ms before the slider meets the workpiece
START = {"mechanism.crank_angle_deg": 287.76, "drive.cycles": 0.03}


# Bounds of the error of x and y by five bodies, m: four times that measured. The pin's contacts magnify it
@pytest.mark.parametrize(
    ("joints", "load", "law", "bound"),
    [
        ({}, POWER, {}, 5e-8),
        ({}, TABLE, IMPACT, 2.5e-7),
        (PIN, POWER, IMPACT, 6e-7),
        (PIN | IDEAL, POWER, {}, 4e-7),
    ],
    ids=["slider", "slider, table and impact", "both, impact", "pin"],
)
def test_five_bodies_and_tree_move_alike(run, error, joints, load, law, bound):
    changes = joints | load | law | START
    exact, idle = run(changes, tree=1e-12), run(joints | law | START, tree=1e-12)
    full = run(changes, {"solver.exudyn.step": 1e-6})
    assert exact.status == full.status == "success"
    assert max(error(full, exact, name) for name in ("slider_x", "slider_y")) < bound
    assert error(idle, exact, "slider_y") > 30 * bound


# The last one has a peak that the slider passes in 10 us, a tenth of the largest step
PEAK = {"load.table": [[0.0, 0.0], [1e-3, 100.0], [1.002e-3, 5000.0], [1.004e-3, 100.0], [4e-3, 500.0]]}
KINKS = {"surface": POWER | {"load.exponent": 1.0}, "table": TABLE, "peak": PEAK}


@pytest.mark.parametrize("kinks", KINKS)
def test_kinks_leave_the_tree_s_error_that_of_its_tolerance(run, error, kinks):
    """With steps across the kinks 2e-10 m of the table at 1e-9, and 50 times as much of vx."""
    exact = run(START, KINKS[kinks], tree=1e-13)
    for tolerance in (1e-9, 1e-11):
        # Measured 5e-3 and 1e-2 times the tolerance
        assert error(run(START, KINKS[kinks], tree=tolerance), exact, "slider_x") < 0.1 * tolerance
