"""The load of a workpiece: its force and energy, in each formulation and solver, and where it has kinks."""

import numpy as np
import pytest
from reference_states import EACH, IDEAL, MULTIPLIER
from scipy.integrate import quad

from reference_model.linkage import ideal_motion
from reference_model.parameters import read_parameters
from reference_model.workpiece import load_energy, load_force

SURFACE, BOTTOM = -0.0318, -0.0348
ROWS = [[0.0, 0.0], [1e-3, 500.0], [1.2e-3, 50.0], [2e-3, 50.0]]
POWER, TABLE = {"load.force": 500.0}, {"load.table": ROWS}
RISING = {"load.table": [*ROWS, [2.5e-3, 300.0]]}  # up to its last row
LOADS = {"power": POWER, "linear": POWER | {"load.exponent": 1.0}, "table": TABLE}
GROUPS = {"output.groups": ["accelerations", "corners", "joints", "energy"]}
TOLERANCE, METHOD = "solver.reference.tolerance", "solver.reference.method"
ADAMS = {"contact.law": "adams-impact"}


@pytest.mark.parametrize("changes", [*LOADS.values(), RISING], ids=[*LOADS, "rising table"])
def test_force_and_energy_are_those_of_the_page(scene, changes) -> None:
    load = read_parameters(scene(changes)).load
    h = np.concatenate([np.linspace(-1e-3, 4e-3, 501), np.array(ROWS)[:, 0]])
    if "load.table" in changes:
        expected = np.interp(h, *np.transpose(changes["load.table"]))
    else:
        expected = 500.0 * (np.maximum(h, 0.0) / 3e-3) ** changes.get("load.exponent", 1.5)
    # The rounding of a height of 0.03 m, 1e-17 m, times a slope of up to 2e6 N/m.
    np.testing.assert_allclose(load_force(load, SURFACE - h), expected, rtol=1e-13, atol=1e-10)
    for depth in (-1e-3, 0.0, 5e-4, 1.1e-3, 1.7e-3, 3e-3):
        rows = [row for row, _ in RISING["load.table"] if row < depth] or None
        exact, _ = quad(
            lambda d: load_force(load, SURFACE - d), 0.0, max(depth, 0.0), points=rows, epsabs=0.0
        )
        assert load_energy(load, SURFACE - depth) == pytest.approx(exact, rel=1e-9, abs=1e-15)


@pytest.mark.parametrize("load", LOADS)
@pytest.mark.parametrize(
    ("name", "law"),
    [(name, law) for name in EACH for law in ({}, ADAMS) if "ideal" not in name or not law],
)
def test_the_balance_of_energy_closes_to_1e_8_joule(run, scene, name, load, law) -> None:
    """At strict tolerance. With steps over the kinks 1e-9 J are left, and of a prescribed motion 0.2 J."""
    result = run(EACH[name], LOADS[load], law, GROUPS, {TOLERANCE: 1e-14, "drive.cycles": 1.0})
    columns = result.columns
    assert np.abs(columns["energy_residual"]).max() <= 1e-8
    stored = load_energy(read_parameters(scene(LOADS[load])).load, columns["slider_y"])
    np.testing.assert_allclose(columns["energy_load"], stored, rtol=0, atol=1e-12)
    assert 0.3 < columns["energy_load"].max() < 1.0
    assert columns["energy_load"][0] == columns["energy_load"][-1] == 0.0


def test_minimal_and_multiplier_find_the_same_run(run) -> None:
    """Over half a cycle, through the workpiece once; errors of 1e-13 that 60 contacts magnify."""
    short = {TOLERANCE: 1e-13, "drive.cycles": 0.7}
    for law in ({}, ADAMS):
        one, other = (run(POWER, law, short, GROUPS, changes) for changes in ({}, MULTIPLIER))
        for name, bound in (("slider_x", 1e-9), ("slider_y", 1e-9), ("energy_load", 1e-6)):
            assert np.abs(one.columns[name] - other.columns[name]).max() < bound
        assert one.events["corner"].tolist() == other.events["corner"].tolist()


@pytest.mark.parametrize("name", ["ideal", "multiplier ideal"])
@pytest.mark.parametrize("load", LOADS)
def test_a_prescribed_motion_changes_no_more_than_forces_by_the_work_of_the_load(
    run, scene, load, name
) -> None:
    """The torque by -P vy / omega, to the rounding of torques of 100 N m, or to Baumgarte's 1e-12 rad."""
    idle, pressed = (run(EACH[name], GROUPS, {"drive.cycles": 1.0}, of).columns for of in ({}, LOADS[load]))
    p = read_parameters(scene(LOADS[load]))
    force = load_force(p.load, pressed["slider_y"])
    assert force.max() > 400.0
    extra = pressed["crank_torque"] - idle["crank_torque"]
    np.testing.assert_allclose(
        extra,
        -force * pressed["slider_vy"] / p.mechanism.omega,
        rtol=0,
        atol=1e-11 if name == "ideal" else 1e-5,
    )
    for channel in ("slider_x", "slider_y", "slider_vy", "slider_ay"):
        np.testing.assert_allclose(pressed[channel], idle[channel], rtol=0, atol=1e-8)
    np.testing.assert_allclose(
        pressed["reaction_F_y"] - idle["reaction_F_y"],
        -force,
        rtol=0,
        atol=1e-11 if name == "ideal" else 1e-5,
    )
    # Around the closed path it takes nothing.
    assert abs(pressed["energy_drive"][-1]) < 1e-8


def test_the_ideal_mechanism_s_extrema_are_those_at_the_kinks(run, scene) -> None:
    """The force of a table is largest at its second row, between two marks."""
    result = run(IDEAL, TABLE, GROUPS, {"drive.cycles": 1.0})
    p = read_parameters(scene(IDEAL | TABLE))
    times = np.linspace(0.0, p.period, 2_000_001)
    force = load_force(p.load, ideal_motion(p.mechanism, times)[4, 1])
    least = result.extrema["reaction_F_y"]["min"]
    # 500 N and the slider's inertia; the weight of samples 2e-7 s apart is 0.2 N.
    inertia = p.mechanism.m5 * (ideal_motion(p.mechanism, times)[4, 7] + p.mechanism.gravity)
    assert least == pytest.approx((inertia - force).min(), abs=0.1)
    numeric = run(IDEAL | MULTIPLIER, TABLE, GROUPS, {"drive.cycles": 1.0}).extrema["reaction_F_y"]["min"]
    assert numeric == pytest.approx(least, abs=1e-3)


def test_a_table_of_the_power_s_values_gives_the_power_s_motion(run) -> None:
    """Linear, where both are the same function, and rows 1e-5 m apart where it is 1e-4 of the force."""
    short = {TOLERANCE: 1e-12, "drive.cycles": 0.6}
    rows = [[0.0, 0.0], [1.7e-3, 500.0 * 1.7 / 3.0], [1e-2, 5000.0 / 3.0]]
    one, other = (run(short, of).columns for of in (LOADS["linear"], {"load.table": rows}))
    for name in ("slider_x", "slider_y"):
        assert np.abs(one[name] - other[name]).max() < 1e-10
    depths = np.linspace(0.0, 5e-3, 501)
    table = {"load.table": np.column_stack([depths, 500.0 * (depths / 3e-3) ** 1.5]).tolist()}
    ideal = IDEAL | GROUPS | {"drive.cycles": 1.0}
    one, other = (run(ideal, of).columns for of in (POWER, table))
    assert np.abs(one["crank_torque"] - other["crank_torque"]).max() < 1e-3 * np.ptp(one["crank_torque"])


@pytest.mark.parametrize("load", LOADS)
def test_the_error_follows_the_tolerance_through_the_kinks(run, load) -> None:
    """Without contacts before it and friction: rod 4 and slider go into the workpiece in free flight."""
    free = {"clearance.slider": 2e-2, "drive.cycles": 0.55, "initial.slider_offset": 0.0}
    exact, *others = (
        run(free, LOADS[load], {TOLERANCE: tolerance}).columns["slider_x"]
        for tolerance in (1e-14, 1e-7, 1e-9, 1e-11)
    )
    for tolerance, x in zip((1e-7, 1e-9, 1e-11), others, strict=True):
        assert np.abs(x - exact).max() < 30.0 * tolerance


@pytest.mark.parametrize("method", ["BDF", "Radau", "LSODA", "scipy-DOP853"])
def test_scipy_s_solvers_find_the_run_and_start_anew_at_the_kinks(run, method) -> None:
    """Their errors, 1e-10 m, magnified by the contacts of half a cycle."""
    short = {TOLERANCE: 1e-10, "drive.cycles": 0.1, "load.surface": 0.17}
    for load in (LOADS["linear"], TABLE, POWER | ADAMS):
        usual, computed = run(load, short), run(load, short, {METHOD: method})
        np.testing.assert_allclose(computed.columns["slider_x"], usual.columns["slider_x"], rtol=0, atol=1e-7)
        assert usual.columns["slider_y"].min() < 0.17 - 2e-3


def test_a_press_at_rest_carries_the_load_in_rod_4(run, scene) -> None:
    """Without weight and inertia rod 4 pulls and pushes along itself; the guide takes what it has across."""
    still = (
        IDEAL | GROUPS | POWER | {"environment.gravity": 0.0, "drive.speed_rpm": 1e-4, "drive.cycles": 0.3}
    )
    still |= {"load.surface": 0.15}
    columns, p = run(still).columns, read_parameters(scene(still))
    rod4 = ideal_motion(p.mechanism, columns["time"])[3, 2]
    force = load_force(p.load, columns["slider_y"])
    assert force.max() > 1e3
    # Rounding; of inertia 1e-9 N.
    np.testing.assert_allclose(columns["reaction_F_y"], -force, rtol=1e-12, atol=1e-6)
    np.testing.assert_allclose(columns["guide_force"], force / np.tan(rod4), rtol=1e-9, atol=1e-6)
    work = columns["crank_torque"] * p.mechanism.omega + force * columns["slider_vy"]
    assert np.abs(work).max() < 1e-9 * np.abs(force * columns["slider_vy"]).max()
