"""Dense samples of five bodies: inside long steps in flight, and as accurate as states."""

import numpy as np
import pytest

from exudyn_model import simulate
from exudyn_model.channels import CHANNELS, GAP, PER_CONTACT, SLIDER_ALPHA
from exudyn_model.constants import linkage_record
from exudyn_model.contact.gaps import contact_law, corner_motion
from exudyn_model.five_bodies.samples_between import interpolate
from exudyn_model.five_bodies.step_choice import StepChoice
from exudyn_model.reading import read_scene

FULL = {"drive.cycles": 0.1, "solver.exudyn.formulation": "full", "solver.exudyn.step": 4e-6}
# One in four ticks, and one a tick, which leaves no longer step
DENSE = {"output.samples_per_cycle": 25_000}
FIXED = {"output.samples_per_cycle": 100_000}
TREE = {
    "solver.exudyn.formulation": "tree",
    "solver.exudyn.method": "dopri5",
    "solver.exudyn.step": 1e-4,
    "solver.exudyn.tolerance": 1e-11,
}


def test_a_cubic_motion_is_interpolated_exactly(make_scene):
    """Coordinates of third order in time with velocities of second: cubic Hermite polynomials hold both."""
    parameters = read_scene(make_scene({}))
    law = contact_law(parameters.contact, parameters.mechanism.slider, 1e-6)
    linkage = linkage_record(parameters)
    guide_x, start, step = parameters.mechanism.guide_x, 0.3, 2e-3
    motion = np.array([[1e-4, 0.02, -3.0, 40.0], [0.3, 1.0, 50.0, 900.0], [1e-3, -0.5, 20.0, -3e3]])
    motion[0, 0] += guide_x

    def values(time):
        t, found = time - start, np.zeros(len(CHANNELS))
        found[:3] = motion @ [1.0, t, t**2, t**3]
        found[3:6] = motion @ [0.0, 1.0, 2.0 * t, 3.0 * t**2]
        found[6:9] = motion @ [0.0, 0.0, 2.0, 6.0 * t]
        for corner in range(4):
            gap = corner_motion(corner, found[0] - guide_x, found[2], 0.0, 0.0, 0.0, law[0]).gap
            found[GAP + PER_CONTACT * corner] = gap
        return found

    times = start + step * np.array([0.1, 0.4, 0.95])
    samples = np.zeros((3, len(CHANNELS)))
    ends = values(start), values(start + step)
    interpolate(*ends, start, step, times, linkage[0], law[0], samples)
    expected = np.array([values(time) for time in times])
    expected[:, SLIDER_ALPHA] = 0.0  # without a force at a corner
    # Rounding of terms of the size of the coordinates
    np.testing.assert_allclose(samples, expected, rtol=1e-12, atol=1e-15)


def test_samples_inside_steps_are_as_accurate_as_states(make_scene):
    dense, fixed, exact = (simulate(make_scene(FULL | scene)) for scene in (DENSE, FIXED, DENSE | TREE))
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
        simulate(make_scene(FULL | {"output.samples_per_cycle": n})) for n in (1000, 1000 * times)
    )
    assert dense.provenance["settings"]["steps_per_sample"] == 100 // times
    assert dense.provenance["counters"] == usual.provenance["counters"]
    assert list(dense.events["corner"]) == list(usual.events["corner"])
    # Nor an extremum. A tick of 4e-4 s / 100 is rounded otherwise than one of 4e-5 s / 10, which the contacts
    # magnify: to 3e-8 of the scale here, and by another factor where another processor rounds otherwise
    pairs = [
        *((dense.events[name], usual.events[name]) for name in usual.events if name != "corner"),
        *((dense.columns[name][::times], usual.columns[name]) for name in usual.columns if name != "time"),
        *((dense.cycle_extrema[name], values) for name, values in usual.cycle_extrema.items()),
    ]
    for found, expected in pairs:
        scale = np.abs(expected).max()
        np.testing.assert_allclose(found, expected, rtol=0, atol=0.0 if times == 50 else 1e-6 * scale)


def test_extrema_enclose_all_samples(make_scene):
    result = simulate(make_scene(FULL | DENSE))
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
    scene = FULL | DENSE | scene
    assert simulate(make_scene(scene)).provenance["settings"]["longest_step"] <= 4 * 4.001e-6


@pytest.mark.parametrize(
    ("before", "after", "inside"), [(0, 5, [2, 4]), (2, 4, []), (3, 3.5, []), (3.5, 5, [4])]
)
def test_samples_at_the_ends_of_a_step_are_not_inside(before, after, inside):
    choice = StepChoice.__new__(StepChoice)
    choice.per_sample, choice._per_state, choice._tick, choice.ticks = 2, 6, after, after - before
    assert list(choice.samples_inside()) == inside
