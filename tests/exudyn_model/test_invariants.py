"""What no correct run can show: healthy runs do not, and a fault of each kind does."""

import shutil
import sys
from dataclasses import replace
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import exudyn_model
from exudyn_model import simulate
from exudyn_model.five_bodies import recording, solver, system
from exudyn_model.five_bodies.balance import constraints

TREE = {"solver.exudyn.formulation": "tree", "solver.exudyn.method": "dopri5"}
USUAL = {
    "tree": TREE | {"solver.exudyn.step": 1e-4, "solver.exudyn.tolerance": 1e-9},
    "full": {},
    "index 2": {"solver.exudyn.method": "trapezoidal-index2", "output.groups": ["energy"]},
}
CONTACT = {"open-depth", "pull", "driving-friction", "leaving-start", "start-gap", "overlap"}
FIXED_STEPS = CONTACT | {"constraint-position", "constraint-velocity"}
APPLIES = {"tree": CONTACT, "full": FIXED_STEPS, "index 2": FIXED_STEPS | {"energy"}}


def broken(result):
    return {
        name
        for name, computed in result.provenance["invariants"].items()
        if computed["value"] > computed["bound"]
    }


@pytest.mark.parametrize("formulation", USUAL)
def test_each_run_is_checked_and_a_healthy_one_passes(run, formulation):
    result = run(USUAL[formulation], {"drive.cycles": 0.03, "initial.slider_vx": -0.1})
    assert result.status == "success"
    assert len(result.events["start"]) > 0
    invariants = result.provenance["invariants"]
    assert set(invariants) == APPLIES[formulation]
    for computed in invariants.values():
        assert 0.0 <= computed["value"] <= computed["bound"]
        assert 0.0 <= computed["time_s"] <= result.columns["time"][-1]


def test_a_law_without_a_potential_owes_no_energy(run):
    result = run(USUAL["index 2"], {"contact.law": "paper-switching", "drive.cycles": 0.01})
    assert set(result.provenance["invariants"]) == FIXED_STEPS


PRESSES = {
    "mechanism.crank_angle_deg": st.floats(0.0, 360.0),
    # From anywhere between the walls, and from 4 um inside of one, moving into it
    "initial.slider_offset": st.floats(-2.04e-4, 2.04e-4),
    "initial.slider_vx": st.floats(-0.3, 0.3),
    "joints.crank_pin": st.sampled_from(["ideal", "clearance"]),
    "contact.law": st.sampled_from(["hertz-corners", "paper-switching", "foundation", "adams-impact"]),
    "contact.damping": st.floats(0.0, 4.0).map(lambda power: 10.0**power),
    "contact.youngs_modulus": st.floats(7.0, 11.3).map(lambda power: 10.0**power),
    "contact.restitution": st.floats(0.0, 1.0),
    "friction.coefficient": st.sampled_from([0.0, 0.15, 1.0]),
}


def assert_healthy(make_scene, formulation, rpm, changes):
    """Run 0.01 s; what it breaks is mended as the run says, by a shorter step.

    The paper's law alone may do so: a force that jumps has no potential, and gives the slider what energy it
    likes, so that it may fly at a speed that this step does not follow.
    """
    samples = {
        "drive.cycles": 0.01 * abs(rpm) / 60,
        "output.samples_per_cycle": max(10, round(6e4 / abs(rpm))),
    }
    scene = make_scene(USUAL[formulation], changes, samples, {"drive.speed_rpm": rpm})
    result = simulate(scene)
    violated = result.status == "invariant-violated"
    if violated and changes["contact.law"] == "paper-switching" and formulation != "tree":
        assert "solver.exudyn.step" in result.remedy
        scene["solver"]["exudyn"]["step"] = 2.5e-7
        again = simulate(scene)
        assert again.status != "invariant-violated", again.remedy
    else:
        assert not violated, result.remedy
    return result


@settings(max_examples=15, deadline=None)
@given(
    formulation=st.sampled_from(list(USUAL)),
    speed=st.floats(1.0, 3.0),
    sign=st.sampled_from([1, -1]),
    changes=st.fixed_dictionaries(PRESSES),
)
def test_no_healthy_run_breaks_one(make_scene, formulation, speed, sign, changes):
    assert_healthy(make_scene, formulation, sign * 10.0**speed, changes)


@pytest.mark.slow
def test_what_the_paper_s_law_throws_at_a_hundred_metres_a_second_needs_a_shorter_step(make_scene):
    """133, 142 and 96 m/s by five bodies in steps of 1, 0.5 and 0.25 us, 103 m/s by the tree."""
    changes = {
        "mechanism.crank_angle_deg": 13.90482406352642, "initial.slider_offset": 0.0,
        "initial.slider_vx": 0.29295987265568785, "joints.crank_pin": "ideal",
        "contact.law": "paper-switching",
        "contact.youngs_modulus": 5503849283.304024, "contact.restitution": 0.5364217710219744,
        "friction.coefficient": 0.15, "solver.exudyn.step": 1e-6,
    }  # fmt: skip
    thrown = assert_healthy(make_scene, "full", 100.0, changes)
    assert broken(thrown) == {"constraint-velocity"}
    assert np.max(np.abs(thrown.columns["slider_vx"])) == pytest.approx(120.0, abs=30.0)


def test_a_newton_iteration_that_ends_before_its_tolerance_breaks_none(run):
    """It ends at a part of what it begins with: two tolerances below that give the same run."""
    runs = [run({"drive.cycles": 0.6, "solver.exudyn.tolerance": given}) for given in (1e-14, 1e-12)]
    assert [run.status for run in runs] == ["success", "success"]
    assert np.array_equal(runs[0].columns["slider_x"], runs[1].columns["slider_x"])
    # More than ten times what the tolerance is raised to at least, 6e-14: that was the bound
    assert runs[0].provenance["invariants"]["constraint-position"]["value"] > 6e-13


def test_a_joint_left_out_is_reported_and_the_table_kept(make_scene, monkeypatch):
    build = solver.build

    def without_joint(of, step):
        fewer = [pin for pin in of.pins if pin.name != "C"]
        model = build(replace(of, pins=fewer), step)
        # Its rows are looked at nevertheless
        monkeypatch.setattr(solver, "constraints", lambda _, *state: constraints(of, *state))
        monkeypatch.setattr(recording, "constraints", lambda _, *state: constraints(of, *state))
        monkeypatch.setattr(recording, "accelerations", lambda *arguments: (arguments[-1], None))
        return model

    monkeypatch.setattr(solver, "build", without_joint)
    result = simulate(make_scene({"drive.cycles": 0.01}))
    assert broken(result) >= {"constraint-position", "constraint-velocity"}
    assert result.status == result.provenance["status"] == "invariant-violated"
    assert result.remedy.startswith("constraint-")
    assert "bound" in result.remedy
    assert "\n" not in result.remedy
    assert len(result.columns["time"]) == 11


def test_a_weight_that_is_wrong_does_not_balance(make_scene, monkeypatch):
    load = system.LoadMassProportional

    def lighter(markerNumber, loadVector):
        return load(markerNumber=markerNumber, loadVector=[0.99 * part for part in loadVector])

    monkeypatch.setattr(system, "LoadMassProportional", lighter)
    assert broken(simulate(make_scene(USUAL["index 2"] | {"drive.cycles": 0.1}))) == {"energy"}


# Places in the sources, as they are and with a fault
FAULTS = [
    # A corner that is never looked at (tree), and contacts that begin too deep (five bodies)
    ("tree/isolation.py", "range(0 if guide is not None", "range(1 if guide is not None"),
    ("five_bodies/following.py", "(contact[IMPACT_SPEED] > 0.0) == (gap < 0.0):",
     "(contact[IMPACT_SPEED] > 0.0) == (gap < -5e-7 * (contact[IMPACT_SPEED] == 0.0)):"),
    ("laws.py", "return max(force, 0.0)", "return force"),
    ("laws.py", "force: float = -law[FRICTION_COEFFICIENT] * min(",
     "force: float = law[FRICTION_COEFFICIENT] * min("),
    ("tree/isolation.py", "gap <= ROUNDED and rate < 0.0:", "gap <= ROUNDED:"),
    ("tables.py", "np.isinf(end), now, end)", "np.isinf(end), now, end + 0.1)"),
]  # fmt: skip
# The contact of a side ends as soon as the corner that it is named by leaves
SIDE_FAULTS = [
    ("tree/isolation.py", "        if other[CLOSED] > 0.0:\n",
     "        if other[CLOSED] > 0.0 and contacts[row % UPPER, NAME] != row:\n"),
    ("five_bodies/following.py", "    is_open = lower.gap >= 0.0 and upper.gap >= 0.0\n",
     "    is_open = lower.gap >= 0.0 and (upper.gap >= 0.0 or low[IMPACT_SPEED] > 0.0)\n"),
]  # fmt: skip


@pytest.fixture(scope="module", params=[FAULTS], ids=["contacts"])
def faulty(request, tmp_path_factory):
    """``simulate`` of a copy of the package with these faults: kernels are compiled from a copy alone."""
    folder, name = tmp_path_factory.mktemp("copy"), f"faulty_exudyn_model_{len(request.param)}"
    package = Path(exudyn_model.__file__).parent
    shutil.copytree(package, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
    for file, old, new in request.param:
        text = (folder / name / file).read_text("utf-8")
        assert text.count(old) == 1, (file, old)
        (folder / name / file).write_text(text.replace(old, new), "utf-8")
    for path in (folder / name).rglob("*.py"):
        path.write_text(path.read_text("utf-8").replace("exudyn_model", name), "utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("NUMBA_CACHE_DIR", str(folder / "kernels"))
        patch.syspath_prepend(folder)
        yield import_module(name).simulate
    for module in [module for module in sys.modules if module.startswith(name)]:
        del sys.modules[module]


@pytest.mark.slow
@pytest.mark.parametrize("formulation", ["tree", "full"])
def test_each_fault_breaks_its_invariant(make_scene, faulty, formulation):
    result = faulty(make_scene(USUAL[formulation] | {"drive.cycles": 0.1}))
    assert result.status == "invariant-violated"
    expected = {"open-depth", "driving-friction", "overlap", "start-gap"}
    if formulation == "tree":
        expected.add("leaving-start")
    assert broken(result) == expected
    # In the wall, and out of it much faster than the least impact speed
    released = {"initial.slider_offset": 2.02e-4, "initial.slider_vx": -0.05, "drive.cycles": 0.002}
    assert "pull" in broken(faulty(make_scene(USUAL[formulation] | released)))


@pytest.mark.slow
@pytest.mark.parametrize("faulty", [SIDE_FAULTS], indirect=True, ids=["sides"])
@pytest.mark.parametrize("formulation", ["tree", "full"])
def test_a_side_s_contact_that_ends_with_its_first_corner_is_reported(make_scene, faulty, formulation):
    """Thrown at a soft guide so that its lower corner touches, and leaves while the upper one is inside."""
    thrown = {"initial.slider_offset": 1.95e-4, "initial.slider_vx": 0.1, "initial.slider_omega": 3.0}
    soft = {"contact.law": "foundation", "contact.youngs_modulus": 1e9, "drive.cycles": 0.02}
    scene = make_scene(USUAL[formulation], thrown, soft)
    assert simulate(scene).status == "success"
    result = faulty(scene)
    assert result.status == "invariant-violated"
    assert "open-depth" in broken(result)
