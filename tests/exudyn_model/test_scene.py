"""What is taken from a scene: settings left open, one-line refusals."""

import pytest

from exudyn_model import simulate
from exudyn_model.parameters import read_scene

PIN = {"joints.crank_pin": "clearance"}


FORMULATION, METHOD, GROUPS = "solver.exudyn.formulation", "solver.exudyn.method", "output.groups"
TREE = {FORMULATION: "tree", METHOD: "dopri5"}
JOINTS_BY = "use 'trapezoidal-index2' (formulation 'full')"
REFUSED = [
    ({"contact.law": "strip"}, "contact.law = 'strip' is not simulated by the Exudyn model yet; "
     "use 'hertz-corners' or 'paper-switching' or 'foundation' or 'adams-impact'"),
    ({GROUPS: ["corners", "strain"]}, "output.groups = 'strain' is not simulated by the Exudyn model yet; "
     "use 'accelerations' or 'corners' or 'joints' or 'energy'"),
    ({METHOD: "dopri5"}, "solver.exudyn.method = 'dopri5' does not integrate "
     "solver.exudyn.formulation = 'full'; use 'generalized-alpha'"),
    ({FORMULATION: "tree"}, "solver.exudyn.method = 'generalized-alpha' does not integrate "
     "solver.exudyn.formulation = 'tree'; use 'dopri5'"),
    ({FORMULATION: "minimal"},
     "solver.exudyn.formulation = 'minimal' must be one of 'auto', 'full' and 'tree'"),
    ({FORMULATION: "tree", METHOD: "auto", "joints.slider": "ideal"},
     "joints.slider = 'ideal' leaves solver.exudyn.formulation = 'tree' nothing free; use 'full'"),
    ({GROUPS: ["joints"]},
     f"output.groups = 'joints' is not given by solver.exudyn.method = 'generalized-alpha'; {JOINTS_BY}"),
    (TREE | {GROUPS: ["joints"]},
     f"output.groups = 'joints' is not given by solver.exudyn.method = 'dopri5'; {JOINTS_BY}"),
    ({"drive.speed_rpm": 0.0}, "drive.speed_rpm = 0.0 must not be zero"),
    ({"drive.cycles": 0.0}, "drive.cycles = 0.0 must be positive"),
    ({"drive.cycles": 4e-4}, "drive.cycles = 0.0004 must last at least one sample: 1000 samples a cycle"),
    ({"solver.exudyn.step": -1e-6}, "solver.exudyn.step = -1e-06 must be positive"),
    ({"contact.impact_speed_floor": 0.0}, "contact.impact_speed_floor = 0.0 must be positive"),
    ({"contact.damping_depth": 0.0}, "contact.damping_depth = 0.0 must be positive"),
    ({"load.depth": 0.0}, "load.depth = 0.0 must be positive"),
    ({"load.exponent": 0.0}, "load.exponent = 0.0 must be positive"),
    ({"load.force": 5.0, "load.table": [[0.0, 0.0], [1e-3, 9.0]]},
     "load.table takes the place of load.force = 5.0: one of both must be left out"),
    ({"load.table": [[0.0, 0.0], [1e-3, 9.0], [1e-3, 8.0]]},
     "load.table = [[0.0, 0.0], [0.001, 9.0], [0.001, 8.0]] must begin with [0, 0] and have rising depths"),
    ({"load.table": [[0.0, 1.0]]}, "load.table = [[0.0, 1.0]] must begin with [0, 0] and have rising depths"),
    ({"friction.transition_speed": 1e-4},
     "friction.transition_speed = 0.0001 must be greater than friction.static_speed = 0.0001"),
]  # fmt: skip


@pytest.mark.parametrize(("changes", "message"), REFUSED)
def test_unsupported_scenes_are_refused_in_one_line(make_scene, changes, message):
    with pytest.raises(ValueError, match=r"must|not simulated|use '") as caught:
        simulate(make_scene(changes))
    assert str(caught.value) == message


# What is left open is the smallest formulation that gives what is asked for, with its usual method
CHOICES = [
    ({}, "rod 4 and slider tree", "dopri5", 1e-10),
    (PIN, "rocker, rods and slider tree", "dopri5", 1e-10),
    ({"joints.slider": "ideal"}, "five bodies", "generalized-alpha", 1e-7),
    ({GROUPS: ["joints"]}, "five bodies", "trapezoidal-index2", 1e-7),
    ({GROUPS: ["energy"]}, "five bodies", "trapezoidal-index2", 1e-7),
]


@pytest.mark.parametrize(("changes", "formulation", "method", "tolerance"), CHOICES)
@pytest.mark.parametrize("solver", [{}, {"formulation": "auto", "method": "auto"}])
def test_settings_left_open(run, changes, formulation, method, tolerance, solver):
    provenance = run(changes, {"solver.exudyn": solver, "drive.cycles": 0.002}).provenance
    assert provenance["formulation"] == formulation
    assert provenance["integrator"] == method
    assert provenance["settings"]["tolerance"] == tolerance


def test_a_method_chosen_decides_the_formulation(make_scene):
    scene = make_scene({"solver.exudyn": {"method": "trapezoidal-index2"}})
    assert read_scene(scene).integration.formulation == "full"
