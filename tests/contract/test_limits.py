"""Limits with a known answer: no clearance, no speed, and steps that only stability limits."""

import math

import numpy as np
import pytest
from closed_linkage import crank_angle, ideal_y
from scipy.integrate import DOP853

CENTRED = {"mechanism.reference_offset": 0.0, "initial.slider_offset": 0.0}


@pytest.mark.parametrize("name", ["150rpm-0.2mm", "adams-impact"])
def test_small_clearance_tends_to_the_ideal_mechanism_at_first_order(run, variant, name):
    """A quarter of the clearance, a quarter of the deviation; y moves tan(beta) times as far as x."""
    # Through the largest tan(beta), 0.2093, with x at both walls.
    common = {**CENTRED, "drive.cycles": 0.2, "output.groups": []}
    ideal, deviations = run("reference-minimal", "ideal", common).columns, []
    for clearance in (4e-5, 1e-5):
        columns = run(variant, name, {**common, "clearance.slider": clearance}).columns
        across, along = (np.abs(columns[name] - ideal[name]).max() for name in ("slider_x", "slider_y"))
        # The walls give way by up to a micrometre or two.
        assert 0.99 * clearance <= across <= clearance + 2e-6
        assert along <= 0.2093 * 1.02 * across
        deviations.append(along)
    # Less the depth in the walls, which has no part in the limit: 1e-5 m leave room for a tenth of it.
    assert math.log(deviations[0] / deviations[1], 4.0) == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize("variant", ["reference-minimal", "exudyn-full", "exudyn-tree"])
def test_a_small_clearance_at_the_crank_pin_tends_to_the_ideal_pin(run, variant):
    """Clearance and depth shift joint A, rigidly, and the slider by as much as the linkage makes of that."""
    errors = []
    for clearance in (2e-4, 1e-5, 1e-6):  # at the last one its elastic play is of the same size
        changes = {"clearance.crank_pin": clearance, "drive.cycles": 0.1, "output.groups": []}
        simulated = run(variant, "crank-pin", changes)
        angle = crank_angle(simulated.scene, simulated.columns["time"])
        ideal = ideal_y(simulated.scene, angle)
        errors.append(np.abs(simulated.columns["slider_y"] - ideal).max())
        play = clearance + simulated.result.events["largest_depth"].max()
        shifts = play * np.exp(1j * np.linspace(0.0, 2.0 * np.pi, 361))
        rigid = max(np.abs(ideal_y(simulated.scene, angle, shift) - ideal).max() for shift in shifts)
        # 0.89 and more of it measured
        assert 0.8 * rigid < errors[-1] <= rigid
    assert errors[0] > 5 * errors[1] > 10 * errors[2]
    # With clearance in the guide, too: the journal sinks in by some um under some 10 N, and y moves at most
    # 2.84 times as far as the pin.
    short = {"drive.cycles": 0.05, "output.groups": []}
    tight = {"joints.crank_pin": "clearance", "clearance.crank_pin": 1e-6}
    played, pinned = (run(variant, "150rpm-0.2mm", short | changes).columns for changes in (tight, {}))
    assert np.abs(played["slider_y"] - pinned["slider_y"]).max() < 2.9 * (1e-6 + 3e-6)


@pytest.mark.parametrize("variant", ["reference-minimal", "exudyn-tree"])
def test_a_slow_press_hangs_on_one_wall_by_the_static_force_at_second_order(run, variant):
    """Half of the speed, a quarter of what the wall's force differs from that of the press at rest by."""
    cycle, late = {"drive.cycles": 1.0, "output.samples_per_cycle": 360}, slice(180, None)
    still = {"drive.speed_rpm": 1e-6, "mechanism.reference_offset": 2e-4, "output.groups": ["joints"]}
    rest = run("reference-minimal", "ideal", cycle | still).columns["guide_force"][late]
    errors = []
    for speed in (15.0, 7.5):
        changes = cycle | {"drive.speed_rpm": speed, "friction.coefficient": 0.0}
        changes |= {"solver.reference.tolerance": 1e-12, "solver.exudyn.step": 60.0 / speed / 500}
        columns = run(variant, "150rpm-0.2mm", changes | {"output.groups": ["corners"]}).columns
        left, right = (columns[f"corner_l{k}_normal"] + columns[f"corner_u{k}_normal"] for k in "lr")
        errors.append(np.abs((left - right)[late] - rest).max())
    assert math.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.05)


def test_large_gains_of_baumgarte_shorten_steps_to_the_limit_of_stability(run):
    """DOP853 on y' = -y is stable up to h = 6.39; alpha = beta is a double root -alpha."""
    powers, terms = np.ones(len(DOP853.B)), [1.0]
    for _ in DOP853.B:
        terms.append(float(DOP853.B @ powers))
        powers = DOP853.A @ powers
    h = np.linspace(0.0, 8.0, 80_001)
    most = h[np.flatnonzero(np.abs(np.polynomial.Polynomial(terms)(-h)) > 1.0 + 1e-12)[0]]
    assert most == pytest.approx(6.394, abs=1e-3)  # docs/accuracy.md
    gains = {f"solver.reference.baumgarte_{name}": 1e5 for name in ("alpha", "beta")}
    loose = {"solver.reference.tolerance": 5e-6, "drive.cycles": 0.2, "output.groups": []}
    steps = run("reference-multiplier", "ideal", gains | loose).result.provenance["counters"]["steps"]
    assert 0.9 < 0.2 * 0.4 / steps * 1e5 / most < 1.0
