"""Five bodies with clearance at the crank pin: energy, limits, statics, channels."""

import math

import numpy as np
import pytest

from exudyn_model import simulate

CRANK_PIN = {"joints.crank_pin": "clearance", "joints.slider": "ideal"}
BOTH = {"joints.crank_pin": "clearance"}


def test_residual_of_the_energy_is_of_second_order(make_scene):
    """The first 9 ms with two impacts of up to 1.6 kN; the second one's friction reverses and holds."""
    changes = CRANK_PIN | {
        "drive.cycles": 0.0225,
        "output.groups": ["energy"],
        "output.samples_per_cycle": 10_000,
    }
    steps = [2e-6, 1e-6, 5e-7]
    runs = [
        simulate(make_scene(changes | {"solver.exudyn.step": h, "solver.exudyn.method": "auto"})).columns
        for h in steps
    ]
    errors = [np.max(np.abs(columns["energy_residual"])) for columns in runs]
    # Where friction reaches its pieces falls somewhere into a step; 2.0 measured
    assert np.polyfit(np.log(steps), np.log(errors), 1)[0] == pytest.approx(2.0, abs=0.3), errors
    for name in ("damping", "friction"):
        lost = runs[-1][f"energy_{name}"]
        assert np.all(np.diff(lost) >= 0)
        assert lost[-1] > 100 * errors[-1]
    assert np.max(runs[-1]["energy_contact"]) > 1e-3


def test_slider_deviates_as_far_as_the_pin_s_play_allows(make_scene, ideal_y):
    scene = make_scene(CRANK_PIN | {"drive.cycles": 1.0, "solver.exudyn.step": 4e-6})
    angles = np.radians(111.36 + np.linspace(0, 360, 721))
    shifts = 2e-4 * np.exp(1j * np.linspace(0, 2 * np.pi, 181))
    rigid = np.array([np.max(np.abs(ideal_y(scene, angles, s) - ideal_y(scene, angles, 0))) for s in shifts])
    # Of the identified geometry: at most 5.67e-4 m
    assert np.max(rigid) == pytest.approx(5.67e-4, abs=1e-6)
    result = simulate(scene)
    assert result.status == "success"
    time = result.columns["time"]
    ideal = ideal_y(scene, np.radians(111.36) + 5 * np.pi * time, 0)
    error = np.max(np.abs(result.columns["slider_y"] - ideal))
    deepest = np.max(result.events["largest_depth"])
    assert error <= np.max(rigid) * (2e-4 + deepest) / 2e-4
    assert error > 0.8 * np.max(rigid)
    assert set(result.events["corner"]) == {"pin"}


def test_no_clearance_is_the_ideal_pin(make_scene, ideal_y):
    """Down to 1 um, where the pin's elastic play is of the same size."""
    scene = make_scene(CRANK_PIN)
    errors = []
    for clearance in (1e-4, 1e-5, 1e-6):
        changes = CRANK_PIN | {"clearance.crank_pin": clearance, "drive.cycles": 0.1}
        result = simulate(make_scene(changes))
        ideal = ideal_y(scene, np.radians(111.36) + 5 * np.pi * result.columns["time"], 0)
        errors.append(np.max(np.abs(result.columns["slider_y"] - ideal)))
        assert errors[-1] < 2.84 * (clearance + np.max(result.events["largest_depth"]))
    assert errors[0] > 5 * errors[1] > 10 * errors[2]


def test_pin_settles_into_static_equilibrium(make_scene):
    """At creep speed and with the strongest damping: joint A bears what it bears without clearance."""
    changes = {
        "joints.slider": "ideal",
        "drive.speed_rpm": 0.1,
        "drive.cycles": 5e-5,
        "mechanism.crank_angle_deg": 60.0,
        "contact.restitution": 0.0,
        "friction.coefficient": 0.0,
        "clearance.crank_pin": 1e-6,
        "output.groups": ["joints"],
        "solver.exudyn.method": "auto",
        "solver.exudyn.step": 1e-6,
        "output.samples_per_cycle": 200_000,
    }
    with_clearance = simulate(make_scene(changes | {"joints.crank_pin": "clearance"}))
    ideal = simulate(make_scene(changes)).columns
    for name in ("reaction_A_x", "reaction_A_y", "reaction_H_y", "crank_torque", "guide_force"):
        scale = 1.0 if name != "crank_torque" else 0.045
        # Of forces of some 10 N; the bounces of some 1e-8 m have not quite died away
        assert with_clearance.columns[name][-1] == pytest.approx(ideal[name][-1], abs=1e-2 * scale), name
    assert with_clearance.events["end"][-1] == pytest.approx(0.03)
    force = np.hypot(ideal["reaction_A_x"][-1], ideal["reaction_A_y"][-1])
    assert force > 1


def test_channels_and_events(make_scene):
    short = {
        "drive.cycles": 0.05,
        "output.groups": ["accelerations", "corners", "joints", "energy"],
        "solver.exudyn.method": "auto",
    }
    pin = simulate(make_scene(CRANK_PIN | short))
    assert not [name for name in pin.columns if name.startswith("corner")]
    assert {"reaction_A_x", "reaction_A_y", "guide_force", "guide_moment"} < set(pin.columns)
    assert set(pin.columns) - {"time"} == set(pin.extrema)
    both = simulate(make_scene(BOTH | short))
    assert {"corner_ll_gap", "reaction_A_x", "energy_residual"} < set(both.columns)
    assert "guide_force" not in both.columns
    assert {"pin"} < set(both.events["corner"]) <= {"pin", "ll", "lr", "ul", "ur"}
    for result in (pin, both):
        force = np.hypot(result.columns["reaction_A_x"], result.columns["reaction_A_y"])
        time, events = result.columns["time"], result.events
        closed = np.zeros(len(time), bool)
        for start, end in zip(events["start"], events["end"], strict=True):
            if events["corner"][events["start"] == start][0] == "pin":
                closed |= (time > start) & (time < end)
        # Force exactly while the pin's journal is in contact
        assert np.array_equal(force > 0, closed)
        # of normal force N and friction up to 0.15 N
        peak = np.max(events["peak_force"][events["corner"] == "pin"])
        assert peak <= np.hypot(
            max(
                abs(v) for v in (result.extrema["reaction_A_x"]["min"], result.extrema["reaction_A_x"]["max"])
            ),
            max(
                abs(v) for v in (result.extrema["reaction_A_y"]["min"], result.extrema["reaction_A_y"]["max"])
            ),
        )
        assert np.max(force) <= peak * math.hypot(1, 0.15)


def test_mirrored_scene_gives_mirrored_motion(make_scene, mirrored):
    """Both clearances; friction and its arms change their side."""
    common = BOTH | {"drive.cycles": 0.03, "solver.exudyn.step": 1e-6}
    there, back = simulate(make_scene(common)), simulate(make_scene(common | mirrored))
    assert len(there.events["start"]) == len(back.events["start"]) >= 2
    for name, sign in {"slider_x": -1, "slider_y": 1, "slider_angle": -1, "slider_vy": 1}.items():
        scale = np.max(np.abs(there.columns[name]))
        # Rounded differently; impacts of kN magnify what Newton's iteration leaves
        np.testing.assert_allclose(back.columns[name], sign * there.columns[name], rtol=0, atol=1e-6 * scale)
