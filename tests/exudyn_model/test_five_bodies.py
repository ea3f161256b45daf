"""Five bodies: closed form, second order, steps that follow the contact and never go across a touch."""

import math

import numpy as np
import pytest
from closed_linkage import ideal_y
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from scipy.interpolate import CubicHermiteSpline

from exudyn_model import simulate
from exudyn_model.columns import CLOSED
from exudyn_model.five_bodies import solver, step_choice
from exudyn_model.five_bodies.step_choice import LONGEST, StepChoice
from exudyn_model.tables import turning_points

STEP = "solver.exudyn.step"
METHODS = ("generalized-alpha", "trapezoidal-index2")
SHORT = {"drive.cycles": 0.1}
FOUR = SHORT | {STEP: 4e-6}
# Samples inside of steps; a sample at each tick of 4e-6 s, which leaves no longer step
DENSE, ALL = {"output.samples_per_cycle": 25_000}, {"output.samples_per_cycle": 100_000}


@pytest.mark.parametrize("speed_rpm", [150.0, -90.0])
def test_ideal_slider_follows_the_closed_form(run, make_scene, speed_rpm):
    changes = {"joints.slider": "ideal", "drive.speed_rpm": speed_rpm, "drive.cycles": 1.0, STEP: 2e-5}
    scene, result = make_scene(changes), run(changes)
    columns, dt = result.columns, 1e-4
    before, here, after = (
        ideal_y(scene, math.radians(111.36) + speed_rpm * math.pi / 30 * (columns["time"] + shift))
        for shift in (-dt, 0.0, dt)
    )
    # Joints hold to the Newton tolerance of 1e-7, which its last iteration undercuts by orders
    np.testing.assert_allclose(columns["slider_y"], here, atol=1e-10)
    np.testing.assert_allclose(columns["slider_x"], -0.54995, atol=1e-12)
    np.testing.assert_allclose(columns["slider_angle"], 0.0, atol=1e-12)
    # Index 3 enforces positions; speeds follow to second order: (omega h)^2 of 2 m/s with factors near 1
    np.testing.assert_allclose(columns["slider_vy"], (after - before) / (2 * dt), atol=2e-6)
    # Central difference: dt^2 / 12 times fourth derivatives near 1e5 m/s^4, round-off 1e-16 / dt^2
    np.testing.assert_allclose(columns["slider_ay"], (after - 2 * here + before) / dt**2, atol=3e-4)
    assert not result.events["start"].size
    # Printed to the millimetre a second
    if speed_rpm == 150.0:
        assert columns["slider_vy"].min() == pytest.approx(-1.598, abs=5e-4)
        assert columns["slider_vy"].max() == pytest.approx(2.002, abs=5e-4)


FOUNDATION = {"contact.law": "foundation"}
# Where touches fall in their steps scatters the order, 1.93 measured of the foundation: the first impact, of
# a whole side, lasts 18 of the largest steps. Last: how far it may be off, and the bound of the last error, m
ORDERS = [
    ({}, 0.1, [8e-6, 4e-6, 2e-6, 1e-6], METHODS[0], 0.25, 5e-9),
    ({}, 0.1, [8e-6, 4e-6, 2e-6, 1e-6], METHODS[1], 0.3, 5e-9),
    (FOUNDATION, 0.1, [5e-7, 2.5e-7, 1.25e-7], METHODS[0], 0.2, 4e-7),
    (FOUNDATION, 0.1, [5e-7, 2.5e-7, 1.25e-7], METHODS[1], 0.2, 4e-7),
    # 1.1e-6 .. 1.5e-8 m measured
    pytest.param({}, 1.0, [4e-6, 2e-6, 1e-6, 5e-7], METHODS[0], 0.2, 3e-8, marks=pytest.mark.slow),
]


@pytest.mark.parametrize(("law", "cycles", "steps", "method", "within", "bound"), ORDERS)
def test_the_error_is_of_second_order(run, error, law, cycles, steps, method, within, bound):
    """Against the tree; seven contacts in 0.1 cycles."""
    exact = run(law, {"drive.cycles": cycles}, tree=1e-11)
    changes = law | {"drive.cycles": cycles, "solver.exudyn.method": method}
    runs = [run(changes, {STEP: step}) for step in steps]
    errors = [error(result, exact, "slider_x") for result in runs]
    assert np.polyfit(np.log(steps), np.log(errors), 1)[0] == pytest.approx(2.0, abs=within), errors
    assert errors[-1] < bound
    if cycles == 1.0:
        assert errors[0] < 2.2e-6
        assert error(runs[-1], exact, "slider_angle") < 6e-6
        return
    assert list(runs[-1].events["corner"]) == list(exact.events["corner"])
    if law:
        for name in ("normal_speed", "impulse", "peak_force", "largest_depth"):
            # Second order in the 70 steps of the first impact: 1e-3, magnified by those that follow
            np.testing.assert_allclose(runs[-1].events[name], exact.events[name], rtol=0.02, err_msg=name)
    else:
        for name in ("slider_y", "slider_angle", "slider_vy"):
            # Second order: a third of the difference to the run before; touches scatter it
            assert error(runs[-1], exact, name) < 0.6 * error(runs[-2], runs[-1], name), name


@pytest.mark.parametrize("step", [8e-6, 2e-6])
def test_a_cycle_with_rests_on_a_side_is_finished(run, step):
    result = run(FOUNDATION, {"drive.cycles": 1.0, STEP: step})
    assert result.status == "success", result.remedy
    assert len(result.columns["time"]) == 1001
    # What its joints, placed to 1e-16 m, let the iteration meet: 5e-17 m times 2.88e10 N/m
    assert result.provenance["settings"]["newton_tolerance"] == pytest.approx(1.44e-6, rel=1e-2)


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


def test_what_is_not_foreseen_is_located_and_taken_back(make_scene, monkeypatch):
    """In flight each step is as long as any: touches are then found by what follows a step alone."""
    scene = make_scene(SHORT, thrown(0.3, 0.1, True, 1.0, 150.0))
    usual, choose = simulate(scene), StepChoice.choose

    def blind(self, wanted):
        in_flight = self.time > self.size and not self._contacts[:, CLOSED].any()
        choose(self, LONGEST if in_flight else wanted)

    monkeypatch.setattr(StepChoice, "choose", blind)
    result = simulate(scene)
    assert result.provenance["counters"]["rejected"] > 2
    assert usual.provenance["counters"]["rejected"] == 0
    for corner in ("ll", "lr", "ul", "ur"):
        starts = [r.events["start"][r.events["corner"] == corner][:2] for r in (result, usual)]
        # The order's error of the longest step, in rates of 0.1 m/s; a step is 6.4e-5 s long
        np.testing.assert_allclose(*starts, atol=1e-6)


@pytest.mark.parametrize("method", METHODS)
def test_long_steps_in_flight_cost_no_accuracy(run, error, method):
    changes = FOUR | {"solver.exudyn.method": method}
    result, fixed, exact = run(changes), run(changes, ALL), run(SHORT, tree=1e-10)
    assert fixed.provenance["settings"]["longest_step"] == fixed.provenance["settings"]["step_used"]
    assert result.provenance["settings"]["longest_step"] <= LONGEST * 4.001e-6
    assert result.provenance["counters"]["steps"] < 0.3 * fixed.provenance["counters"]["steps"]
    assert list(result.events["corner"]) == list(fixed.events["corner"])
    for name in ("start", "impulse", "peak_force"):
        errors = [np.abs(r.events[name] - exact.events[name]).max() for r in (result, fixed)]
        # That of the contacts, which both resolve alike
        assert errors[0] < 1.2 * errors[1], (name, errors)
    x = fixed.columns["slider_x"][::100]
    # Where in a step a touch falls scatters the error by some per cent
    assert error(result, exact, "slider_x") < 1.1 * np.abs(x - exact.columns["slider_x"]).max()


def test_before_the_first_contact_the_error_is_that_of_short_steps(run, error):
    exact = run({"drive.cycles": 0.025}, tree=1e-10)
    assert not len(exact.events["start"])
    # Of second order: 3.3e-13 m at 8e-6 s, 1.2e-11 m at the 6.4e-5 s of later flights
    assert error(run({"drive.cycles": 0.025}), exact, "slider_x") < 1e-12


def test_extrema_between_samples_are_those_of_every_step(run):
    result, fixed = run(SHORT), run(SHORT, {"output.samples_per_cycle": 200_000})
    for name in ("slider_y", "slider_vy"):
        span = fixed.extrema[name]["max"] - fixed.extrema[name]["min"]
        for side in ("min", "max"):
            # Velocities of index 3 are wrong by 1e-7 of it in flight. Where the largest of states a step of
            # 8e-5 s apart counted, it would be 4e-7
            assert result.extrema[name][side] == pytest.approx(fixed.extrema[name][side], abs=3e-7 * span)


@given(numbers=st.tuples(*[st.floats(-1.0, 1.0)] * 4), step=st.sampled_from([1e-6, 1.0]))
def test_turning_points_are_those_of_the_cubic_through_both_ends(numbers, step):
    before, rise0, after, rise1 = numbers
    assume(min(abs(rise0), abs(rise1)) > 1e-3)  # less is cancelled
    ends = before, rise0 / step, after, rise1 / step
    fraction, value = (column[0] for column in turning_points(*(np.array([x]) for x in (*ends, step))))
    assert np.isinf(fraction) == (rise0 * rise1 > 0.0)
    if np.isfinite(fraction):
        cubic = CubicHermiteSpline([0.0, 1.0], [before, after], [rise0, rise1])
        assert 0.0 <= fraction <= 1.0
        assert cubic(fraction, 1) == pytest.approx(0.0, abs=1e-10)
        assert cubic(fraction) == pytest.approx(value, abs=1e-12)


def test_a_failure_of_newtons_method_in_a_long_step_leaves_no_trace(make_scene, monkeypatch):
    """The step is tried again, shorter; Exudyn does not restore what its method keeps of the last one."""
    monkeypatch.setattr(step_choice, "LONGEST_BEFORE_CONTACT", LONGEST)
    scene = make_scene({"drive.cycles": 0.01})
    usual = simulate(scene).columns
    build, shorten, choose = solver.build, StepChoice.shorten, StepChoice.choose
    models = []
    failed = []

    def kept(*arguments):
        models.append(build(*arguments))
        return models[-1]

    def failing(self, wanted):
        choose(self, wanted)
        newton = models[-1].mbs.sys["dynamicSolver"].newton
        newton.maxIterations = 0 if self.ticks > 8 and self.time > 2e-3 and not failed else 25

    def noted(self, fraction):
        failed.append(fraction)
        models[-1].mbs.sys["dynamicSolver"].newton.maxIterations = 25
        shorten(self, fraction)

    monkeypatch.setattr(solver, "build", kept)
    monkeypatch.setattr(StepChoice, "choose", failing)
    monkeypatch.setattr(StepChoice, "shorten", noted)
    result = simulate(scene)
    assert result.status == "success"
    assert len(failed) == 1
    # Other steps from there on, after which rates of index 3 settle: measured 4e-8 m/s
    np.testing.assert_allclose(result.columns["slider_vy"], usual["slider_vy"], atol=2e-7)


def test_a_kink_of_friction_is_passed_in_parts_of_a_tick(run):
    """At 10 m/s friction reverses the slip several times over in a tick, where Newton's method goes round."""
    scene = {"initial.slider_vx": 10.0, "drive.cycles": 0.001}
    result, exact = run(scene), run(scene, tree=1e-10)
    assert result.status == "success"
    assert result.provenance["counters"]["rejected"] > 0
    assert list(result.events["corner"]) == list(exact.events["corner"])
    # Of second order in a fortieth of a contact: a tick of 2e-6 s, contacts of 9e-5 s; two are cut off
    np.testing.assert_allclose(result.events["impulse"][:4], exact.events["impulse"][:4], rtol=1e-3)


def test_samples_inside_steps_are_as_accurate_as_states(run):
    dense, fixed, exact = run(FOUR, DENSE), run(FOUR, ALL), run(SHORT, DENSE, tree=1e-10)
    assert dense.provenance["counters"]["steps"] < 0.2 * fixed.provenance["counters"]["steps"]
    assert set(dense.extrema) == set(dense.columns) - {"time"}
    for name, values in dense.columns.items():
        right = exact.columns[name]
        errors = [np.abs(column - right).max() for column in (values, fixed.columns[name][::4])]
        # That of the contacts, scattered by where in a step their touches fall; 1e-6 of the range: the error
        # of linear interpolation over a step of 1.3e-4 s at 150 rpm, (15.7 1.3e-4)^2 / 8 = 5e-7
        assert errors[0] <= 1.5 * errors[1] + 1e-6 * np.ptp(right), (name, errors)
        # A gap between two states, where no channel says how it turns: (15.7 1.3e-4)^2 / 8 of the motion, but
        # 20 times as much of the gap, whose range is that much less
        if name != "time":
            assert dense.extrema[name]["min"] <= values.min() + 1e-5 * np.ptp(values)
            assert dense.extrema[name]["max"] >= values.max() - 1e-5 * np.ptp(values)


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


@pytest.mark.parametrize("group", ["joints", "energy"])
def test_what_is_not_interpolated_has_a_state_at_each_sample(run, group):
    changes = (
        FOUR | DENSE | {"drive.cycles": 0.01, "output.groups": [group], "solver.exudyn.method": METHODS[1]}
    )
    assert run(changes).provenance["settings"]["longest_step"] <= 4 * 4.001e-6
