"""The load of a workpiece: its force, and what it does to the press in every formulation."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from exudyn_model.linkage import driven_rod4, linkage_array
from exudyn_model.parameters import Load, read_scene
from exudyn_model.workpiece import workpiece_array, workpiece_force

SURFACE = -0.0318
POWER = {"load.force": 500.0}
ROWS = [[0.0, 0.0], [0.001, 300.0], [0.0015, 50.0], [0.004, 500.0]]
TABLE = {"load.table": ROWS}
IMPACT = {"contact.law": "adams-impact"}
ENERGY = {"output.groups": ["corners", "joints", "energy"], "solver.exudyn.method": "trapezoidal-index2"}
IDEAL = {"joints.slider": "ideal"}
PIN = {"joints.crank_pin": "clearance"}
# From 2 ms before the slider meets the workpiece to where it leaves it
NEAR = {"mechanism.crank_angle_deg": 287.76, "drive.cycles": 0.09}
START = NEAR | {"drive.cycles": 0.03}
MOTION = ("slider_x", "slider_y", "slider_angle", "slider_vx", "slider_vy", "slider_omega")


def force(depth, load):
    return workpiece_force(SURFACE - depth, workpiece_array(load))


@given(depth=st.floats(-0.01, 0.01), exponent=st.floats(1.0, 4.0))
def test_force_and_energy_of_a_power_law(depth, exponent):
    computed = force(depth, Load(SURFACE, ((0.003, 500.0),), exponent))
    share = max(SURFACE - (SURFACE - depth), 0.0) / 0.003
    exact = (500.0 * share**exponent, 500.0 * 0.003 * share ** (exponent + 1) / (exponent + 1))
    assert computed == pytest.approx(exact, rel=1e-12, abs=1e-300)


@given(depth=st.floats(-0.01, 0.01))
def test_force_of_a_table_is_linear_and_its_energy_the_integral(depth):
    depths, forces = zip(*ROWS, strict=True)
    force_, energy = force(depth, Load(SURFACE, tuple(map(tuple, ROWS)), 0.0))
    # Depths are differences of 0.03 m, and slopes up to 5e5 N/m
    assert force_ == pytest.approx(np.interp(depth, depths, forces), abs=1e-11)
    exact = quad(lambda h: np.interp(h, depths, forces), 0.0, max(depth, 0.0), points=depths)[0]
    assert energy == pytest.approx(exact, abs=1e-12)


@pytest.mark.parametrize("load", [POWER, TABLE], ids=["power", "table"])
def test_without_clearance_it_changes_forces_and_energies_alone(run, make_scene, load):
    changes = IDEAL | NEAR | ENERGY
    idle, loaded = run(changes).columns, run(changes, load).columns
    assert set(loaded) == set(idle) | {"energy_load"}
    push, stored = np.array(
        [force(SURFACE - y, read_scene(make_scene(load)).load) for y in idle["slider_y"]]
    ).T
    assert push.max() > 100.0
    # Newton's tolerance, over the step in reactions: measured
    for name in MOTION:
        np.testing.assert_allclose(loaded[name], idle[name], rtol=0, atol=1e-10)
    omega = read_scene(make_scene()).mechanism.omega
    changed = loaded["crank_torque"] - idle["crank_torque"]
    np.testing.assert_allclose(changed, -push * idle["slider_vy"] / omega, rtol=0, atol=1e-6)
    np.testing.assert_allclose(loaded["energy_load"], stored, rtol=0, atol=1e-9)
    # At F its part along y is the workpiece's, and across the guide what rod 4's direction makes of it
    np.testing.assert_allclose(loaded["reaction_F_y"] - idle["reaction_F_y"], -push, rtol=0, atol=1e-5)
    # Trapezoidal rule of the motor's power
    assert np.max(np.abs(loaded["energy_residual"])) < 1e-7


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


@pytest.mark.parametrize("tree", [None, 1e-10])
def test_a_table_of_the_power_law_s_values_gives_its_motion(run, error, tree):
    straight = {"load.force": 400.0, "load.depth": 2e-3, "load.exponent": 1.0}
    # A row between, deeper ones that are not reached
    rows = {"load.table": [[0.0, 0.0], [1e-3, 200.0], [5e-3, 1000.0]]}
    law, table = (run(START, load, tree=tree) for load in (straight, rows))
    # Round-off; in the tree a row more is a step that ends there
    assert error(law, table, "slider_x") < (1e-15 if tree is None else 0.1 * tree)
    assert error(law, table, "slider_y") < (1e-15 if tree is None else 0.1 * tree)


@pytest.mark.parametrize(
    ("joints", "law", "load"),
    [({}, {}, POWER), ({}, IMPACT, TABLE), (PIN | IDEAL, IMPACT, POWER)],
    ids=["hertz", "impact", "pin"],
)
def test_the_audit_of_the_energy_closes(run, joints, law, load):
    """Second order in the step: 1.0e-6, 1.7e-6 and 6.6e-6 J at 2 us, 7e-8, 3e-8 and 4e-7 J at 0.5 us."""
    result = run(ENERGY, START, joints, law, load, {"solver.exudyn.step": 5e-7})
    assert result.status == "success"
    columns = result.columns
    assert np.max(np.abs(columns["energy_residual"])) < 1e-6
    # What a part left out would leave
    assert columns["energy_load"].max() > 0.2
    assert columns["energy_damping"][-1] > 1e-3


@pytest.mark.parametrize("tree", [None, 1e-10])
def test_at_rest_the_wall_carries_what_rod_4_makes_of_the_load(run, make_scene, tree):
    """The crank all but at rest near the bottom; a strong damping takes the slider to its wall."""
    changes = POWER | IMPACT | {
        "drive.speed_rpm": 1e-9, "drive.cycles": 3e-13, "output.samples_per_cycle": 10**15,
        "mechanism.crank_angle_deg": 300.0, "environment.gravity": 0.0, "friction.coefficient": 0.0,
        "contact.damping": 1e4, "contact.damping_depth": 1e-6,
    }  # fmt: skip
    result = run(changes, tree=tree)
    assert result.status == "success"
    last = {name: values[-1] for name, values in result.columns.items()}
    parameters = read_scene(make_scene(changes))
    tip = driven_rod4(0.0, linkage_array(parameters.mechanism))[0]
    push, _ = workpiece_force(last["slider_y"], workpiece_array(parameters.load))
    # No moment about C: the wall's force times the height of rod 4 is the load's times its width
    wall = push * (last["slider_x"] - tip.x) / (last["slider_y"] - tip.y)
    carried = sum(
        sign * last[f"corner_{name}_normal"] for name, sign in (("ll", 1), ("ul", 1), ("lr", -1), ("ur", -1))
    )
    assert carried == pytest.approx(wall, rel=1e-6)
