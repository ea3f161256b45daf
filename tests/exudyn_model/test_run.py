"""What a run leaves behind: extrema, provenance, failures; and nothing on disk or screen."""

import json

import numpy as np
import pytest

from exudyn_model import simulate
from exudyn_model.tree import recording

STEP = "solver.exudyn.step"
SHORT = {"drive.cycles": 0.1, STEP: 4e-6}


@pytest.fixture(params=[None, 1e-8], ids=["full", "tree"])
def either(request, make_scene):
    """A short scene of either formulation."""
    return make_scene({"drive.cycles": 0.1} if request.param else SHORT, tree=request.param)


def test_step_divides_the_sample_interval_and_both_are_reported(run):
    settings = run({"drive.cycles": 0.002, STEP: 3e-6}).provenance["settings"]
    assert settings["step"] == 3e-6
    assert settings["steps_per_sample"] == 134  # 4e-4 s / 3e-6 s = 133.3
    assert settings["step_used"] == pytest.approx(4e-4 / 134, rel=1e-14)


def test_extrema_agree_with_a_sample_at_every_step(run):
    result = run(SHORT, {"output.samples_per_cycle": 100_000})
    time = result.columns["time"]
    for name, extreme in result.extrema.items():
        values = result.columns[name]
        assert (extreme["min"], extreme["max"]) == (values.min(), values.max())
        assert extreme["time_of_min"] == pytest.approx(time[np.argmin(values)], rel=1e-12)
        assert extreme["time_of_max"] == pytest.approx(time[np.argmax(values)], rel=1e-12)


def test_provenance_is_json(run):
    result = run(SHORT)
    provenance = json.loads(json.dumps(result.provenance))
    assert provenance["model"] == "exudyn"
    assert provenance["status"] == result.status == "success"
    assert provenance["versions"]["exudyn"] == "1.13.6"
    # The work, of 10,000 steps as long as in a contact: few of them, two or three iterations each, and a
    # Jacobian that serves several steps
    counters = provenance["counters"]
    assert counters["steps"] < 0.15 * 10_000
    assert counters["newton_iterations"] < 3.5 * counters["steps"]
    assert counters["jacobians"] < 0.5 * counters["steps"]


def test_a_failing_solver_keeps_what_was_computed_and_says_what_to_try(
    make_scene, tmp_path, monkeypatch, capfd
):
    """The step is as long as a contact, and the walls are a million times as stiff."""
    monkeypatch.chdir(tmp_path)
    result = simulate(make_scene({"drive.cycles": 0.2, STEP: 2e-5, "contact.youngs_modulus": 2.1e17}))
    assert result.status == "newton-failed"
    assert STEP in result.remedy
    count = len(result.columns["time"])
    assert 5 < count < 201
    assert all(np.all(np.isfinite(values)) and len(values) == count for values in result.columns.values())
    assert result.provenance["counters"]["steps"] < 4000
    assert capfd.readouterr() == ("", "")
    assert not list(tmp_path.iterdir())


def test_a_slider_that_starts_deep_in_its_wall_is_thrown_from_wall_to_wall(run):
    """By 9 MN at first, where Newton's method needs steps of less than 1/64 of the one asked for."""
    result = run({"drive.cycles": 0.01, "initial.slider_offset": 0.01})
    assert result.status == "success", result.remedy
    events = result.events
    assert result.provenance["counters"]["rejected"] > 100
    # A start 10 mm off, less the clearance; x near 0.55 m is rounded to 1e-16 m
    assert events["largest_depth"][0] == pytest.approx(9.8e-3, rel=1e-12)
    # 9.8 mm at more than 30 m/s
    assert events["end"][:2].max() < 9.8e-3 / 30.0
    # Every impact loses energy: of each quarter of the contacts the fastest one is slower than that before
    fastest = [speeds.max() for speeds in np.array_split(events["normal_speed"][2:], 4)]
    assert np.all(np.diff(fastest) < 0.0)


def test_steps_far_longer_than_a_contact_are_no_success(run):
    """A linear wall and steps a hundred times as long: another Jacobian would spin rod 4 a thousand times."""
    step, way = 1e-3, 5e-5  # s, and m in a step
    result = run(
        {
            "contact.exponent": 1.0, "contact.restitution": 1.0, "contact.youngs_modulus": 1e11,
            "friction.coefficient": 0.0, "environment.gravity": 0.0, "drive.speed_rpm": 1e-6,
            "drive.cycles": 48 * step / 6e7, "output.samples_per_cycle": round(6e7 / step),
            "initial.slider_vx": -way / step, "initial.slider_offset": 3.375 * way - 2e-4,
            STEP: step * (1 + 1e-6),
        }
    )  # fmt: skip
    assert result.provenance["counters"]["steps"] == 48
    assert np.ptp(result.columns["slider_y"]) < 0.01
    assert result.status == "invariant-violated"
    assert STEP in result.remedy


def test_numbers_that_overflow_are_distinguished_from_a_step_that_is_too_long(run):
    result = run({"drive.cycles": 0.01, "initial.slider_vx": 1e200})
    assert result.status == "non-finite"
    assert result.remedy


@pytest.mark.parametrize("where", ["progress", "force"])
def test_ctrl_c_arrives_unchanged(either, monkeypatch, where):
    """From the caller's progress, and from inside the contact force."""

    def stop(*_):
        raise KeyboardInterrupt("enough")

    monkeypatch.setattr("exudyn_model.run.PROGRESS_INTERVAL", 0.0)
    if where == "force":
        for place in ("five_bodies.parts.SliderPart._user_function", "tree.building._user_function"):
            monkeypatch.setattr(f"exudyn_model.{place}", lambda *_: stop)
    with pytest.raises(KeyboardInterrupt, match="enough" if where == "progress" else None):
        simulate(either, progress=stop if where == "progress" else None)


@pytest.mark.parametrize("fewer", [0, 1, 100])
def test_a_tree_s_result_does_not_depend_on_the_room_of_its_steps(make_scene, monkeypatch, fewer):
    """Not if the last step just fills it, which one run in 2048 does."""
    scene = make_scene({"drive.cycles": 0.1}, tree=1e-8)
    whole = simulate(scene)
    monkeypatch.setattr(recording, "_ROOM", whole.provenance["counters"]["steps"] - fewer)
    parted = simulate(scene)
    for name, values in whole.columns.items():
        np.testing.assert_array_equal(parted.columns[name], values, err_msg=name)
    for name in ("corner", "start", "end", "peak_force", "largest_depth"):
        np.testing.assert_array_equal(parted.events[name], whole.events[name], err_msg=name)
    # An impulse is a sum, rounded once more where it is taken in two parts.
    np.testing.assert_allclose(parted.events["impulse"], whole.events["impulse"], rtol=1e-14)
    assert parted.extrema == whole.extrema
