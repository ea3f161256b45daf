"""Runs of every formulation: settings, refusals, failures."""

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


def test_a_method_that_is_named_decides_the_formulation(run):
    provenance = run({"solver.exudyn": {"method": "trapezoidal-index2"}, "drive.cycles": 0.002}).provenance
    assert provenance["formulation"] == "five bodies"


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


@pytest.mark.parametrize("tree", [None, 1e-8])
def test_ctrl_c_in_progress_arrives_unchanged(make_scene, tree):
    def stop(fraction):
        raise KeyboardInterrupt(f"at {fraction}")

    with pytest.raises(KeyboardInterrupt, match="at"):
        simulate(make_scene({"drive.cycles": 0.02}, tree=tree), progress=stop)
