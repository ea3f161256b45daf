"""Errors follow the step at second order (five bodies), or the tolerance (trees)."""

import numpy as np
import pytest

STEP = "solver.exudyn.step"
METHODS = ("generalized-alpha", "trapezoidal-index2")
FOUNDATION = {"contact.law": "foundation"}
# Where touches fall in their steps scatters the order, 1.93 measured of the foundation: the first impact, of
# a whole side, lasts 18 of the largest steps. Last: how far it may be off, and the bound of the last error, m
ORDERS = [
    ({}, [8e-6, 4e-6, 2e-6, 1e-6], METHODS[0], 0.25, 5e-9),
    ({}, [8e-6, 4e-6, 2e-6, 1e-6], METHODS[1], 0.3, 5e-9),
    (FOUNDATION, [5e-7, 2.5e-7, 1.25e-7], METHODS[0], 0.2, 4e-7),
]


def error(result, exact, name):
    return np.max(np.abs(result.columns[name] - exact.columns[name]))


@pytest.mark.parametrize(("law", "steps", "method", "within", "bound"), ORDERS)
def test_the_error_of_five_bodies_is_of_second_order(run, law, steps, method, within, bound):
    """Against the tree; seven contacts in 0.1 cycles."""
    exact = run(law, {"drive.cycles": 0.1}, tree=1e-11)
    changes = law | {"drive.cycles": 0.1, "solver.exudyn.method": method}
    runs = [run(changes, {STEP: step}) for step in steps]
    errors = [error(result, exact, "slider_x") for result in runs]
    assert np.polyfit(np.log(steps), np.log(errors), 1)[0] == pytest.approx(2.0, abs=within), errors
    assert errors[-1] < bound
    assert list(runs[-1].events["corner"]) == list(exact.events["corner"])
    for name in ("normal_speed", "impulse", "peak_force", "largest_depth") if law else ():
        # Second order in the 70 steps of the first impact: 1e-3, magnified by those that follow
        np.testing.assert_allclose(runs[-1].events[name], exact.events[name], rtol=0.02, err_msg=name)


PIN = {"joints.crank_pin": "clearance", "drive.cycles": 0.06, "output.samples_per_cycle": 10_000}
EVENTS = {"start": 1e-8, "end": 1e-8, "normal_speed": 3e-8, "impulse": 2e-9, "peak_force": 2e-5}
THREE = (1e-4, 1.014e-4, 1.027e-4)
# A cycle of chatter, which magnifies round-off to some 1e-12 m; five bounces of the journal, where friction
# reverses inside a step, which scatters errors by a factor of up to 40: three runs of other largest steps.
# Measured 6e-12 m, 9e-10 rad; 2.4e-10 and 2.3e-11 m, 2.1e-7 m/s; steps: 13,493; at most 2302
TREES = {
    "slider": ({"drive.cycles": 1.0}, (1e-4,), {"slider_x": 1e-10, "slider_angle": 1e-8}, 18_000),
    "pin": (PIN | {"joints.slider": "ideal"}, THREE, {"slider_y": 1.5e-9, "slider_vy": 2e-6}, 4000),
    "both": (PIN, THREE, {"slider_y": 1.5e-9, "slider_vy": 2e-6}, 4000),
}


@pytest.mark.parametrize("case", TREES)
def test_the_error_of_a_tree_follows_the_tolerance(run, case):
    changes, steps, bounds, work = TREES[case]
    place = next(iter(bounds))
    tight = run(changes, tree=1e-12)
    usual, loose = ([run(changes, {STEP: step}, tree=each) for step in steps] for each in (1e-10, 1e-7))
    for name, bound in bounds.items():
        assert max(error(result, tight, name) for result in usual) < bound, name
    fine, coarse = (
        np.sqrt(np.mean([error(each, tight, place) ** 2 for each in of])) for of in (usual, loose)
    )
    # 1000 times the tolerance
    assert 50 < coarse / fine < 20_000
    for result in usual:
        # A retry for each touch and for each leaving, a few more as a step is shortened to 3/4 at most
        counters, rows = result.provenance["counters"], result.events
        assert counters["steps"] < work
        assert counters["rejected"] < 0.15 * counters["steps"]
        assert counters["located"] < (3 if case == "slider" else 6) * len(rows["start"])
        # Journal and corners may touch at one instant
        assert sorted(rows["corner"]) == sorted(tight.events["corner"])
        for name, bound in (EVENTS if case == "slider" else {"start": 1e-8}).items():
            np.testing.assert_allclose(rows[name], tight.events[name], rtol=0, atol=bound, err_msg=name)
