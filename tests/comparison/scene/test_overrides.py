"""A scene knows where it differs from its files: name, title and the command that repeats it follow."""

import re
import shlex

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from comparison.scene import load_scene, parse_set

PAPER = "150rpm-0.2mm"
TEXT = st.text(st.characters(exclude_categories=["Cs"]), max_size=12)
SLIDER, GUIDE, BOTH = (f"contact.youngs_modulus{partner}" for partner in (".slider", ".guide", ""))
COORDINATE = st.floats(-1, 1).map(lambda x: round(x, 12))
MODULUS = st.sampled_from([50e9, 69e9, 210e9])
CHANGES = st.fixed_dictionaries(
    {},
    optional={
        "clearance.slider": st.floats(1e-6, 1e-2),
        "drive.cycles": st.integers(1, 9),
        "mechanism.rocker_pivot": st.tuples(COORDINATE, COORDINATE).map(list),
        "joints.slider": st.just("clearance"),
        "output": st.fixed_dictionaries({"groups": st.just(["energy", "joints"])}),
        "scene.title": TEXT,
        "scene.description": TEXT,
        "solver.exudyn": st.just({"formulation": "tree", "tolerance": 1e-10}),
        SLIDER: MODULUS,
        BOTH: MODULUS,
        GUIDE: MODULUS,
    },
)


def repeated(scene):
    """Load the scene of its command as a shell and the command line read it."""
    sixbar, verb, source, *options = shlex.split(scene.command("plan"))
    assert (sixbar, verb, set(options[::2])) == ("sixbar", "plan", {"--set"} if options else set())
    return load_scene(source, parse_set(options[1::2]))


@given(CHANGES, CHANGES)
@settings(max_examples=60)
@example({"drive.cycles": 2, "clearance.slider": 0.0078125}, {"drive.cycles": 1})  # the first key is dropped
def test_the_command_of_a_scene_repeats_it_and_python_does_as_the_command_line_does(first, second):
    scene = load_scene(PAPER, first).with_values(second)
    again = repeated(scene)
    assert (again.hash, again.overrides) == (scene.hash, scene.overrides)
    assert (again.name, again.title, again.description) == (scene.name, scene.title, scene.description)
    assert (scene.name == PAPER) == all(key.startswith("scene.") for key in scene.overrides)
    assert re.fullmatch(r"[A-Za-z0-9._+=-]{1,100}", scene.name)  # a folder, everywhere
    if not {SLIDER, BOTH, GUIDE} & {*first, *second}:  # of which a later one replaces another
        assert load_scene(PAPER, first | second).name == scene.name


def test_what_is_changed_is_in_the_title_and_nothing_false_is_said():
    changes = {"clearance.slider": 4e-4, BOTH: 69e9, "joints.slider": "ideal"}
    changed = load_scene(PAPER, changes)
    assert changed.title == (
        "150rpm-0.2mm with clearance.slider = 0.4 mm, contact.youngs_modulus = 69 GPa, joints.slider = ideal"
    )
    # What is there already is no change, nor is what is changed back.
    same = load_scene(PAPER, {"clearance.slider": 2e-4, "drive.speed_rpm": 150, "drive": {"cycles": 2}})
    back = changed.with_values({"clearance": {"slider": 2e-4}, BOTH: 210e9})
    for scene in (same, back.with_values({"joints.slider": "clearance"})):
        assert (scene.overrides, scene.data) == ({}, load_scene(PAPER).data)
        assert scene.command("run", "--out", "a b.csv") == "sixbar run 150rpm-0.2mm --out 'a b.csv'"


@pytest.mark.parametrize(
    ("assignments", "moduli"),
    [
        (["{0}.slider=69e9"], {"slider": 69e9, "guide": 210e9}),
        (["{0}={{slider=69e9, guide=100e9}}"], {"slider": 69e9, "guide": 100e9}),
        (["{0}=69e9", "{0}.guide=210e9"], {"slider": 69e9, "guide": 210e9}),
        (["{0}.guide=210e9", "{0}=69e9"], 69e9),
        (["{0}.guide=210e9"], 210e9),  # that of both
    ],
)
def test_a_material_is_a_number_or_one_of_each_partner(assignments, moduli):
    scene = load_scene(PAPER, parse_set([text.format(BOTH) for text in assignments]))
    assert scene.data["contact"]["youngs_modulus"] == moduli
    assert repeated(scene).hash == scene.hash


def test_texts_that_are_given_hold_also_those_of_a_file_that_extends_another(tmp_path):
    path = tmp_path / "my press.toml"
    path.write_text('[scene]\nname = "own"\nextends = "150rpm-0.2mm"\n[clearance]\nslider = 4e-4\n')
    scene = load_scene(path)
    assert (scene.title, scene.description, scene.overrides) == ("own", "", {})
    changed = scene.with_values({"drive.cycles": 1})
    assert changed.title == "own with drive.cycles = 1"
    assert repeated(changed).hash == changed.hash  # the path has a space


def test_a_run_at_another_setting_keeps_the_name_and_its_command_has_the_setting():
    scene = load_scene(PAPER, {"clearance.slider": 4e-4})
    finer = scene.variant({"solver.reference.tolerance": 1e-12})
    assert (finer.name, finer.title, finer.data["scene"]) == (scene.name, scene.title, scene.data["scene"])
    assert repeated(finer).hash == finer.hash != scene.hash
    # A step of one formulation is none of another: it is not carried on.
    tree = scene.with_values({"solver.exudyn.step": 1e-6}).variant({"solver.exudyn.formulation": "tree"})
    assert tree.data["solver"]["exudyn"]["step"] == 1e-4
    assert repeated(tree).hash == tree.hash
