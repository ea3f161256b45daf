"""What a run leaves behind: samples, events, extrema, provenance, failures; and nothing on disk or screen."""

import json

import numpy as np
import pytest

from exudyn_model import simulate
from exudyn_model.tree import recording

SHORT = {"drive.cycles": 0.1, "solver.exudyn.step": 4e-6}


TREE = {
    "drive.cycles": 0.1,
    "solver.exudyn.formulation": "tree",
    "solver.exudyn.method": "dopri5",
    "solver.exudyn.step": 1e-4,
    "solver.exudyn.tolerance": 1e-8,
}


@pytest.fixture(scope="module", params=[SHORT, TREE], ids=["full", "tree"])
def settings(request):
    return request.param


@pytest.fixture(scope="module")
def either(make_scene, settings):
    """A short run of either formulation."""
    return simulate(make_scene(settings))


@pytest.fixture(scope="module")
def result(make_scene):
    return simulate(make_scene(SHORT))


def test_channels_and_sample_times(either, settings, make_scene):
    corners = [f"corner_{c}_{p}" for c in ("ll", "lr", "ul", "ur") for p in ("gap", "normal", "friction")]
    state = ["slider_x", "slider_y", "slider_angle", "slider_vx", "slider_vy", "slider_omega"]
    assert list(either.columns) == ["time", *state, "slider_ax", "slider_ay", "slider_alpha", *corners]
    assert np.array_equal(either.columns["time"], np.arange(101) * (0.4 / 1000))
    assert {values.shape for values in either.columns.values()} == {(101,)}
    assert {values.dtype for values in either.columns.values()} == {np.dtype(np.float64)}
    assert set(either.extrema) == set(either.columns) - {"time"}
    bare = simulate(make_scene({**settings, "drive.cycles": 0.01, "output.groups": []}))
    assert list(bare.columns) == ["time", *state]


def test_step_divides_the_sample_interval_and_both_are_reported(make_scene):
    scene = make_scene({"drive.cycles": 0.002, "solver.exudyn.step": 3e-6})
    settings = simulate(scene).provenance["settings"]
    assert settings["step"] == 3e-6
    assert settings["steps_per_sample"] == 134  # 4e-4 s / 3e-6 s = 133.3
    assert settings["step_used"] == pytest.approx(4e-4 / 134, rel=1e-14)


def test_extrema_and_events_agree_with_a_sample_at_every_step(make_scene):
    scene = make_scene({**SHORT, "output.samples_per_cycle": 100_000})
    result = simulate(scene)
    time = result.columns["time"]
    for name, extreme in result.extrema.items():
        values = result.columns[name]
        assert (extreme["min"], extreme["max"]) == (values.min(), values.max())
        assert extreme["time_of_min"] == pytest.approx(time[np.argmin(values)], rel=1e-12)
        assert extreme["time_of_max"] == pytest.approx(time[np.argmax(values)], rel=1e-12)
    events = result.events
    assert np.all(np.diff(events["start"]) >= 0)
    for corner in ("ll", "lr", "ul", "ur"):
        normal, gap = result.columns[f"corner_{corner}_normal"], result.columns[f"corner_{corner}_gap"]
        own = events["corner"] == corner
        assert np.count_nonzero(own) == np.count_nonzero((gap[1:] < 0) & (gap[:-1] >= 0))
        if own.any():
            assert events["peak_force"][own].max() == normal.max()
            assert events["largest_depth"][own].max() == -gap.min()
            # The first and last part-step differ: forces near 0 there, some 1e-4 of an impulse
            assert events["impulse"][own].sum() == pytest.approx(np.trapezoid(normal, time), rel=1e-3)


def test_samples_do_not_depend_on_how_many_are_taken(result, make_scene):
    often = simulate(make_scene({**SHORT, "output.samples_per_cycle": 4000}))
    for name, values in result.columns.items():
        if name != "time":
            # Steps in flight end at samples: the order's error of the longest, far below that of the contacts
            np.testing.assert_allclose(often.columns[name][::4], values, atol=1e-3 * np.ptp(values))


def test_equal_scenes_give_equal_results_with_and_without_progress(either, settings, make_scene):
    shares = []
    again = simulate(make_scene(settings), progress=shares.append)
    for name, values in either.columns.items():
        assert np.array_equal(again.columns[name], values), name
    assert again.provenance["counters"] == either.provenance["counters"]
    assert shares[-1] == 1.0
    assert shares == sorted(shares)
    assert len(shares) < 100


def test_provenance_is_json(result):
    provenance = json.loads(json.dumps(result.provenance))
    assert provenance["model"] == "exudyn"
    counters = provenance["counters"]
    # The work, of 10,000 steps as long as in a contact: few of them, two or three iterations each, and a
    # Jacobian that serves several steps
    assert counters["steps"] < 0.15 * 10_000
    assert counters["newton_iterations"] < 3.5 * counters["steps"]
    assert counters["jacobians"] < 0.5 * counters["steps"]
    assert provenance["status"] == result.status == "success"
    assert provenance["versions"]["exudyn"] == "1.13.6"


def test_a_failing_solver_keeps_what_was_computed_and_says_what_to_try(
    make_scene, tmp_path, monkeypatch, capfd
):
    monkeypatch.chdir(tmp_path)
    # The step is as long as a contact, and the walls are a million times as stiff
    result = simulate(
        make_scene({"drive.cycles": 0.2, "solver.exudyn.step": 2e-5, "contact.youngs_modulus": 2.1e17})
    )
    assert result.status == "newton-failed"
    assert "solver.exudyn.step" in result.remedy
    count = len(result.columns["time"])
    assert 5 < count < 201
    assert all(np.all(np.isfinite(values)) and len(values) == count for values in result.columns.values())
    assert result.provenance["counters"]["steps"] < 4000
    assert capfd.readouterr() == ("", "")
    assert not list(tmp_path.iterdir())


def test_a_slider_that_starts_deep_in_its_wall_is_thrown_from_wall_to_wall(make_scene):
    """By 9 MN at first, where Newton's method needs steps of less than 1/64 of the one asked for."""
    changes = {"drive.cycles": 0.01, "solver.exudyn.formulation": "full", "initial.slider_offset": 0.01}
    result = simulate(make_scene(changes))
    assert result.status == "success", result.remedy
    events = result.events
    assert result.provenance["counters"]["rejected"] > 100
    # A start 10 mm off, less the clearance; x near 0.55 m is rounded to 1e-16 m
    assert events["largest_depth"][0] == pytest.approx(9.8e-3, rel=1e-12)
    # 9.8 mm at more than 30 m/s
    assert events["end"][:2].max() < 9.8e-3 / 30.0
    # Every impact loses energy: of each quarter of the contacts the fastest one is slower than that before
    quarters = np.array_split(events["normal_speed"][2:], 4)
    assert np.all(np.diff([speeds.max() for speeds in quarters]) < 0.0)


def test_steps_far_longer_than_a_contact_are_no_success(make_scene):
    """A linear wall and steps a hundred times as long: another Jacobian would spin rod 4 a thousand times."""
    step, way = 1e-3, 5e-5  # s, and m in a step
    result = simulate(
        make_scene(
            {
                "contact.exponent": 1.0,
                "contact.restitution": 1.0,
                "contact.youngs_modulus": 1e11,
                "friction.coefficient": 0.0,
                "environment.gravity": 0.0,
                "drive.speed_rpm": 1e-6,
                "drive.cycles": 48 * step / 6e7,
                "output.samples_per_cycle": round(6e7 / step),
                "output.groups": [],
                "initial.slider_vx": -way / step,
                "initial.slider_offset": 3.375 * way - 2e-4,
                "solver.exudyn.formulation": "full",
                "solver.exudyn.method": "generalized-alpha",
                "solver.exudyn.step": step * (1 + 1e-6),
            }
        )
    )
    assert result.provenance["counters"]["steps"] == 48
    assert np.ptp(result.columns["slider_y"]) < 0.01
    assert result.status == "invariant-violated"
    assert "solver.exudyn.step" in result.remedy


def test_numbers_that_overflow_are_distinguished_from_a_step_that_is_too_long(make_scene):
    result = simulate(make_scene({"drive.cycles": 0.01, "initial.slider_vx": 1e200}))
    assert result.status == "non-finite"
    assert result.remedy


def test_a_run_writes_nothing(make_scene, settings, tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    simulate(make_scene(settings | {"drive.cycles": 0.01}))
    assert capfd.readouterr() == ("", "")
    assert not list(tmp_path.iterdir())


def test_an_exception_of_the_caller_s_progress_arrives_unchanged(make_scene, settings, monkeypatch):
    monkeypatch.setattr("exudyn_model.run.PROGRESS_INTERVAL", 0.0)

    def stop(_):
        raise KeyboardInterrupt("enough")

    with pytest.raises(KeyboardInterrupt, match="enough"):
        simulate(make_scene(settings), progress=stop)


def test_ctrl_c_inside_the_contact_force_arrives_as_such(make_scene, settings, monkeypatch):
    def interrupted(*_):
        def force(*_):
            raise KeyboardInterrupt

        return force

    monkeypatch.setattr("exudyn_model.five_bodies.parts.SliderPart._user_function", interrupted)
    monkeypatch.setattr("exudyn_model.tree.building._user_function", interrupted)
    with pytest.raises(KeyboardInterrupt):
        simulate(make_scene(settings))


@pytest.mark.parametrize("fewer", [0, 1, 100])
def test_a_tree_s_result_does_not_depend_on_the_room_of_its_steps(make_scene, monkeypatch, fewer):
    """Not if the last step just fills it, which one run in 2048 does."""
    whole = simulate(make_scene(TREE))
    monkeypatch.setattr(recording, "_ROOM", whole.provenance["counters"]["steps"] - fewer)
    parted = simulate(make_scene(TREE))
    for name, values in whole.columns.items():
        np.testing.assert_array_equal(parted.columns[name], values, err_msg=name)
    for name in ("corner", "start", "end", "peak_force", "largest_depth"):
        np.testing.assert_array_equal(parted.events[name], whole.events[name], err_msg=name)
    # An impulse is a sum, rounded once more where it is taken in two parts.
    np.testing.assert_allclose(parted.events["impulse"], whole.events["impulse"], rtol=1e-14)
    assert parted.extrema == whole.extrema
