"""Runs of every formulation: settings, refusals, failures and their remedies, order and steps."""

import numpy as np
import pytest

from exudyn_model import simulate

STEP, TOLERANCE = "solver.exudyn.step", "solver.exudyn.tolerance"
FORMULATION, METHOD, GROUPS = "solver.exudyn.formulation", "solver.exudyn.method", "output.groups"
TREE = {FORMULATION: "tree", METHOD: "dopri5"}
PIN = {"joints.crank_pin": "clearance"}
REFUSALS = [
    ({METHOD: "dopri5"}, "solver.exudyn.method = 'dopri5' does not integrate "
     "solver.exudyn.formulation = 'full'; use 'generalized-alpha'"),
    ({FORMULATION: "tree"}, "solver.exudyn.method = 'generalized-alpha' does not integrate "
     "solver.exudyn.formulation = 'tree'; use 'dopri5'"),
    ({FORMULATION: "tree", METHOD: "auto", "joints.slider": "ideal"},
     "joints.slider = 'ideal' leaves solver.exudyn.formulation = 'tree' nothing free; use 'full'"),
    (TREE | {GROUPS: ["joints"]}, "output.groups = 'joints' is not given by solver.exudyn.method = 'dopri5'; "
     "use 'trapezoidal-index2' (formulation 'full')"),
]  # fmt: skip


@pytest.fixture
def make_scene(scene):
    """Function from changes with dotted keys, and a tree's tolerance (None: five bodies), to a scene."""

    def make(*changes, tree=None):
        solver = TREE | {STEP: 1e-4, TOLERANCE: tree} if tree else {}
        return scene(solver | {key: value for more in changes for key, value in more.items()})

    return make


@pytest.fixture
def run(make_scene):
    return lambda *changes, tree=None: simulate(make_scene(*changes, tree=tree))


@pytest.mark.parametrize(("changes", "message"), REFUSALS)
def test_unsupported_scenes_are_refused_in_one_line(make_scene, changes, message):
    with pytest.raises(ValueError, match=r"use '") as error:
        simulate(make_scene(changes))
    assert str(error.value) == message


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
    ({"drive.cycles": 0.1}, 1e-17, "step-too-small", TOLERANCE),
    (PIN | {"joints.slider": "ideal"}, 1e-17, "step-too-small", TOLERANCE),
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


# Where touches fall in their steps scatters the order, 1.93 measured of the foundation: the first impact, of
# a whole side, lasts 18 of the largest steps. Last: its tolerance, and the bound of the last error, m
ORDERS = [
    ({}, [8e-6, 4e-6, 2e-6, 1e-6], "generalized-alpha", 0.25, 5e-9),
    ({}, [8e-6, 4e-6, 2e-6, 1e-6], "trapezoidal-index2", 0.3, 5e-9),
    ({"contact.law": "foundation"}, [5e-7, 2.5e-7, 1.25e-7], "generalized-alpha", 0.2, 4e-7),
]


@pytest.mark.parametrize(("law", "steps", "method", "within", "bound"), ORDERS)
def test_the_error_of_five_bodies_is_of_second_order(run, law, steps, method, within, bound):
    """The tree is exact; there are seven contacts in 0.1 cycles."""
    exact = run(law, {"drive.cycles": 0.1}, tree=1e-11)
    changes = law | {"drive.cycles": 0.1, "solver.exudyn.method": method}
    runs = [run(changes, {STEP: step}) for step in steps]
    errors = [np.abs(result.columns["slider_x"] - exact.columns["slider_x"]).max() for result in runs]
    assert np.polyfit(np.log(steps), np.log(errors), 1)[0] == pytest.approx(2.0, abs=within), errors
    assert errors[-1] < bound
    assert list(runs[-1].events["corner"]) == list(exact.events["corner"])
    for name in ("normal_speed", "impulse", "peak_force", "largest_depth") if law else ():
        # Second order in the 70 steps of the first impact: 1e-3, magnified by those that follow
        np.testing.assert_allclose(runs[-1].events[name], exact.events[name], rtol=0.02, err_msg=name)


BOUNCES = PIN | {"drive.cycles": 0.06, "output.samples_per_cycle": 10_000}


# A cycle of chatter; five bounces of the journal, where friction reverses inside a step. Measured: 13,493 and
# at most 2302 steps
@pytest.mark.parametrize(
    ("changes", "work", "retries"),
    [({"drive.cycles": 1.0}, 18_000, 3), (BOUNCES | {"joints.slider": "ideal"}, 4000, 6), (BOUNCES, 4000, 6)],
)
def test_a_tree_takes_few_steps(run, changes, work, retries):
    """A retry for each touch and for each leaving, a few more as a step is shortened to 3/4 at most."""
    result = run(changes, tree=1e-10)
    counters = result.provenance["counters"]
    assert counters["steps"] < work
    assert counters["rejected"] < 0.15 * counters["steps"]
    assert counters["located"] < retries * len(result.events["start"])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("changes", "status", "key", "value"),
    [
        (TREE | {TOLERANCE: 1e-17, "drive.cycles": 0.05}, "step-too-small", TOLERANCE, 1e-10),
        ({STEP: 1e-3}, "invariant-violated", STEP, 2e-5),
        ({STEP: 1e-3, "contact.law": "paper-switching"}, "newton-failed", STEP, 2e-5),
    ],
)
def test_what_a_failure_says_to_try_works(run, changes, status, key, value):
    common = {"drive.cycles": 0.2, GROUPS: []}
    failure = run(common, changes)
    assert failure.status == status
    assert key in failure.remedy
    assert run(common, changes, {key: value}).status == "success"
