"""Errors of five bodies follow the step at second order; trees take few steps."""

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


# A cycle of chatter; five bounces of the journal, where friction reverses inside a step. Measured: 13,493 and
# at most 2302 steps
@pytest.mark.parametrize(
    ("changes", "work", "retries"),
    [({"drive.cycles": 1.0}, 18_000, 3), (PIN | {"joints.slider": "ideal"}, 4000, 6), (PIN, 4000, 6)],
)
def test_a_tree_takes_few_steps(run, changes, work, retries):
    """A retry for each touch and for each leaving, a few more as a step is shortened to 3/4 at most."""
    result = run(changes, tree=1e-10)
    counters = result.provenance["counters"]
    assert counters["steps"] < work
    assert counters["rejected"] < 0.15 * counters["steps"]
    assert counters["located"] < retries * len(result.events["start"])
