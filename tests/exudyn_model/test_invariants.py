"""What no correct run can show: healthy runs do not, and a fault of each kind does."""

import sys
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

import exudyn_model
from exudyn_model import simulate
from exudyn_model.contact.memory import EVENT
from exudyn_model.contact.states import contact_states
from exudyn_model.five_bodies import mechanism
from exudyn_model.invariants import UNITS
from exudyn_model.reading import read_scene
from exudyn_model.seen import seen_in_contacts, seen_in_events, seen_in_samples
from exudyn_model.watch import watch_contact

TREE = {"solver.exudyn.formulation": "tree", "solver.exudyn.method": "dopri5"}
USUAL = {
    "tree": TREE | {"solver.exudyn.step": 1e-4, "solver.exudyn.tolerance": 1e-9},
    "full": {},
    "native": {"solver.exudyn.formulation": "native"},
    "index 2": {"solver.exudyn.method": "trapezoidal-index2", "output.groups": ["energy"]},
}
CONTACT = {"open-depth", "pull", "driving-friction", "leaving-start", "start-gap", "overlap"}
FIXED_STEPS = CONTACT | {"constraint-position", "constraint-velocity"}
APPLIES = {"tree": CONTACT, "full": FIXED_STEPS, "native": FIXED_STEPS, "index 2": FIXED_STEPS | {"energy"}}


def broken(result):
    return {
        name for name, found in result.provenance["invariants"].items() if found["value"] > found["bound"]
    }


@pytest.mark.parametrize("formulation", USUAL)
def test_each_run_is_checked_and_a_healthy_one_passes(make_scene, formulation):
    result = simulate(make_scene(USUAL[formulation] | {"drive.cycles": 0.03, "initial.slider_vx": -0.1}))
    assert result.status == "success"
    assert len(result.events["start"]) > 0
    invariants = result.provenance["invariants"]
    assert set(invariants) == APPLIES[formulation]
    for name, found in invariants.items():
        assert found["unit"] == UNITS[name]
        assert 0.0 <= found["value"] <= found["bound"]
        assert 0.0 <= found["time_s"] <= result.columns["time"][-1]


def test_a_law_without_a_potential_owes_no_energy(make_scene):
    result = simulate(make_scene(USUAL["index 2"] | {"contact.law": "paper-switching", "drive.cycles": 0.01}))
    assert set(result.provenance["invariants"]) == FIXED_STEPS


@settings(max_examples=15, deadline=None)
@given(
    formulation=st.sampled_from(list(USUAL)),
    speed=st.floats(1.0, 3.0),
    backwards=st.booleans(),
    crank=st.floats(0.0, 360.0),
    offset=st.floats(-1.02, 1.02),
    vx=st.floats(-0.3, 0.3),
    pin=st.sampled_from(["ideal", "clearance"]),
    law=st.sampled_from(["hertz-corners", "strip", "paper-switching", "foundation"]),
    impact_speed=st.sampled_from(["frozen", "current"]),
    modulus=st.floats(7.0, 11.3),
    restitution=st.floats(0.0, 1.0),
    friction=st.sampled_from([0.0, 0.15, 1.0]),
)
# A rest beside an impact
@example("index 2", 1.0, False, 0.0, 0.0, 0.25, "ideal", "strip", "frozen", 7.0, 0.0, 0.15)
def test_no_healthy_run_breaks_one(
    make_scene,
    formulation,
    speed,
    backwards,
    crank,
    offset,
    vx,
    pin,
    law,
    impact_speed,
    modulus,
    restitution,
    friction,
):
    """From anywhere between the walls, and from 4 um inside of one, moving into it."""
    if formulation == "native":
        pin, law, impact_speed = "ideal", "hertz-corners", "frozen"
        vx = np.copysign(max(abs(vx), 0.01), offset)
    rpm = 10.0**speed
    changes = {
        "drive.speed_rpm": -rpm if backwards else rpm,
        "drive.cycles": 0.01 * rpm / 60,
        "output.samples_per_cycle": max(10, round(6000 * 10 / rpm)),
        "mechanism.crank_angle_deg": crank,
        "initial.slider_offset": offset * 2e-4,
        "initial.slider_vx": vx,
        "joints.crank_pin": pin,
        "contact.law": law,
        "contact.impact_speed": impact_speed,
        "contact.youngs_modulus": 10.0**modulus,
        "contact.restitution": restitution,
        "friction.coefficient": friction,
    }
    result = simulate(make_scene(USUAL[formulation] | changes))
    assert result.status != "invariant-violated", result.remedy


# State of a contact that is watched: changes to a healthy one, and what they break
STATES = {
    "open-depth": {"gap": -1e-9, "impact_speed": 0.0},
    "pull": {"normal": -1e-6},
    "driving-friction": {"friction": 1.0},
    "leaving-start": {"rate": 0.02},
    "start-gap": {"known_gap": 1e-6},
}


@pytest.mark.parametrize("name", STATES)
def test_a_watched_contact_shows_what_it_does_wrong(name):
    state = {"gap": -1e-6, "rate": -0.1, "slip": 0.5, "normal": 10.0, "friction": -1.0, "impact_speed": 0.1}

    def watched(changes):
        contacts = contact_states()
        record, now = contacts[2], state | changes
        record["impact_speed"], record["start"] = now.pop("impact_speed"), 0.5
        record["known_gap"], record["known_rate"] = now.pop("known_gap", 0.0), now["rate"]
        friction, slip = now.pop("friction"), now["slip"]
        watch_contact(0.5, *now.values(), friction * slip, record["impact_speed"] > 0.0, record)
        return {seen.name: seen for seen in seen_in_contacts(contacts)}

    assert {seen.value for seen in watched({}).values()} == {0.0}
    found = watched(STATES[name])
    assert {one for one, seen in found.items() if seen.value > 0.0} == {name}
    assert (found[name].time, found[name].place) == (0.5, "corner ul")


def test_overlapping_contacts_of_one_corner():
    events = np.zeros(4, EVENT)
    events["start"], events["end"] = [0.0, 0.1, 0.2, 0.3], [0.15, 0.4, 0.25, 0.5]
    table = {name: events[name] for name in ("start", "end")}
    # lr's second lies inside its first; ll's contacts follow each other
    table["corner"] = np.array(["ll", "lr", "lr", "ll"])
    seen = seen_in_events(table, "hertz-corners")
    assert (seen.value, seen.time) == (pytest.approx(0.2), 0.2)
    table["corner"] = np.array(["ll", "lr", "ur", "ll"])
    assert seen_in_events(table, "hertz-corners").value == 0.0
    # Where a side has one contact under either name, these are of one
    seen = seen_in_events(table, "foundation")
    assert (seen.value, seen.time) == (pytest.approx(0.2), 0.2)
    table["corner"] = np.array(["ll", "lr", "ul", "ll"])
    assert seen_in_events(table, "foundation").value == 0.0


def test_a_sample_inside_a_wall_lies_in_a_contact_of_the_table(make_scene):
    scene = make_scene(USUAL["tree"] | {"drive.cycles": 0.1, "output.samples_per_cycle": 20_000})
    result, parameters = simulate(scene), read_scene(scene)
    assert seen_in_samples(result.columns, result.events, parameters).value < 1e-15
    fewer = {name: np.delete(column, 1) for name, column in result.events.items()}
    seen = seen_in_samples(result.columns, fewer, parameters)
    # As deep as the row that is left out says, but for what lies between two samples
    assert seen.value == pytest.approx(result.events["largest_depth"][1], rel=0.01)
    assert seen.place == f"corner {result.events['corner'][1]}"
    assert result.events["start"][1] < seen.time < result.events["end"][1]


def test_a_newton_iteration_that_ends_before_its_tolerance_breaks_none(make_scene):
    """It ends at a part of what it begins with: two tolerances below that give the same run."""
    changes = USUAL["full"] | {"drive.cycles": 0.6, "solver.exudyn.formulation": "full"}
    runs = [simulate(make_scene(changes | {"solver.exudyn.tolerance": given})) for given in (1e-14, 1e-12)]
    assert [run.status for run in runs] == ["success", "success"]
    assert np.array_equal(runs[0].columns["slider_x"], runs[1].columns["slider_x"])
    # More than ten times what the tolerance is raised to at least, 6e-14: that was the bound
    assert runs[0].provenance["invariants"]["constraint-position"]["value"] > 6e-13


def test_a_joint_left_out_is_reported_and_the_table_kept(make_scene, monkeypatch):
    pins = mechanism.pins
    monkeypatch.setattr(mechanism, "pins", lambda of: [pin for pin in pins(of) if pin.name != "C"])
    result = simulate(make_scene({"drive.cycles": 0.01}))
    assert broken(result) >= {"constraint-position", "constraint-velocity"}
    assert result.status == result.provenance["status"] == "invariant-violated"
    assert result.remedy.startswith("constraint-")
    assert "bound" in result.remedy
    assert "\n" not in result.remedy
    assert len(result.columns["time"]) == 11


def test_a_weight_that_is_wrong_does_not_balance(make_scene, monkeypatch):
    load = mechanism.LoadMassProportional

    def lighter(markerNumber, loadVector):
        return load(markerNumber=markerNumber, loadVector=[0.99 * part for part in loadVector])

    monkeypatch.setattr(mechanism, "LoadMassProportional", lighter)
    assert broken(simulate(make_scene(USUAL["index 2"] | {"drive.cycles": 0.1}))) == {"energy"}


# Places in the sources, as they are and with a fault
FAULTS = [
    # A corner that is never looked at (tree), and contacts that begin too deep (fixed steps)
    ("tree/switching.py", "for number in range(_CORNERS):", "for number in range(1, _CORNERS):"),
    ("contact/memory.py", "impact_speed == 0.0 and gap < 0.0:", "impact_speed == 0.0 and gap < -5e-7:"),
    ("contact/point.py", "return max(force, 0.0)", "return force"),
    ("contact/friction.py", "force: float = -law.friction * min(", "force: float = law.friction * min("),
    ("tree/steps.py", "gap <= GAP_TOLERANCE and rate < 0.0:", "gap <= GAP_TOLERANCE:"),
    ("contact/memory.py", "    row.end = end\n", "    row.end = end + 0.1\n"),
]
# The contact of a side ends as soon as the corner that it is named by leaves
SIDE_FAULTS = [
    ("tree/steps.py", "        if other.closed > 0.0:\n", "        if other.impact_speed > 0.0:\n"),
    (
        "contact/foundation.py",
        "        if lower.gap >= 0.0 and upper.gap >= 0.0:\n            ended",
        "        if contact.impact_speed > 0.0 and (lower if number == side else upper).gap >= 0.0:\n"
        "            ended",
    ),
]


@pytest.fixture(scope="module", params=[FAULTS], ids=["contacts"])
def faulty(request, tmp_path_factory):
    """``simulate`` of a copy of the package with these faults: kernels are compiled from a copy alone."""
    folder, name = tmp_path_factory.mktemp("copy"), f"faulty_exudyn_model_{len(request.param)}"
    package = Path(exudyn_model.__file__).parent
    texts = {path.relative_to(package).as_posix(): path.read_text("utf-8") for path in package.rglob("*.py")}
    for file, old, new in request.param:
        assert texts[file].count(old) == 1, (file, old)
        texts[file] = texts[file].replace(old, new)
    for file, text in texts.items():
        target = folder / name / file
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text(text.replace("exudyn_model", name), "utf-8")
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
    changes = USUAL[formulation] | {"contact.law": "foundation", "drive.cycles": 0.02}
    changes |= {"contact.youngs_modulus": 1e9, "initial.slider_offset": 1.95e-4}
    changes |= {"initial.slider_vx": 0.1, "initial.slider_omega": 3.0}
    assert simulate(make_scene(changes)).status == "success"
    result = faulty(make_scene(changes))
    assert result.status == "invariant-violated"
    assert "open-depth" in broken(result)
