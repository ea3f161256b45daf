"""Invariants: healthy runs keep them, and a fault of each kind breaks its own."""

import shutil
import sys
from importlib import import_module
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import exudyn_model
from exudyn_model import simulate

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
    invariants = result.provenance["invariants"]
    return {name for name, computed in invariants.items() if computed["value"] > computed["bound"]}


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


@settings(max_examples=15, deadline=None)
@given(
    formulation=st.sampled_from(list(USUAL)),
    rpm=st.tuples(st.floats(1.0, 3.0), st.sampled_from([1, -1])).map(
        lambda drawn: drawn[1] * 10.0 ** drawn[0]
    ),
    changes=st.fixed_dictionaries(PRESSES),
)
def test_no_healthy_run_breaks_one(make_scene, formulation, rpm, changes):
    """Run 0.01 s; what it breaks is mended as the run says, by a shorter step.

    The paper's law alone may do so: a force that jumps has no potential, and gives the slider what energy it
    likes, so that it may fly at a speed that this step does not follow.
    """
    samples = max(10, round(6e4 / abs(rpm)))
    changes |= {"drive.cycles": 0.01 * abs(rpm) / 60, "output.samples_per_cycle": samples}
    scene = make_scene(USUAL[formulation], changes, {"drive.speed_rpm": rpm})
    result = simulate(scene)
    if result.status == "invariant-violated" and formulation != "tree":
        assert changes["contact.law"] == "paper-switching", result.remedy
        assert "solver.exudyn.step" in result.remedy
        scene["solver"]["exudyn"]["step"] = 2.5e-7
        result = simulate(scene)
    assert result.status != "invariant-violated", result.remedy


# Places in the sources, as they are and with a fault
FAULTS = [
    # A corner that is never looked at (tree), and contacts that begin too deep (five bodies)
    ("tree/steps.py", "range(0 if press.has_guide", "range(1 if press.has_guide"),
    ("five_bodies/contact.py", "(contact.impact_speed > 0.0) == (gap < 0.0):",
     "(contact.impact_speed > 0.0) == (gap < -5e-7 * (contact.impact_speed == 0.0)):"),
    ("laws.py", "return max(force, 0.0)", "return force"),
    ("laws.py", "force: float = -law.friction * min(", "force: float = law.friction * min("),
    ("tree/steps.py", "after.value <= ROUNDED and after.rate < 0.0:", "after.value <= ROUNDED:"),
    ("tables.py", "np.isinf(end), now, end)", "np.isinf(end), now, end + 0.1)"),
]  # fmt: skip
# The contact of a side ends as soon as the corner that it is named by leaves
SIDE_FAULTS = [
    ("tree/steps.py", "        if other.closed > 0.0:\n",
     "        if other.closed > 0.0 and contacts[row % UPPER].name != row:\n"),
    ("five_bodies/slider_contact.py", "    is_open = lower.gap >= 0.0 and upper.gap >= 0.0\n",
     "    is_open = lower.gap >= 0.0 and (upper.gap >= 0.0 or low.impact_speed > 0.0)\n"),
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
