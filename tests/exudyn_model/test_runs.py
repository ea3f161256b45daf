"""Runs of every formulation: settings, refusals, failures, pulses of the contacts."""

import json

import numpy as np
import pytest

from exudyn_model import simulate

STEP = "solver.exudyn.step"
FORMULATION, METHOD, GROUPS = "solver.exudyn.formulation", "solver.exudyn.method", "output.groups"
TREE = {FORMULATION: "tree", METHOD: "dopri5"}
PIN = {"joints.crank_pin": "clearance"}
REFUSED = [
    ({METHOD: "dopri5"}, "solver.exudyn.method = 'dopri5' does not integrate "
     "solver.exudyn.formulation = 'full'; use 'generalized-alpha'"),
    ({FORMULATION: "tree"}, "solver.exudyn.method = 'generalized-alpha' does not integrate "
     "solver.exudyn.formulation = 'tree'; use 'dopri5'"),
    ({FORMULATION: "tree", METHOD: "auto", "joints.slider": "ideal"},
     "joints.slider = 'ideal' leaves solver.exudyn.formulation = 'tree' nothing free; use 'full'"),
    (TREE | {GROUPS: ["joints"]}, "output.groups = 'joints' is not given by solver.exudyn.method = 'dopri5'; "
     "use 'trapezoidal-index2' (formulation 'full')"),
]  # fmt: skip


@pytest.mark.parametrize(("changes", "message"), REFUSED)
def test_unsupported_scenes_are_refused_in_one_line(make_scene, changes, message):
    with pytest.raises(ValueError, match=r"use '") as caught:
        simulate(make_scene(changes))
    assert str(caught.value) == message


# The smallest formulation that gives the requested channels, with its usual method; a method decides, too
CHOICES = [
    ({}, {}, "rod 4 and slider tree", "dopri5", 1e-10),
    ({}, PIN, "rocker, rods and slider tree", "dopri5", 1e-10),
    ({}, {"joints.slider": "ideal"}, "five bodies", "generalized-alpha", 1e-7),
    ({"method": "auto"}, {GROUPS: ["energy"]}, "five bodies", "trapezoidal-index2", 1e-7),
    ({"method": "trapezoidal-index2"}, {}, "five bodies", "trapezoidal-index2", 1e-7),
]


@pytest.mark.parametrize(("solver", "changes", "formulation", "method", "tolerance"), CHOICES)
def test_settings_left_open(run, solver, changes, formulation, method, tolerance):
    provenance = run(changes, {"solver.exudyn": solver, "drive.cycles": 0.002}).provenance
    assert provenance == json.loads(json.dumps(provenance))
    assert provenance["formulation"] == formulation
    assert provenance["integrator"] == method
    assert provenance["settings"]["tolerance"] == tolerance


# A step as long as a contact, walls a million times as stiff; numbers that overflow; below round-off;
# infinite errors, of which Exudyn takes no step; deep in both walls damping is stiffer than its shortest step
STIFF = {"drive.cycles": 0.2, STEP: 2e-5, "contact.youngs_modulus": 2.1e17}
DEEP = {"initial.slider_angle": 0.5, "contact.impact_speed_floor": 1e-9}
# A jump of the workpiece's force, which no step of 1e-12 s crosses at this tolerance
JUMP = {"load.table": [[0.0, 0.0], [1e-18, 300.0]], "load.surface": -0.0318, "drive.cycles": 0.02}
FAILURES = [
    (STIFF, None, "newton-failed", STEP),
    ({"initial.slider_vx": 1e200}, None, "non-finite", ""),
    ({"drive.cycles": 0.1}, 1e-17, "step-too-small", "solver.exudyn.tolerance"),
    (PIN | {"joints.slider": "ideal"}, 1e-17, "step-too-small", "solver.exudyn.tolerance"),
    ({"initial.slider_omega": 1e308}, 1e-10, "step-too-small", ""),
    (PIN | {"initial.slider_omega": 1e308}, 1e-10, "non-finite", ""),
    (DEEP, 1e-10, "step-too-small", ""),
    (JUMP | {"mechanism.crank_angle_deg": 285.0}, 1e-14, "step-too-small", "load.table jumps"),
]


@pytest.mark.parametrize(("changes", "tree", "status", "remedy"), FAILURES)
def test_failures_keep_what_was_computed_and_say_what_to_try(
    make_scene, capfd, changes, tree, status, remedy
):
    result = simulate(make_scene({"drive.cycles": 0.01}, changes, tree=tree))
    assert result.status == result.provenance["status"] == status
    assert result.remedy
    assert remedy in result.remedy
    counts = {len(values) for values in result.columns.values()}
    assert min(counts) == max(counts) >= (6 if changes is STIFF else 1)
    work = sum(result.provenance["counters"].get(name, 0) for name in ("steps", "rejected"))
    assert work < 5000 or tree == 1e-17
    assert capfd.readouterr() == ("", "")


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


@pytest.mark.parametrize("tree", [None, 1e-8])
def test_ctrl_c_in_progress_arrives_unchanged(make_scene, tree):
    def stop(fraction):
        raise KeyboardInterrupt(f"at {fraction}")

    with pytest.raises(KeyboardInterrupt, match="at"):
        simulate(make_scene({"drive.cycles": 0.02}, tree=tree), progress=stop)


# Each formulation, each law; the impact of a whole side is twenty times as short
PULSES = {
    "full": ({}, None),
    "tree": ({}, 1e-10),
    "loose": ({}, 1e-6),
    "foundation": ({"contact.law": "foundation", STEP: 1e-7}, None),
    "foundation-tree": ({"contact.law": "foundation"}, 1e-10),
    "pin": (PIN | {"clearance.crank_pin": 1e-4}, 1e-8),
    "pressed": ({"initial.slider_offset": 2.05e-4}, None),
    "pressed-tree": ({"initial.slider_offset": 2.05e-4}, 1e-9),
}


@pytest.mark.parametrize("name", PULSES)
def test_every_contact_of_a_corner_has_a_pulse_whose_peak_and_impulse_are_those_of_its_row(run, name):
    changes, tree = PULSES[name]
    result = run(changes, {"drive.cycles": 0.15}, tree=tree)
    assert result.status == "success"
    rows = np.flatnonzero(result.events["corner"] != "pin")
    assert len(rows) >= 5
    assert np.unique(result.pulses["row"]).tolist() == rows.tolist()
    for row in rows:
        own = result.pulses["row"] == row
        time, force = (result.pulses[name][own] for name in ("time", "force"))
        start, end, impulse, peak = (
            result.events[name][row] for name in ("start", "end", "impulse", "peak_force")
        )
        assert np.all(np.diff(time) > 0.0)
        assert np.all(force >= 0.0)
        # The longest step in a contact, of the loose tree
        reach = 0.15 * (end - start)
        assert start <= time[0] < start + reach
        assert end - reach < time[-1] <= end
        assert time.size >= 10
        # Of a tree the row has it at quarters of steps, the pulse after 20 steps at their ends: it lies
        # there in contacts of 40 steps and more, of which a half sine is 1 - cos(pi / 80) = 8e-4 below
        assert (1.0 - 1e-3) * peak <= force.max() <= peak
        # Of a half sine the trapezoids of ten samples miss (pi / 10)^2 / 12 = 0.8 %, unequal ones more
        first, last = (force[k] if edge == time[k] else 0.0 for k, edge in ((0, start), (-1, end)))
        assert np.trapezoid([first, *force, last], [start, *time, end]) == pytest.approx(impulse, rel=0.02)
    if "pressed" in name:
        # 5 um inside the right wall: the largest force of the first contacts is at once
        assert result.pulses["time"][0] == 0.0
        assert result.pulses["force"][0] == result.events["peak_force"][0]
