"""scipy's solvers on the same equations: motion, events, samples, work and failures."""

import numpy as np
import pytest

from reference_model import simulate
from reference_model.parameters import SCIPY_METHODS as SOLVERS
from reference_model.reactions import REACTIONS

MULTIPLIER = {"solver.reference.formulation": "multiplier"}
QUARTER = {"drive.cycles": 0.25}
"""The first quarter cycle: twelve contacts, among them some of two corners at once."""


def by(method, tolerance=1e-12):
    return {**MULTIPLIER, "solver.reference.method": method, "solver.reference.tolerance": tolerance}


@pytest.mark.parametrize("method", SOLVERS)
def test_multiplier_form_follows_the_minimal_form(scene, method) -> None:
    few = simulate(scene({**QUARTER, "solver.reference.tolerance": 1e-13}))
    full = simulate(scene({**QUARTER, **by(method)}))
    assert full.status == "success"
    assert full.columns.keys() == few.columns.keys()
    np.testing.assert_array_equal(full.columns["time"], few.columns["time"])
    # Some 2000 local errors of 1e-12 m (or rad, at an arm of 0.05 m), not all of one sign: 1e-9 m at most.
    # In the angle times 1 / 35 mm; a contact of 0.2 ms makes a velocity of it, 1e-9 m / 2e-4 s.
    for name, error in (("slider_x", 1e-9), ("slider_y", 1e-9), ("slider_angle", 3e-8), ("slider_vx", 5e-6)):
        np.testing.assert_allclose(full.columns[name], few.columns[name], rtol=0, atol=error)
    np.testing.assert_array_equal(full.events["corner"], few.events["corner"])
    assert len(full.events["corner"]) == 12
    # 1e-9 m at the slowest touch, 0.01 m/s: 1e-7 s; speeds as above.
    for name, error in (("start", 1e-7), ("end", 1e-7), ("normal_speed", 5e-6)):
        np.testing.assert_allclose(full.events[name], few.events[name], rtol=0, atol=error)
    # The change of 5e-6 m/s times the 0.3 kg that a corner can hit; a depth as the position.
    np.testing.assert_allclose(full.events["impulse"], few.events["impulse"], rtol=0, atol=1.5e-6)
    np.testing.assert_allclose(full.events["largest_depth"], few.events["largest_depth"], rtol=0, atol=1e-9)
    # Depths really differ by 1e-12 m, which 1.5 F / d = 1.7e7 N/m makes 2e-5 N. In either run a peak that is
    # missed for the end of its step may be short by as much (see the compiled integrator's test).
    np.testing.assert_allclose(full.events["peak_force"], few.events["peak_force"], rtol=0, atol=1e-4)


@pytest.mark.parametrize("method", SOLVERS)
def test_ideal_mechanism_is_the_closed_form(scene, method) -> None:
    """To 1e-10 m, reactions and torque to 1e-9 of their range."""
    changes = {**QUARTER, "joints.slider": "ideal", "output.groups": ["accelerations", "joints"]}
    exact = simulate(scene(changes)).columns
    full = simulate(scene({**changes, **by(method, 1e-13)})).columns
    assert np.abs(full["slider_y"] - exact["slider_y"]).max() < 1e-10
    for name in REACTIONS[:13]:
        assert np.abs(full[name] - exact[name]).max() <= 1e-9 * np.ptp(exact[name])


@pytest.mark.parametrize(("method", "least"), [("BDF", 0.7), ("LSODA", 0.7), ("Radau", 0.6)])
def test_error_follows_the_tolerance(scene, method, least) -> None:
    """A local error per step held at the tolerance makes a global one of order p / (p + 1) in it.

    That is 5/6 at BDF's highest order, which it does not always take; 3/4 for Radau, whose estimate is of
    third order, while its error is of fifth.
    """
    changes = {**QUARTER, "joints.slider": "ideal"}
    exact = simulate(scene(changes)).columns["slider_y"]
    tolerances = 10.0 ** -np.arange(6.0, 12.1)
    errors = [
        np.abs(simulate(scene({**changes, **by(method, tolerance)})).columns["slider_y"] - exact).max()
        for tolerance in tolerances
    ]
    slope = np.polyfit(np.log10(tolerances), np.log10(errors), 1)[0]
    assert least < slope < 1.3


@pytest.mark.parametrize("method", SOLVERS)
def test_sampling_does_not_touch_the_run(scene, method) -> None:
    """Samples come from the dense output: four times as many change neither events nor the common ones."""
    few = simulate(scene({**QUARTER, **by(method, 1e-8), "output.samples_per_cycle": 1000}))
    many = simulate(scene({**QUARTER, **by(method, 1e-8), "output.samples_per_cycle": 4000}))
    np.testing.assert_array_equal(few.columns["time"], np.arange(251) * (0.4 / 1000))
    # The same instants to round-off, 1e-16 s at speeds of 1 m/s, and accelerations of at most 1e4 m/s^2.
    np.testing.assert_allclose(few.columns["slider_y"], many.columns["slider_y"][::4], rtol=0, atol=1e-15)
    np.testing.assert_allclose(few.columns["slider_vx"], many.columns["slider_vx"][::4], rtol=0, atol=1e-11)
    for name, column in few.events.items():
        np.testing.assert_array_equal(column, many.events[name])
    assert few.provenance["counters"] == many.provenance["counters"]


def test_every_sample_lies_on_the_motion(scene) -> None:
    """Between two samples the slider moves by the mean of their velocities, but for h^3 / 12 of the jerk."""
    result = simulate(scene({**QUARTER, **by("BDF", 1e-10), "output.samples_per_cycle": 20000}))
    x, v, h = result.columns["slider_x"], result.columns["slider_vx"], 0.4 / 20000
    # Jerk: 60 N rise within 0.1 ms on the 0.05 kg that a corner feels, 1e7 m/s^3; h^3 / 12 of it: 7e-9 m.
    np.testing.assert_allclose(np.diff(x), 0.5 * h * (v[1:] + v[:-1]), rtol=0, atol=7e-9)


def test_extrema_bound_the_samples(scene) -> None:
    result = simulate(scene({**QUARTER, **by("BDF")}))
    for name, extremes in result.extrema.items():
        assert extremes["min"] <= result.columns[name].min()
        assert extremes["max"] >= result.columns[name].max()
    for corner in ("ll", "ul"):
        peaks = result.events["peak_force"][result.events["corner"] == corner]
        assert peaks.max() == result.extrema[f"corner_{corner}_normal"]["max"]


def test_what_a_run_records(scene) -> None:
    shares = []
    result = simulate(scene({**QUARTER, **by("BDF", 1e-8)}), progress=shares.append)
    provenance, counters = result.provenance, result.provenance["counters"]
    assert provenance["integrator"] == "scipy BDF with located events"
    assert provenance["settings"]["tolerance"] == 1e-8
    assert provenance["settings"]["relative_tolerance"] < 1e-13
    assert counters["contacts"] == result.events["start"].size
    assert 0 < counters["switches"] < counters["factorizations"] < counters["steps"] < counters["rhs"]
    assert shares == sorted(shares)
    assert 40 < len(shares) <= 51
    assert shares[-1] == 1.0


def test_too_much_work_ends_with_a_status_and_keeps_what_was_computed(scene, monkeypatch) -> None:
    monkeypatch.setattr("reference_model.simulation.SCIPY_STEPS_PER_CYCLE_LIMIT", 300)
    result = simulate(scene({**QUARTER, **by("BDF", 1e-10)}))
    assert result.status == result.provenance["status"] == "work-limit"
    assert "solver.reference.method = 'dop853'" in result.remedy
    assert 10 < result.columns["time"].size < 251
    assert all(np.isfinite(column).all() for column in result.columns.values())
    assert result.events["start"].size > 0


def test_modes_that_hand_over_to_each_other_do_not_hang(scene) -> None:
    """A tolerance of 3e-3 m/s cannot tell on which side of the friction's kink at 1e-4 m/s a step ends."""
    changes = {"joints.slider": "ideal", "joints.crank_pin": "clearance", "clearance.crank_pin": 1e-4}
    coarse = {"solver.reference.method": "BDF", "solver.reference.tolerance": 3e-6, "drive.cycles": 0.05}
    result = simulate(scene({**changes, **coarse}))
    assert result.status == "success"
    assert result.provenance["counters"]["steps"] < 10_000


@pytest.mark.parametrize("method", ["bdf", "DOP853", "ode15s", "Euler"])
def test_other_methods_are_refused_in_one_line(scene, method) -> None:
    with pytest.raises(ValueError, match=r"solver\.reference\.method") as caught:
        simulate(scene({"solver.reference.method": method}))
    assert "\n" not in str(caught.value)
    assert all(f"'{name}'" in str(caught.value) for name in ("dop853", *SOLVERS))


@pytest.mark.slow
@pytest.mark.parametrize("slider", ["ideal", "clearance"])
def test_clearance_at_the_crank_pin(scene, slider) -> None:
    """The other formulations, until the journal has hit its bearing a few times."""
    changes = {
        "joints.slider": slider,
        "joints.crank_pin": "clearance",
        "clearance.crank_pin": 1e-4,
        "drive.cycles": 0.03,
        "output.groups": ["joints", "energy"],
        "solver.reference.tolerance": 1e-12,
    }
    few = simulate(scene(changes))
    full = simulate(scene({**changes, "solver.reference.method": "BDF"}))
    np.testing.assert_array_equal(full.events["corner"], few.events["corner"])
    assert few.events["corner"].size > 5
    assert np.abs(full.columns["slider_y"] - few.columns["slider_y"]).max() < 1e-8
    assert np.abs(full.columns["energy_residual"]).max() < 1e-8


def test_endless_switching_at_one_instant_is_stopped(scene, monkeypatch) -> None:
    """As if more modes had ended at the first touch than can: the limit is undercut at once."""
    monkeypatch.setattr("reference_model.integrate.SWITCHES_AT_ONCE", -1)
    result = simulate(scene({"drive.cycles": 0.1, "solver.reference.method": "BDF"}))
    assert result.status == "chatter"
    assert result.remedy


def test_a_contact_within_one_step_is_stepped_over(scene) -> None:
    """What is said of `solve_ivp`'s events: it looks at the ends of steps, and a graze lies between them."""
    wide = {"clearance.slider": 5e-4, "initial.slider_vx": 0.02, "drive.cycles": 0.025}
    free = simulate(scene({**wide, "output.samples_per_cycle": 200_000}))
    depth = 1e-9
    grazing = {**wide, "clearance.slider": free.columns["slider_x"].max() + 0.55 - depth}
    compiled = simulate(scene({**grazing, "solver.reference.tolerance": 3e-6})).events
    assert compiled["start"].size > 0
    by_scipy = {"solver.reference.method": "scipy-DOP853", "solver.reference.tolerance": 3e-6}
    assert simulate(scene({**grazing, **by_scipy})).events["start"].size == 0
