"""Rod 4 and slider alone: the moving frame, touches located inside steps, convergence, and the full model."""

import numpy as np
import pytest

from exudyn_model import simulate
from exudyn_model.parameters import read_scene


def test_converges_over_the_first_cycle(tree_scene, error):
    tight = simulate(tree_scene(1e-12, {"drive.cycles": 1.0}))
    usual = simulate(tree_scene(1e-10, {"drive.cycles": 1.0}))
    loose = simulate(tree_scene(1e-7, {"drive.cycles": 1.0}))

    # Measured 6e-12 m, 9e-10 rad; chatter after the reversal magnifies round-off to some 1e-12 m
    assert error(usual, tight, "slider_x") < 1e-10
    assert error(usual, tight, "slider_angle") < 1e-8
    # Errors follow the tolerance, 1000 times as large, with the scatter of touches among the steps
    assert 100 < error(loose, tight, "slider_x") / error(usual, tight, "slider_x") < 10_000
    # The work: 13,493 steps measured; a retry for each touch and for each leaving, a few more by the rule
    # that a step is shortened to three quarters at most
    counters = usual.provenance["counters"]
    assert counters["steps"] < 18_000
    assert counters["rejected"] < 0.15 * counters["steps"]
    assert counters["located"] < 3 * len(usual.events["start"])
    assert counters["rhs"] == 7 * (counters["steps"] + counters["rejected"] + counters["located"])
    # The same contacts, each of them; times and speeds as accurate as the states
    assert np.array_equal(usual.events["corner"], tight.events["corner"])
    for name, tolerance in {
        "start": 1e-8,
        "end": 1e-8,
        "normal_speed": 3e-8,
        "impulse": 2e-9,
        "peak_force": 2e-5,
        "largest_depth": 2e-12,
    }.items():
        np.testing.assert_allclose(
            usual.events[name], tight.events[name], rtol=0, atol=tolerance, err_msg=name
        )


def test_agrees_with_the_full_model(make_scene, tree_scene):
    """The first 0.04 s with seven contacts; five bodies in steps of 2 and 1 us, extrapolated."""
    tree = simulate(tree_scene(1e-10, {"drive.cycles": 0.1})).columns
    coarse, fine = (
        simulate(make_scene({"drive.cycles": 0.1, "solver.exudyn.step": step})).columns
        for step in (2e-6, 1e-6)
    )
    for name in ("slider_x", "slider_y", "slider_angle", "slider_vy"):
        difference = np.max(np.abs(fine[name] - tree[name]))
        error = np.max(np.abs(coarse[name] - fine[name]))
        # Second order: the fine run's error is a third of the difference of both; touches scatter it
        assert difference < 0.6 * error, name
    assert np.max(np.abs(fine["slider_x"] - tree["slider_x"])) < 5e-9


@pytest.mark.slow
def test_agrees_with_the_full_model_over_the_first_cycle(make_scene, tree_scene):
    tree = simulate(tree_scene(1e-10, {"drive.cycles": 1.0})).columns
    full = simulate(make_scene({"drive.cycles": 1.0, "solver.exudyn.step": 5e-7})).columns
    # The five bodies' own error at this step, measured 3e-8 m at most
    np.testing.assert_allclose(full["slider_x"], tree["slider_x"], rtol=0, atol=6e-8)
    np.testing.assert_allclose(full["slider_angle"], tree["slider_angle"], rtol=0, atol=6e-6)


def test_no_contact_is_stepped_over(tree_scene):
    """A contact lasts 0.2 ms; at a loose tolerance steps in flight are ten times as long."""
    tight = simulate(tree_scene(1e-10, {"drive.cycles": 0.25}))
    long = simulate(tree_scene(1e-6, {"drive.cycles": 0.25, "solver.exudyn.step": 1e-2}))
    assert long.provenance["counters"]["steps"] < 1000
    assert list(long.events["corner"]) == list(tight.events["corner"])
    np.testing.assert_allclose(long.events["start"], tight.events["start"], rtol=0, atol=1e-5)


def test_samples_do_not_depend_on_the_largest_step(tree_scene):
    """Interpolated samples against those of steps of 4 us, 100 to a sample interval."""
    often = simulate(tree_scene(1e-11, {"drive.cycles": 0.1, "solver.exudyn.step": 4e-6}))
    seldom = simulate(tree_scene(1e-11, {"drive.cycles": 0.1, "solver.exudyn.step": 1e-3}))
    assert often.provenance["counters"]["steps"] > 3 * seldom.provenance["counters"]["steps"]
    for name, values in often.columns.items():
        scale = np.max(np.abs(values))
        # Integration error at this tolerance, magnified by three impacts
        np.testing.assert_allclose(seldom.columns[name], values, rtol=0, atol=1e-6 * scale, err_msg=name)


def test_extrema_do_not_depend_on_the_samples(tree_scene):
    few, many = (
        simulate(tree_scene(1e-10, {"drive.cycles": 0.1, "output.samples_per_cycle": samples}))
        for samples in (1000, 400_000)
    )
    assert few.provenance["counters"] == many.provenance["counters"]
    assert few.extrema == many.extrema


def test_events_and_extrema_agree_with_dense_samples(tree_scene):
    """1e5 samples a cycle: 4 us apart, some fifty in a contact."""
    result = simulate(tree_scene(1e-10, {"drive.cycles": 0.1, "output.samples_per_cycle": 100_000}))
    time = result.columns["time"]
    for name, extreme in result.extrema.items():
        values = result.columns[name]
        scale = max(abs(extreme["min"]), abs(extreme["max"]))
        assert abs(extreme["max"] - values.max()) <= 3e-3 * scale, name
        assert abs(values.min() - extreme["min"]) <= 3e-3 * scale, name
    events = result.events
    assert np.all(np.diff(events["start"]) >= 0)
    for corner in ("ll", "lr", "ul", "ur"):
        gap, normal = result.columns[f"corner_{corner}_gap"], result.columns[f"corner_{corner}_normal"]
        own = events["corner"] == corner
        assert np.count_nonzero(own) == np.count_nonzero((gap[1:] < 0) & (gap[:-1] >= 0))
        if own.any():
            # A trapezoid rule in some fifty intervals, (pi / 50)^2 / 12 of a half-wave
            assert events["impulse"][own].sum() == pytest.approx(np.trapezoid(normal, time), rel=5e-4)
            assert events["peak_force"][own].max() == pytest.approx(normal.max(), rel=3e-3)
    for start, end, corner, speed in zip(
        events["start"], events["end"], events["corner"], events["normal_speed"], strict=True
    ):
        gap = result.columns[f"corner_{corner}_gap"]
        inside = (time > start) & (time < end)
        assert np.all(gap[inside] < 0)
        first = np.searchsorted(time, start)
        # The sample before the touch is open, at a rate that changes by 50 m/s^2 x 4 us
        assert gap[first - 1] >= 0
        assert (gap[first - 1] - gap[first]) / (time[1]) == pytest.approx(speed, rel=0.05)


def test_impulses_turn_the_slider(tree_scene):
    """Frictionless: J5 times the change of omega is the sum of the corners' impulses times their arms."""
    changes = {"drive.cycles": 0.1, "friction.coefficient": 0.0, "initial.slider_omega": 0.05}
    scene = tree_scene(1e-11, changes)
    result = simulate(scene)
    arm = scene["mechanism"]["slider"]["length"] / 2
    rotated = 0.0
    for corner, impulse in zip(result.events["corner"], result.events["impulse"], strict=True):
        # Force to the left on the right corners; the upper ones then rotate it counter-clockwise
        rotated += impulse * arm * (1 if corner in ("ur", "ll") else -1)
    omega = result.columns["slider_omega"]
    change = scene["mechanism"]["slider"]["inertia"] * (omega[-1] - omega[0])
    assert len(result.events["start"]) >= 5
    # The corner's arm is that of the upright slider, to width / length times the angle
    angle = np.max(np.abs(result.columns["slider_angle"]))
    largest = np.max(result.events["impulse"]) * arm
    assert abs(rotated - change) < angle * largest


def test_mirrored_scene_gives_mirrored_motion(tree_scene, mirrored):
    common = {"drive.cycles": 0.1, "initial.slider_omega": 0.2, "initial.slider_angle": 1e-4}
    rotated = mirrored | {"initial.slider_omega": -0.2, "initial.slider_angle": -1e-4}
    there, back = simulate(tree_scene(1e-11, common)), simulate(tree_scene(1e-11, common | rotated))
    swap = {"ll": "lr", "lr": "ll", "ul": "ur", "ur": "ul"}
    assert [swap[k] for k in there.events["corner"]] == list(back.events["corner"])
    for name, sign in {"slider_x": -1, "slider_y": 1, "slider_angle": -1, "slider_vy": 1}.items():
        # Angles are rounded differently, which impacts magnify
        np.testing.assert_allclose(back.columns[name], sign * there.columns[name], rtol=0, atol=1e-9)


# On the wall; and within the tolerance of gaps before it, about to reverse
@pytest.mark.parametrize(
    ("offset", "vx", "corners"),
    [
        (2e-4, 0.0, set()),
        (-2e-4, 0.0, {"ll", "ul"}),
        (-(2e-4 - 1e-15), 1e-9, {"ll", "ul"}),
    ],
)
def test_a_slider_that_rests_at_the_wall_is_pressed_or_released(tree_scene, offset, vx, corners):
    changes = {"drive.cycles": 0.005, "initial.slider_offset": offset, "initial.slider_vx": vx}
    result = simulate(tree_scene(1e-9, changes))
    assert result.status == "success"
    # The drive pushes it to the left: there both corners touch at once, at the floor's speed
    assert set(result.events["corner"]) == corners
    np.testing.assert_array_equal(result.events["start"], 0.0)
    np.testing.assert_array_equal(result.events["normal_speed"], 1e-4)


def test_a_corner_that_penetrates_at_the_start_is_in_contact_at_its_own_speed_or_the_floor(tree_scene):
    def first(vx):
        changes = {"initial.slider_offset": 2.02e-4, "initial.slider_vx": vx, "drive.cycles": 0.002}
        result = simulate(tree_scene(1e-10, changes))
        assert result.events["start"][0] == 0.0
        force = result.columns["corner_lr_normal"][0]
        return result.events["normal_speed"][0], force

    elastic = read_scene(tree_scene(1e-10, {})).guide.stiffness * (2e-6) ** 1.5
    speed, force = first(0.03)
    assert speed == pytest.approx(0.03, rel=1e-12)
    assert force == pytest.approx(1.1425 * elastic, rel=1e-9)
    speed, force = first(0.0)
    assert speed == 1e-4
    assert force == pytest.approx(elastic, rel=1e-9)
    assert first(-0.03)[0] == 1e-4


def test_opposite_corners_act_each_by_itself(tree_scene):
    """A tilted slider, wedged between both walls."""
    changes = {"drive.cycles": 0.02, "initial.slider_angle": 6e-3, "initial.slider_offset": 0.0}
    result = simulate(tree_scene(1e-10, changes))
    # Tilted counter-clockwise, the upper end is further to the left
    assert result.columns["corner_ul_normal"][0] > 0
    assert result.columns["corner_lr_normal"][0] > 0
    assert result.columns["corner_ur_normal"][0] == result.columns["corner_ll_normal"][0] == 0
    assert result.columns["slider_alpha"][0] < 0


def test_a_tolerance_below_round_off_is_reported(tree_scene, capfd):
    result = simulate(tree_scene(1e-17, {"drive.cycles": 0.1}))
    assert result.status == "step-too-small"
    assert "solver.exudyn.tolerance" in result.remedy
    assert capfd.readouterr() == ("", "")


def test_steps_without_end_are_stopped_and_what_was_recorded_is_kept(tree_scene, monkeypatch):
    monkeypatch.setattr("exudyn_model.tree.solver.STEPS_PER_CYCLE_LIMIT", 2000)
    result = simulate(tree_scene(1e-10, {"drive.cycles": 0.5}))
    assert result.status == "work-limit"
    assert "solver.exudyn.tolerance" in result.remedy
    assert 0.0 < result.columns["time"][-1] < 0.2
    assert 1900 < result.provenance["counters"]["steps"] <= 2000


def test_a_step_that_is_never_short_enough_is_reported(tree_scene):
    """Deep in both walls damping is stiffer than Exudyn's shortest step, which it would repeat for ever."""
    changes = {"drive.cycles": 0.01, "initial.slider_angle": 0.5, "contact.impact_speed_floor": 1e-9}
    result = simulate(tree_scene(1e-10, changes))
    assert result.status == "step-too-small"
    assert result.provenance["counters"]["rejected"] < 1000


def test_numbers_that_overflow_are_reported(tree_scene):
    result = simulate(tree_scene(1e-10, {"drive.cycles": 0.01, "initial.slider_omega": 1e308}))
    assert result.status == "step-too-small"  # Exudyn takes no step whose error is infinite
    assert result.remedy
    assert len(result.columns["time"]) == 1
