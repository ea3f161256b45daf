"""The load of a workpiece in each formulation and solver, and where it has kinks."""

import numpy as np
import pytest
from reference_states import EACH, IDEAL

from reference_model.linkage import ideal_motion
from reference_model.parameters import read_parameters
from reference_model.workpiece import load_energy, load_force

ROWS = [[0.0, 0.0], [1e-3, 500.0], [1.2e-3, 50.0], [2e-3, 50.0]]
POWER, TABLE = {"load.force": 500.0}, {"load.table": ROWS}
LOADS = {"power": POWER, "linear": POWER | {"load.exponent": 1.0}, "table": TABLE}
GROUPS = {"output.groups": ["accelerations", "corners", "joints", "energy"]}
TOLERANCE, METHOD = "solver.reference.tolerance", "solver.reference.method"
ADAMS = {"contact.law": "adams-impact"}


@pytest.mark.parametrize("load", LOADS)
@pytest.mark.parametrize(
    ("name", "law"),
    [(name, law) for name in EACH for law in ({}, ADAMS) if "ideal" not in name or not law],
)
def test_the_balance_of_energy_closes_to_1e_8_joule(run, scene, name, load, law):
    """At strict tolerance. With steps over the kinks 1e-9 J are left, and of a prescribed motion 0.2 J."""
    result = run(EACH[name], LOADS[load], law, GROUPS, {TOLERANCE: 1e-14, "drive.cycles": 1.0})
    columns = result.columns
    assert np.abs(columns["energy_residual"]).max() <= 1e-8
    stored = load_energy(read_parameters(scene(LOADS[load])).load, columns["slider_y"])
    np.testing.assert_allclose(columns["energy_load"], stored, rtol=0, atol=1e-12)
    assert 0.3 < columns["energy_load"].max() < 1.0
    assert columns["energy_load"][0] == columns["energy_load"][-1] == 0.0


def test_the_ideal_mechanism_s_extrema_are_those_at_the_kinks(run, scene):
    """The force of a table is largest at its second row, between two marks."""
    result = run(IDEAL, TABLE, GROUPS, {"drive.cycles": 1.0})
    p = read_parameters(scene(IDEAL | TABLE))
    times = np.linspace(0.0, p.period, 2_000_001)
    force = load_force(p.load, ideal_motion(p.mechanism, times)[4, 1])
    least = result.extrema["reaction_F_y"]["min"]
    # 500 N and the slider's inertia; the weight of samples 2e-7 s apart is 0.2 N.
    inertia = p.mechanism.m5 * (ideal_motion(p.mechanism, times)[4, 7] + p.mechanism.gravity)
    assert least == pytest.approx((inertia - force).min(), abs=0.1)


@pytest.mark.parametrize("load", LOADS)
def test_the_error_follows_the_tolerance_through_the_kinks(run, load):
    """Without contacts before it and friction: rod 4 and slider go into the workpiece in free flight."""
    free = {"clearance.slider": 2e-2, "drive.cycles": 0.55, "initial.slider_offset": 0.0}
    exact, *others = (
        run(free, LOADS[load], {TOLERANCE: tolerance}).columns["slider_x"]
        for tolerance in (1e-14, 1e-7, 1e-9, 1e-11)
    )
    for tolerance, x in zip((1e-7, 1e-9, 1e-11), others, strict=True):
        assert np.abs(x - exact).max() < 30.0 * tolerance


@pytest.mark.parametrize("method", ["BDF", "Radau", "LSODA", "scipy-DOP853"])
def test_scipy_s_solvers_find_the_run_and_start_anew_at_the_kinks(run, method):
    """Their errors, 1e-10 m, magnified by the contacts of half a cycle."""
    short = {TOLERANCE: 1e-10, "drive.cycles": 0.1, "load.surface": 0.17}
    for load in (LOADS["linear"], TABLE, POWER | ADAMS):
        usual, computed = run(load, short), run(load, short, {METHOD: method})
        np.testing.assert_allclose(computed.columns["slider_x"], usual.columns["slider_x"], rtol=0, atol=1e-7)
        assert usual.columns["slider_y"].min() < 0.17 - 2e-3
