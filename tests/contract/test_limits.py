"""A limit with a known answer: no clearance."""

import math

import numpy as np
import pytest
from closed_linkage import crank_angle, ideal_y

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
