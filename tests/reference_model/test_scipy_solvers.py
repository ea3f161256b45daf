"""scipy's solvers on the same equations: motion, events, samples, work and failures."""

import numpy as np
import pytest

from reference_model import simulate
from reference_model.parameters import SCIPY_METHODS

IDEAL, METHOD, TOLERANCE = {"joints.slider": "ideal"}, "solver.reference.method", "solver.reference.tolerance"
QUARTER = {"drive.cycles": 0.25}
"""The first quarter cycle: twelve contacts, among them some of two corners at once."""
EACH = pytest.mark.parametrize("method", SCIPY_METHODS)


def by(method, tolerance=1e-12):
    return {"solver.reference.formulation": "multiplier", METHOD: method, TOLERANCE: tolerance}


@EACH
def test_multiplier_form_follows_the_minimal_form(scene, method):
    few = simulate(scene({**QUARTER, TOLERANCE: 1e-13}))
    full = simulate(scene({**QUARTER, **by(method)}))
    assert full.status == "success"
    assert full.columns.keys() == few.columns.keys()
    np.testing.assert_array_equal(full.columns["time"], few.columns["time"])
    np.testing.assert_array_equal(full.events["corner"], few.events["corner"])
    assert len(full.events["corner"]) == 12
    # Some 2000 local errors of 1e-12 m (or rad, at an arm of 0.05 m), not all of one sign: 1e-9 m at most.
    # In the angle times 1 / 35 mm; a contact of 0.2 ms makes a velocity of it, 1e-9 m / 2e-4 s.
    errors = {"slider_x": 1e-9, "slider_y": 1e-9, "slider_angle": 3e-8, "slider_vx": 5e-6}
    # 1e-9 m at the slowest touch, 0.01 m/s: 1e-7 s. An impulse by the speed's times the 0.3 kg that a corner
    # can hit. Depths really differ by 1e-12 m, which 1.5 F / d = 1.7e7 N/m makes 2e-5 N; in either run a peak
    # that is missed for the end of its step may be short by as much (see the compiled integrator's test).
    errors |= {"start": 1e-7, "end": 1e-7, "normal_speed": 5e-6, "impulse": 1.5e-6, "largest_depth": 1e-9}
    for name, error in (errors | {"peak_force": 1e-4}).items():
        a, b = ((of.columns if name in of.columns else of.events)[name] for of in (full, few))
        np.testing.assert_allclose(a, b, rtol=0, atol=error, err_msg=name)
    for name, extremes in full.extrema.items():
        assert extremes["min"] <= full.columns[name].min()
        assert extremes["max"] >= full.columns[name].max()


@pytest.mark.parametrize(("method", "least"), [("BDF", 0.7), ("LSODA", 0.7), ("Radau", 0.6)])
def test_error_follows_the_tolerance(scene, method, least):
    """A local error per step held at the tolerance makes a global one of order p / (p + 1) in it.

    That is 5/6 at BDF's highest order, which it does not always take; 3/4 for Radau, whose estimate is of
    third order, while its error is of fifth.
    """
    tolerances = 10.0 ** -np.arange(6.0, 12.1)
    settings = [{}, *(by(method, tolerance) for tolerance in tolerances)]
    exact, *others = (simulate(scene(QUARTER | IDEAL | of)).columns["slider_y"] for of in settings)
    errors = [np.abs(y - exact).max() for y in others]
    assert least < np.polyfit(np.log10(tolerances), np.log10(errors), 1)[0] < 1.3


def test_modes_that_hand_over_to_each_other_do_not_hang(scene):
    """A tolerance of 3e-3 m/s cannot tell on which side of the friction's kink at 1e-4 m/s a step ends."""
    pin = {"joints.crank_pin": "clearance", "clearance.crank_pin": 1e-4, "drive.cycles": 0.05}
    result = simulate(scene({**IDEAL, **pin, METHOD: "BDF", TOLERANCE: 3e-6}))
    assert result.status == "success"
    assert result.provenance["counters"]["steps"] < 10_000


@pytest.mark.slow
@pytest.mark.parametrize("slider", ["ideal", "clearance"])
def test_clearance_at_the_crank_pin(scene, slider):
    """The other formulations, until the journal has hit its bearing a few times."""
    pin = {"joints.slider": slider, "joints.crank_pin": "clearance", "clearance.crank_pin": 1e-4}
    changes = {**pin, "drive.cycles": 0.03, "output.groups": ["joints", "energy"], TOLERANCE: 1e-12}
    few, full = (simulate(scene(changes | {METHOD: method})) for method in ("dop853", "BDF"))
    np.testing.assert_array_equal(full.events["corner"], few.events["corner"])
    assert few.events["corner"].size > 5
    assert np.abs(full.columns["slider_y"] - few.columns["slider_y"]).max() < 1e-8
    assert np.abs(full.columns["energy_residual"]).max() < 1e-8
