"""The formulations against each other, and how well the multiplier form keeps its constraints."""

from itertools import product

import numpy as np
import pytest
from reference_states import EACH, IDEAL, MULTIPLIER

from reference_model import simulate
from reference_model.balance import REACTIONS

BDF, TOLERANCE = {"solver.reference.method": "BDF"}, "solver.reference.tolerance"
JOINTS = {"output.groups": ["accelerations", "joints", "energy"]}
GAINS = pytest.mark.parametrize("gain", [3.0, 30.0, 300.0])


def stabilized(gain):
    return MULTIPLIER | dict.fromkeys([f"solver.reference.baumgarte_{k}" for k in ("alpha", "beta")], gain)


@GAINS
def test_the_multiplier_form_is_the_minimal_one_for_gains_over_two_decades(scene, gain):
    """The ideal mechanism to 1e-10 m, reactions to 1e-6 of range; with contacts to 1e-8 m over a cycle."""
    for changes, bound in ((IDEAL | JOINTS, 1e-10), ({}, 1e-8)):
        cycle = {**changes, "drive.cycles": 1.0, TOLERANCE: 1e-12}
        exact, full = (simulate(scene(cycle | values)).columns for values in ({}, stabilized(gain)))
        for name in ("slider_x", "slider_y"):
            assert np.abs(full[name] - exact[name]).max() < bound
        for name in REACTIONS[:13] if changes else ():
            assert np.abs(full[name] - exact[name]).max() <= 1e-6 * np.ptp(exact[name])


@pytest.mark.parametrize(("name", "method"), [*product(EACH, ["dop853"]), ("multiplier", "LSODA")])
def test_what_is_asked_for_beyond_the_motion_does_not_change_it(scene, name, method):
    """Motion, its extrema and the contacts, where nothing else is computed and where everything is."""
    short = EACH[name] | {"solver.reference.method": method, "drive.cycles": 0.1}
    groups = [], ["accelerations", "corners", "joints", "energy"]
    few, all_ = (simulate(scene(short | {"output.groups": some})) for some in groups)
    assert len(few.columns) == 7
    # Of the ideal mechanism the terms have another order: rounding of 0.55 m and some m/s.
    for channel, values in few.columns.items():
        np.testing.assert_allclose(values, all_.columns[channel], rtol=0, atol=1e-14)
    for channel, values in few.extrema.items():
        for end in ("min", "max"):
            assert values[end] == pytest.approx(all_.extrema[channel][end], rel=0, abs=1e-14)
    for column, values in few.events.items():
        np.testing.assert_array_equal(values, all_.events[column])


@pytest.mark.parametrize("gain", [0.0, 3.0, 300.0])
def test_baumgarte_bounds_the_drift(scene, gain):
    """Without it Phi grows, with the time or its square; with it after 1 / alpha it does so no longer."""
    usual = IDEAL | BDF | stabilized(gain) | {TOLERANCE: 1e-8, "output.groups": []}
    results = [simulate(scene(usual | {"drive.cycles": cycles})) for cycles in (4.0, 16.0)]
    early, late = (result.provenance["constraints"]["position"] for result in results)
    assert (late < 1.3 * early) == (gain > 0.0)
    assert gain > 0.0 or 4.0 < late / early < 32.0
