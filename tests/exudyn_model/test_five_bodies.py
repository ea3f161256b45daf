"""Five bodies: second order, steps that follow the contact and never go across a touch."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from exudyn_model import simulate

STEP = "solver.exudyn.step"
METHODS = ("generalized-alpha", "trapezoidal-index2")
FOUR = {"drive.cycles": 0.1, STEP: 4e-6}
FOUNDATION = {"contact.law": "foundation"}
# Where touches fall in their steps scatters the order, 1.93 measured of the foundation: the first impact, of
# a whole side, lasts 18 of the largest steps. Last: how far it may be off, and the bound of the last error, m
ORDERS = [
    ({}, [8e-6, 4e-6, 2e-6, 1e-6], METHODS[0], 0.25, 5e-9),
    ({}, [8e-6, 4e-6, 2e-6, 1e-6], METHODS[1], 0.3, 5e-9),
    (FOUNDATION, [5e-7, 2.5e-7, 1.25e-7], METHODS[0], 0.2, 4e-7),
    (FOUNDATION, [5e-7, 2.5e-7, 1.25e-7], METHODS[1], 0.2, 4e-7),
]


@pytest.mark.parametrize(("law", "steps", "method", "within", "bound"), ORDERS)
def test_the_error_is_of_second_order(run, error, law, steps, method, within, bound):
    """Against the tree; seven contacts in 0.1 cycles."""
    exact = run(law, {"drive.cycles": 0.1}, tree=1e-11)
    changes = law | {"drive.cycles": 0.1, "solver.exudyn.method": method}
    runs = [run(changes, {STEP: step}) for step in steps]
    errors = [error(result, exact, "slider_x") for result in runs]
    assert np.polyfit(np.log(steps), np.log(errors), 1)[0] == pytest.approx(2.0, abs=within), errors
    assert errors[-1] < bound
    assert list(runs[-1].events["corner"]) == list(exact.events["corner"])
    if law:
        for name in ("normal_speed", "impulse", "peak_force", "largest_depth"):
            # Second order in the 70 steps of the first impact: 1e-3, magnified by those that follow
            np.testing.assert_allclose(runs[-1].events[name], exact.events[name], rtol=0.02, err_msg=name)
    else:
        for name in ("slider_y", "slider_angle", "slider_vy"):
            # Second order: a third of the difference to the run before; touches scatter it
            assert error(runs[-1], exact, name) < 0.6 * error(runs[-2], runs[-1], name), name


def thrown(offset, vx, left, omega, rpm):
    """Scene of 5 ms: some touches; later ones may differ, as neighbouring runs diverge."""
    return {
        "drive.speed_rpm": rpm,
        "drive.cycles": 0.005 * rpm / 60,
        "output.samples_per_cycle": round(10 * 6000 / rpm),
        "initial.slider_offset": offset * 2e-4,
        "initial.slider_vx": -vx if left else vx,
        "initial.slider_omega": omega,
        # With it, Newton's method fails in some impacts of 0.3 m/s, in steps of any length
        "friction.coefficient": 0.0,
    }


@settings(max_examples=12, deadline=None)
@given(
    offset=st.floats(-0.9, 0.9),
    vx=st.floats(0.05, 0.2),
    left=st.booleans(),
    omega=st.floats(-3.0, 3.0),
    rpm=st.sampled_from([60.0, 150.0, 400.0]),
)
# A touch at 4.996 ms, which five bodies have at 5.006 ms
@example(offset=-0.534312704367848, vx=0.1906545125638462, left=True, omega=1.845703125, rpm=150.0)
# Whose fifth contact the tree has 0.15 ms earlier, four times as far as at half the step
@example(offset=0.0822, vx=0.1994, left=False, omega=0.6328, rpm=400.0)
def test_no_touch_is_stepped_over(make_scene, offset, vx, left, omega, rpm):
    scene = thrown(offset, vx, left, omega, rpm)
    # Steps of a tick alone, by a sample at each: where the contacts' own error of second order, which hits of
    # two corners at nearly one instant magnify, is the same
    exact = simulate(make_scene(scene, {"output.samples_per_cycle": round(60 / rpm / 2e-6)}))
    assert exact.provenance["settings"]["longest_step"] == exact.provenance["settings"]["step_used"]
    result, slack = simulate(make_scene(scene)), 1e-4
    for corner, start, end in zip(*(exact.events[name] for name in ("corner", "start", "end")), strict=True):
        # Grazing contacts alone may be absent: one that lasts less than a tenth of an impact's 2e-4 s
        end = max(end - 2e-5, start)
        own = result.events["corner"] == corner
        during = (result.events["start"] < end + slack) & (result.events["end"] > start - slack)
        # In the other run it may lie behind the end
        assert start >= exact.columns["time"][-1] - slack or np.any(own & during), (corner, start)
    assert result.provenance["counters"]["steps"] < 0.005 / 2e-6


@pytest.mark.parametrize("times", [10, 50])
def test_more_samples_change_no_step(run, times):
    """There are states at the samples of a thousandth of a cycle alone, whether or not there are others."""
    usual, dense = (run(FOUR, {"output.samples_per_cycle": n}) for n in (1000, 1000 * times))
    assert dense.provenance["settings"]["steps_per_sample"] == 100 // times
    assert dense.provenance["counters"] == usual.provenance["counters"]
    assert list(dense.events["corner"]) == list(usual.events["corner"])
    # Extrema are the same as well. A tick of 4e-4 s / 100 is rounded otherwise than one of 4e-5 s / 10
    pairs = [
        *((dense.events[name], usual.events[name]) for name in usual.events if name != "corner"),
        *((dense.columns[name][::times], usual.columns[name]) for name in usual.columns if name != "time"),
        *((dense.cycle_extrema[name], values) for name, values in usual.cycle_extrema.items()),
    ]
    for values, expected in pairs:
        bound = 0.0 if times == 50 else 1e-6 * np.abs(expected).max()
        np.testing.assert_allclose(values, expected, rtol=0, atol=bound)
