"""Starts inside walls, grazing touches, refusals, and runs that are stopped."""

import numpy as np
import pytest

from reference_model import simulate


def test_start_inside_a_wall_is_a_contact_from_the_start(scene) -> None:
    changes = {"initial.slider_offset": -2.01e-4, "drive.cycles": 0.01}
    result = simulate(scene(changes))
    assert set(result.events["corner"][:2]) == {"ll", "ul"}
    assert np.all(result.events["start"][:2] == 0.0)
    assert np.all(result.events["normal_speed"][:2] == 1e-4)  # at rest: the floor


def test_start_exactly_on_a_wall_runs(scene) -> None:
    result = simulate(scene({"initial.slider_offset": -2e-4, "drive.cycles": 0.1}))
    assert result.status == "success"
    assert result.columns["slider_x"].min() > -0.5502 - 1e-5


@pytest.mark.parametrize("speed", [1e-5, 1e-3])
@pytest.mark.parametrize("clearance", [2e-4, 2e-4 * (1.0 + 1e-12)], ids=["on it", "2e-16 m off"])
def test_a_start_on_a_wall_and_into_it_is_a_contact_from_the_start(scene, clearance, speed) -> None:
    """The slider turns within the first step: its gap is open at both ends, and in the wall between.

    At 1e-5 m/s it is 1.2e-11 m deep: the wall's force is negligible there beside what the drive makes of its
    acceleration a, 4.29 m/s^2, and it is in the wall for 2 v / a = 4.66e-6 s.
    """
    changes = {"initial.slider_offset": 2e-4, "initial.slider_vx": speed, "clearance.slider": clearance}
    result = simulate(scene({**changes, "drive.cycles": 0.01}))
    assert set(result.events["corner"][:2]) == {"lr", "ur"}
    # 2e-16 m are passed in 2e-11 s, and change the speed by less than the acceleration times that.
    assert result.events["start"][:2] == pytest.approx(0.0, abs=1e-10)
    assert result.events["normal_speed"][:2] == pytest.approx(max(speed, 1e-4), rel=1e-6)
    if speed == 1e-5:  # as exact as the acceleration is given
        assert result.events["end"][:2] == pytest.approx(2.0 * speed / 4.29, rel=1e-3)


def test_grazing_touch_within_one_step_is_seen(scene) -> None:
    """A dip into the wall far shallower than a step sees at its ends is found at the extremum in between.

    The clearance is chosen so that the turning point of a first flight lies 1e-9 m inside the wall: the dip
    lasts some 1e-4 s, a step in flight a hundred times as long.
    """
    wide = {"clearance.slider": 5e-4, "initial.slider_vx": 0.02, "drive.cycles": 0.025}
    free = simulate(scene({**wide, "output.samples_per_cycle": 200000}))
    assert free.events["start"].size == 0
    x = free.columns["slider_x"] + 0.55
    turn = x.argmax()
    assert 0 < turn < x.size - 1
    grazing = {**wide, "clearance.slider": x[turn] - 1e-9, "solver.reference.tolerance": 3e-6}
    touched = simulate(scene(grazing)).events
    assert set(touched["corner"]) == {"lr", "ur"}
    # The sampled turning point is off by at most a sample's fall, (2e-6 s)^2 * 10 m/s^2 = 4e-11 m.
    assert touched["largest_depth"].max() == pytest.approx(1e-9, rel=0.05)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"drive.speed_rpm": 0.0}, "drive.speed_rpm = 0.0 must not be zero"),
        ({"contact.law": "glue"}, "contact.law = 'glue'"),
        ({"contact.law": "strip"}, "contact.law = 'strip' .* use 'foundation'"),
        ({"output.groups": ["colours"]}, "output.groups = 'colours'"),
        ({"mechanism.crank.length": 0.5}, "cannot be assembled over a whole revolution"),
        ({"mechanism.rod4.length": 0.04}, "rod 4 is too short"),
        ({"mechanism.rod4.length": 0.04, "joints.slider": "ideal"}, "rod 4 is too short"),
        ({"solver.reference.tolerance": 1e-30}, "must be at least 1e-14"),
        ({"solver.reference.tolerance": 1e-5}, "must be at most 8.3e-06 rad, 1% of the angle"),
        ({"solver.reference.method": "euler"}, "solver.reference.method = 'euler'"),
        (
            {"joints.crank_pin": "clearance", "solver.reference.formulation": "multiplier"},
            "has ideal revolutes only",
        ),
    ],
)
def test_scenes_outside_the_model_are_refused_in_one_line(scene, changes, message) -> None:
    with pytest.raises(ValueError, match=message) as caught:
        simulate(scene(changes))
    assert "\n" not in str(caught.value)


def test_too_much_work_ends_with_a_status_and_keeps_what_was_computed(scene, monkeypatch) -> None:
    monkeypatch.setattr("reference_model.simulation.STEPS_PER_CYCLE_LIMIT", 300)
    result = simulate(scene({"drive.cycles": 1.0}))
    assert result.status == "work-limit"
    assert "drive.cycles" in result.remedy
    assert 10 < result.columns["time"].size < 1000
    assert all(np.isfinite(column).all() for column in result.columns.values())
    assert result.events["start"].size > 0


def test_a_corner_pressed_deep_into_a_wall_is_stiff_and_an_implicit_method_integrates_it(
    scene, monkeypatch
) -> None:
    """A start wedged at 0.5 rad, at rest: the damping counts by the floor of the impact speed, 1e-4 m/s."""
    monkeypatch.setattr("reference_model.simulation.STEPS_PER_CYCLE_LIMIT", 50_000)
    wedged = {"initial.slider_offset": 0.0, "initial.slider_angle": 0.5, "drive.cycles": 0.02}
    result = simulate(scene(wedged))
    assert result.status == "work-limit"
    assert "solver.reference.method = 'LSODA'" in result.remedy
    implicit = simulate(scene({**wedged, "solver.reference.method": "LSODA"}))
    assert implicit.status == "success"
    assert implicit.provenance["counters"]["steps"] < 1000
    # It creeps out of the wedge: both corners are still inside, and less deep.
    angle = implicit.columns["slider_angle"]
    assert np.all(np.diff(angle) < 0.0)
    assert angle[-1] > 0.1
