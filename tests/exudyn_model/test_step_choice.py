"""Steps that follow the contact: none goes across a touch, and what they give is that of fixed steps."""

from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from exudyn_model import simulate
from exudyn_model.columns import CLOSED
from exudyn_model.five_bodies import solver, step_choice
from exudyn_model.five_bodies.step_choice import LONGEST, StepChoice

FULL = {"drive.cycles": 0.1, "solver.exudyn.formulation": "full", "solver.exudyn.method": "generalized-alpha"}
TREE = {
    "solver.exudyn.formulation": "tree",
    "solver.exudyn.method": "dopri5",
    "solver.exudyn.step": 1e-4,
    "solver.exudyn.tolerance": 1e-10,
}
FOUR = FULL | {"solver.exudyn.step": 4e-6}
# Samples inside of steps; a sample at each tick
DENSE, ALL = {"output.samples_per_cycle": 25_000}, {"output.samples_per_cycle": 100_000}
# A sample at each tick of 4e-6 s leaves no longer step
FIXED = {"output.samples_per_cycle": 100_000, "solver.exudyn.step": 4e-6}


def near(scene: Any, other: Any, corner: str, within: float, count: int) -> None:
    """Assert that the first contacts of a corner begin together in both results."""
    starts = [result.events["start"][result.events["corner"] == corner][:count] for result in (scene, other)]
    assert len(starts[0]) == len(starts[1])
    np.testing.assert_allclose(*starts, atol=within)


RANDOM = {
    "offset": st.floats(-0.9, 0.9),
    "vx": st.floats(0.05, 0.2),
    "left": st.booleans(),
    "omega": st.floats(-3.0, 3.0),
    "rpm": st.sampled_from([60.0, 150.0, 400.0]),
}


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


def missed(result: Any, exact: Any, slack: float) -> list[float]:
    """Times of contacts of ``exact`` while ``result`` has none of that corner.

    Not of those that begin so late that in ``result`` they may lie behind the end of the run.
    """
    found, last = [], exact.columns["time"][-1] - slack
    for corner, start, end in zip(*(exact.events[name] for name in ("corner", "start", "end")), strict=True):
        own = result.events["corner"] == corner
        during = (result.events["start"] < end + slack) & (result.events["end"] > start - slack)
        if start < last and not np.any(own & during):
            found.append(float(start))
    return found


@settings(max_examples=12, deadline=None)
@given(**RANDOM)
# A touch at 4.996 ms, which five bodies have at 5.006 ms
@example(offset=-0.534312704367848, vx=0.1906545125638462, left=True, omega=1.845703125, rpm=150.0)
# Whose fifth contact the tree has 0.15 ms earlier, four times as far as at half the step
@example(offset=0.0822, vx=0.1994, left=False, omega=0.6328, rpm=400.0)
def test_no_touch_is_stepped_over(make_scene, offset, vx, left, omega, rpm):
    scene = thrown(offset, vx, left, omega, rpm)
    # Steps of a tick alone, by a sample at each: where the contacts' own error of second order, which hits of
    # two corners at nearly one instant magnify, is the same
    every = {"output.samples_per_cycle": round(60 / rpm / 2e-6)}
    exact = simulate(make_scene(FULL | scene | every))
    assert exact.provenance["settings"]["longest_step"] == exact.provenance["settings"]["step_used"]
    result = simulate(make_scene(FULL | scene))
    # Grazing contacts alone may be absent: one that lasts less than a tenth of an impact's 2e-4 s
    exact.events["end"][:] = np.maximum(exact.events["end"] - 2e-5, exact.events["start"])
    assert not missed(result, exact, slack=1e-4)
    assert result.provenance["counters"]["steps"] < 0.005 / 2e-6


def test_what_is_not_foreseen_is_located_and_taken_back(make_scene, monkeypatch):
    """In flight each step is as long as any: touches are then found by what follows a step alone."""
    scene = FULL | thrown(0.3, 0.1, True, 1.0, 150.0)
    usual, choose = simulate(make_scene(scene)), StepChoice.choose

    def blind(self: StepChoice, wanted: float) -> None:
        in_flight = self.time > self.size and not self._contacts[:, CLOSED].any()
        choose(self, LONGEST if in_flight else wanted)

    monkeypatch.setattr(StepChoice, "choose", blind)
    result = simulate(make_scene(scene))
    assert result.provenance["counters"]["rejected"] > 2
    assert usual.provenance["counters"]["rejected"] == 0
    for corner in ("ll", "lr", "ul", "ur"):
        # The order's error of the longest step, in rates of 0.1 m/s; a step is 6.4e-5 s long
        near(result, usual, corner, 1e-6, 2)


@pytest.mark.parametrize("method", ["generalized-alpha", "trapezoidal-index2"])
def test_contacts_are_those_of_fixed_steps(make_scene, method):
    scene = {
        "drive.cycles": 0.1,
        "solver.exudyn.formulation": "full",
        "solver.exudyn.method": method,
        "solver.exudyn.step": 4e-6,
    }
    result, fixed = simulate(make_scene(scene)), simulate(make_scene(scene | FIXED))
    assert fixed.provenance["settings"]["longest_step"] == fixed.provenance["settings"]["step_used"]
    assert result.provenance["settings"]["longest_step"] <= LONGEST * 4.001e-6
    assert result.provenance["counters"]["steps"] < 0.3 * fixed.provenance["counters"]["steps"]
    assert list(result.events["corner"]) == list(fixed.events["corner"])
    exact = simulate(make_scene(scene | TREE))
    for name in ("start", "impulse", "peak_force"):
        errors = [np.abs(run.events[name] - exact.events[name]).max() for run in (result, fixed)]
        # That of the contacts, which both resolve alike
        assert errors[0] < 1.2 * errors[1], (name, errors)


def test_before_the_first_contact_the_error_is_that_of_short_steps(make_scene):
    scene = {"drive.cycles": 0.025}
    exact = simulate(make_scene(TREE | scene))
    assert not len(exact.events["start"])
    result = simulate(make_scene(FULL | scene | {"solver.exudyn.step": 2e-6}))
    # Of second order: 3.3e-13 m at 8e-6 s, 1.2e-11 m at the 6.4e-5 s of later flights
    np.testing.assert_allclose(result.columns["slider_x"], exact.columns["slider_x"], rtol=0.0, atol=1e-12)


def test_the_error_is_of_second_order_and_no_larger_than_that_of_fixed_steps(make_scene):
    exact = simulate(make_scene(TREE | {"drive.cycles": 0.1})).columns["slider_x"]
    steps, errors = [8e-6, 4e-6, 2e-6, 1e-6], []
    for step in steps:
        result = simulate(make_scene(FULL | {"solver.exudyn.step": step}))
        errors.append(np.abs(result.columns["slider_x"] - exact).max())
    fixed = simulate(make_scene(FULL | FIXED)).columns["slider_x"][::100]
    # Where in a step a touch falls scatters the error by some per cent
    assert errors[1] < 1.1 * np.abs(fixed - exact).max()
    order = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert order == pytest.approx(2.0, abs=0.3), errors


def test_extrema_between_states_are_interpolated(make_scene):
    """In flight, under gravity and the drive, against a state at each tick."""
    every = {"output.samples_per_cycle": 200_000}
    result, fixed = simulate(make_scene(FULL)), simulate(make_scene(FULL | every))
    for name in ("slider_y", "slider_vy"):
        span = fixed.extrema[name]["max"] - fixed.extrema[name]["min"]
        for side in ("min", "max"):
            # Velocities of index 3 are wrong by 1e-7 of it in flight. Where the largest of states a step of
            # 8e-5 s apart counted, it would be 4e-7
            assert result.extrema[name][side] == pytest.approx(fixed.extrema[name][side], abs=3e-7 * span)


def test_a_failure_of_newtons_method_in_a_long_step_leaves_no_trace(make_scene, monkeypatch):
    """The step is tried again, shorter; Exudyn does not restore what its method keeps of the last one."""
    monkeypatch.setattr(step_choice, "LONGEST_BEFORE_CONTACT", LONGEST)
    scene = FULL | {"drive.cycles": 0.01}
    usual = simulate(make_scene(scene)).columns
    models, build, shorten, choose = [], solver.build, StepChoice.shorten, StepChoice.choose

    def kept(*arguments: Any) -> Any:
        models.append(build(*arguments))
        return models[-1]

    def failing(self: StepChoice, wanted: float) -> None:
        choose(self, wanted)
        newton = models[-1].mbs.sys["dynamicSolver"].newton
        newton.maxIterations = 0 if self.ticks > 8 and self.time > 2e-3 and not failed else 25

    failed: list[float] = []

    def noted(self: StepChoice, fraction: float) -> None:
        failed.append(fraction)
        models[-1].mbs.sys["dynamicSolver"].newton.maxIterations = 25
        shorten(self, fraction)

    monkeypatch.setattr(solver, "build", kept)
    monkeypatch.setattr(StepChoice, "choose", failing)
    monkeypatch.setattr(StepChoice, "shorten", noted)
    result = simulate(make_scene(scene))
    assert result.status == "success"
    assert len(failed) == 1
    # Other steps from there on, after which rates of index 3 settle: measured 4e-8 m/s
    np.testing.assert_allclose(result.columns["slider_vy"], usual["slider_vy"], atol=2e-7)


def test_a_kink_of_friction_is_passed_in_parts_of_a_tick(make_scene):
    """At 10 m/s friction reverses the slip several times over in a tick, where Newton's method goes round."""
    scene = {"initial.slider_vx": 10.0, "drive.cycles": 0.001}
    result, exact = simulate(make_scene(FULL | scene)), simulate(make_scene(TREE | scene))
    assert result.status == "success"
    assert result.provenance["counters"]["rejected"] > 0
    assert list(result.events["corner"]) == list(exact.events["corner"])
    # Of second order in a fortieth of a contact: a tick of 2e-6 s, contacts of 9e-5 s; two are cut off
    np.testing.assert_allclose(result.events["impulse"][:4], exact.events["impulse"][:4], rtol=1e-3)


def test_samples_inside_steps_are_as_accurate_as_states(make_scene):
    dense, fixed, exact = (simulate(make_scene(FOUR | scene)) for scene in (DENSE, ALL, DENSE | TREE))
    assert fixed.provenance["settings"]["longest_step"] == fixed.provenance["settings"]["step_used"]
    assert dense.provenance["counters"]["steps"] < 0.2 * fixed.provenance["counters"]["steps"]
    assert list(dense.events["corner"]) == list(fixed.events["corner"])
    for name in exact.columns:
        errors = [
            np.abs(values - exact.columns[name]).max()
            for values in (dense.columns[name], fixed.columns[name][::4])
        ]
        # That of the contacts, scattered by where in a step their touches fall; 1e-6 of the range: the error
        # of linear interpolation over a step of 1.3e-4 s at 150 rpm, (15.7 1.3e-4)^2 / 8 = 5e-7
        span = np.ptp(exact.columns[name])
        assert errors[0] <= 1.5 * errors[1] + 1e-6 * span, (name, errors, span)


@pytest.mark.parametrize("times", [10, 50])
def test_more_samples_change_no_step(make_scene, times):
    """There are states at the samples of a thousandth of a cycle alone, whether or not there are others."""
    usual, dense = (
        simulate(make_scene(FOUR | {"output.samples_per_cycle": n})) for n in (1000, 1000 * times)
    )
    assert dense.provenance["settings"]["steps_per_sample"] == 100 // times
    assert dense.provenance["counters"] == usual.provenance["counters"]
    assert list(dense.events["corner"]) == list(usual.events["corner"])
    # Nor an extremum. A tick of 4e-4 s / 100 is rounded otherwise than one of 4e-5 s / 10
    pairs = [
        *((dense.events[name], usual.events[name]) for name in usual.events if name != "corner"),
        *((dense.columns[name][::times], usual.columns[name]) for name in usual.columns if name != "time"),
        *((dense.cycle_extrema[name], values) for name, values in usual.cycle_extrema.items()),
    ]
    for found, expected in pairs:
        scale = np.abs(expected).max()
        np.testing.assert_allclose(found, expected, rtol=0, atol=0.0 if times == 50 else 1e-6 * scale)


def test_extrema_enclose_all_samples(make_scene):
    result = simulate(make_scene(FOUR | DENSE))
    assert set(result.extrema) == set(result.columns) - {"time"}
    for name, extrema in result.extrema.items():
        values = result.columns[name]
        # A gap between two states, where no channel says how it turns: (15.7 1.3e-4)^2 / 8 of the motion, but
        # 20 times as much of the gap, whose range is that much less
        assert extrema["min"] <= values.min() + 1e-5 * np.ptp(values)
        assert extrema["max"] >= values.max() - 1e-5 * np.ptp(values)


@pytest.mark.parametrize("groups", [["joints"], ["energy"]])
def test_what_is_not_interpolated_has_a_state_at_each_sample(make_scene, groups):
    scene = {"drive.cycles": 0.01, "output.groups": groups, "solver.exudyn.method": "trapezoidal-index2"}
    scene = FOUR | DENSE | scene
    assert simulate(make_scene(scene)).provenance["settings"]["longest_step"] <= 4 * 4.001e-6
