"""Scenes are complete, know their changes, warn of odd values; their hash is that of the keys that count."""

import re
import shlex

import numpy as np
import pytest

import reference_model
from comparison.scene import SceneError, load_scene, parse_set, scene_from_mapping, shipped_scenes
from comparison.scene.keys import flat, scene_keys
from comparison.scene.loading import contact_time

PAPER = "150rpm-0.2mm"
FULL = {"formulation": "full", "method": "auto", "step": 2e-6, "tolerance": 1e-7}
TREE = {"formulation": "tree", "method": "auto", "step": 1e-4, "tolerance": 1e-10}
FORMULATION = "solver.exudyn.formulation"


def exudyn(scene):
    return scene.data["solver"]["exudyn"]


def test_the_mapping_is_complete_plain_and_without_the_criteria():
    scene = load_scene(PAPER, {"drive.speed_rpm": -210, "compare.tolerance": 1e-3, "reliability.bins": 36})
    data = scene.data
    assert data["initial"]["slider_offset"] == data["mechanism"]["reference_offset"] == 5e-5
    assert (data["solver"]["reference"]["tolerance"], data["solver"]["exudyn"]) == (1e-10, FULL)
    assert (type(data["mechanism"]["rod4"]), type(data["drive"]["speed_rpm"])) == (dict, float)
    assert not {"compare", "reliability"} & set(data)
    assert (scene.compare.tolerance, scene.reliability.bins) == (1e-3, 36)
    # The end is that of the last sample.
    variant = scene.with_values({"drive.cycles": 0.3334, "output.samples_per_cycle": 100})
    assert variant.duration == pytest.approx(33 * 60 / 21000, rel=1e-15)  # one rounding
    assert scene.period == pytest.approx(60 / 210, rel=1e-15)


def test_settings_and_a_start_that_are_left_open_follow_what_is_changed():
    tree = load_scene(PAPER, {FORMULATION: "tree"})
    assert exudyn(tree) == exudyn(load_scene("crank-pin").with_values({FORMULATION: "tree"})) == TREE
    back = tree.with_values({FORMULATION: "full", "solver.exudyn.step": 1e-6})
    assert exudyn(back) == FULL | {"step": 1e-6}
    scene = load_scene(PAPER, {"solver.exudyn.tolerance": 1e-8, FORMULATION: "tree"})
    assert exudyn(scene) == TREE | {"tolerance": 1e-8}
    # The step that the file gives five bodies is not the tree's, nor that of a run that requests more.
    for changes, step in (({}, 1e-4), ({"solver.exudyn.method": "generalized-alpha"}, 2e-6)):
        assert exudyn(load_scene("crank-pin", {FORMULATION: "auto"} | changes))["step"] == step
    for start, offset in ({}, 0.0), ({"initial.slider_offset": 1e-5}, 1e-5):
        press = load_scene(PAPER, start).with_values({"mechanism.reference_offset": 0.0})
        assert press.data["initial"]["slider_offset"] == offset


def test_set_reads_toml_values_and_takes_bare_words_as_text():
    values = {"a.b": 1, "c": 2e-9, "d": [1, 2], "e": True, "f": "ideal", "g": "x y", "h": "a=b"}
    assert parse_set(["a.b=1", "c=2e-9", "d=[1, 2]", "e=true", "f=ideal", "g='x y'", "h=a=b"]) == values
    # A line break must not smuggle in a second key.
    assert parse_set(["a=1\nb=2"]) == {"a": "1\nb=2"}


def test_the_hash_sees_numbers_and_not_texts():
    scene = load_scene(PAPER, {"drive.speed_rpm": 77.7})
    texts = {"scene.title": "other", "compare.tolerance": 1e-3, "reliability.bins": 36}
    assert scene.with_values(texts).hash == scene.hash
    changes = {"drive.speed_rpm": -77.7, "solver.exudyn.step": 1e-6, "output.groups": []}
    assert len({scene.hash, *(scene.with_values({key: value}).hash for key, value in changes.items())}) == 4
    assert scene_from_mapping(scene.data).hash == scene.hash


SLIDER, GUIDE, BOTH = (f"contact.youngs_modulus{partner}" for partner in (".slider", ".guide", ""))


def repeat(scene):
    """Load the scene of its command as a shell and the command line read it."""
    sixbar, verb, source, *options = shlex.split(scene.command("plan"))
    assert (sixbar, verb, set(options[::2])) == ("sixbar", "plan", {"--set"} if options else set())
    return load_scene(source, parse_set(options[1::2]))


@pytest.mark.parametrize(
    ("first", "second"),
    [
        ({"drive.cycles": 2, "clearance.slider": 0.0078125}, {"drive.cycles": 1}),  # the first key is dropped
        ({"scene.title": 'it\'s "7" = #1\n\\n\u2028', "mechanism.rocker_pivot": [0.1, -1e-12]}, {}),
        ({"scene.description": "", "output": {"groups": ["energy", "joints"]}}, {"scene.title": ""}),
        ({"solver.exudyn": {"formulation": "tree", "tolerance": 1e-10}}, {SLIDER: 50e9}),
        ({SLIDER: 69e9, BOTH: 50e9}, {GUIDE: 210e9}),
        ({GUIDE: 50e9}, {BOTH: 69e9, "joints.slider": "clearance"}),
    ],
)
def test_the_command_of_a_scene_repeats_it_and_python_does_as_the_command_line_does(first, second):
    scene = load_scene(PAPER, first).with_values(second)
    copy = repeat(scene)
    assert (copy.hash, copy.overrides) == (scene.hash, scene.overrides)
    assert (copy.name, copy.title, copy.description) == (scene.name, scene.title, scene.description)
    assert (scene.name == PAPER) == all(key.startswith("scene.") for key in scene.overrides)
    assert re.fullmatch(r"[A-Za-z0-9._+=-]{1,100}", scene.name)  # a folder, everywhere
    if not {SLIDER, BOTH, GUIDE} & {*first, *second}:  # a later one of these replaces another
        assert load_scene(PAPER, first | second).name == scene.name


def test_what_is_changed_is_in_the_title_and_nothing_false_is_said():
    changes = {"clearance.slider": 4e-4, BOTH: 69e9, "joints.slider": "ideal"}
    variant = load_scene(PAPER, changes)
    assert variant.title == (
        "150rpm-0.2mm with clearance.slider = 0.4 mm, contact.youngs_modulus = 69 GPa, joints.slider = ideal"
    )
    # A value that the scene has already is no change, nor is one that is changed back.
    same = load_scene(PAPER, {"clearance.slider": 2e-4, "drive.speed_rpm": 150, "drive": {"cycles": 2}})
    back = variant.with_values({"clearance": {"slider": 2e-4}, BOTH: 210e9})
    for scene in (same, back.with_values({"joints.slider": "clearance"})):
        assert (scene.overrides, scene.data) == ({}, load_scene(PAPER).data)
        assert scene.command("run", "--out", "a b.csv") == "sixbar run 150rpm-0.2mm --out 'a b.csv'"


def test_a_file_that_extends_another_has_texts_of_its_own(tmp_path):
    path = tmp_path / "my press.toml"
    path.write_text('[scene]\nname = "own"\nextends = "150rpm-0.2mm"\n')
    scene = load_scene(path)
    assert (scene.name, scene.title, scene.description, scene.overrides) == ("own", "own", "", {})
    variant = scene.with_values({"drive.cycles": 1})
    assert (variant.title, variant.description) == ("own with drive.cycles = 1", "")
    assert repeat(variant).hash == variant.hash  # the path has a space


def test_a_run_at_another_setting_keeps_the_name_and_its_command_has_the_setting():
    scene = load_scene(PAPER, {"clearance.slider": 4e-4})
    finer = scene.variant({"solver.reference.tolerance": 1e-12})
    assert (finer.name, finer.title, finer.data["scene"]) == (scene.name, scene.title, scene.data["scene"])
    assert repeat(finer).hash == finer.hash != scene.hash


SETTABLE = [key for key in scene_keys() if "[]" not in key.name and not key.name.startswith("scene.")]
RULE = re.compile(r"(>=?|<=?) (\S+)")


def refusal(name, value):
    with pytest.raises(SceneError) as error:
        load_scene(PAPER, {name: value})
    return str(error.value)


def test_every_key_of_a_scene_is_listed_with_the_papers_value_and_described():
    values = flat({name: part for name, part in load_scene("paper").data.items() if name != "scene"})
    defaults = {key.name: key.default for key in scene_keys()}
    assert len(defaults) == len(scene_keys())
    for name, value in values.items():
        assert defaults[name] == (None if name == "initial.slider_offset" else value), name
    for key in scene_keys():
        assert re.fullmatch(r"[A-Z][^\n]{3,110}\.", key.description), key
    units = {key.name: key.unit for key in scene_keys()}
    assert units["reliability.velocity.upper"] == "m/s"  # that of its section


@pytest.mark.parametrize(
    "key", [key for key in SETTABLE if RULE.search(key.bounds)], ids=lambda key: key.name
)
def test_what_is_outside_the_listed_bounds_is_refused_with_them(key):
    for sign, bound in RULE.findall(key.bounds.replace(",", "")):
        value = float(bound) + (0 if "=" not in sign else -1 if sign == ">=" else 1)
        if "integer" in key.bounds:
            value = int(value) + (sign == "<=") * int(float(bound))  # 1e15 + 1 is more
        message = refusal(key.name, value)
        assert f"must be {sign} {bound}" in message
        assert f" {key.unit} must" in message or not key.unit


def test_the_listed_choices_are_all_that_is_taken():
    keys = [key for key in SETTABLE if " | " in key.bounds and "branch" not in key.name]
    assert "contact.law" in [key.name for key in keys]
    for key in keys:
        for choice in key.bounds.split(" | "):
            assert load_scene(PAPER, {key.name: choice})
            assert f"'{choice}'" in refusal(key.name, "?")


STEP, LAW, STIFFNESS = "solver.exudyn.step", "contact.law", "contact.stiffness"
EXPONENT, MODULUS = "contact.exponent", "contact.youngs_modulus"


@pytest.mark.parametrize(
    ("name", "changes", "words"),
    [
        (PAPER, {"initial.slider_offset": -3e-4}, "the slider starts inside the wall"),
        (PAPER, {"initial.slider_angle": 5.0}, "puts a corner 0.016 m inside the wall, deeper than"),
        (PAPER, {STEP: 2.5e-5}, "contacts of 0.00016 s require at most 2.1e-05 s"),
        ("crank-pin", {STEP: 1e-5}, "solver.exudyn.step = 1e-05 s is outside the asymptotic range"),
        (PAPER, {"clearance.slider": 0.3}, "(width 0.05 m, length 0.07 m) turn over in its guide"),
        (PAPER, {"clearance.slider": 3e-3}, "(width 0.05 m, length 0.07 m) tilt by 4.9 degrees in"),
        ("crank-pin", {"clearance.crank_pin": 0.2}, "0.2 m is large for clearance.journal_radius = 0.01 m"),
        (PAPER, {"contact.corner_radius": 0.03}, "0.03 m is larger than half the slider (width 0.05 m"),
        ("ideal", {"drive.speed_rpm": 1e30}, "its unit is turns a minute"),
        (PAPER, {"drive.cycles": 0.75, "output.samples_per_cycle": 2}, "is 1.5 samples; 2 are run"),
        ("four-bar", {"drive.cycles": 0.7777}, "is 777.7 samples; 778 are run"),
        (PAPER, {MODULUS: 210.0}, "210 Pa is softer than rubber"),
        (PAPER, {f"{MODULUS}.guide": 2.1e14}, "2.1e+14 Pa is stiffer than diamond"),
        (PAPER, {"friction.coefficient": 15.0}, "it is no percentage"),
        (PAPER, {"environment.gravity": 9810.0}, "9810 m/s^2 is more than ten times the Earth's"),
        # As Table 1 prints it
        (PAPER, {"mechanism.crank.centroid": 0.225}, "is farther out than the rod's end, 0.045 m"),
        (PAPER, {"mechanism.slider.inertia": 26.3}, "exceeds mass times size squared, 0.0013 kg m^2"),
        (PAPER, {"load.force": 500.0, "load.surface": -31.8}, "-31.8 m is beyond the linkage, 1.365 m"),
        (PAPER, {"load.depth": 0.01}, "has no effect without load.force or load.table"),
        ("workpiece", {"load.depth": 3.0}, "3 m is as large as the linkage, 1.365 m"),
        (PAPER, {STIFFNESS: 1e9}, "has no effect under contact.law = 'hertz-corners'"),
        (PAPER, {LAW: "adams-impact", STIFFNESS: 1e9, MODULUS: 210.0}, "effect beside contact.stiffness"),
        # No warning: an ideal slider's values, a tree's largest step, a counterweight, the journal's law
        ("ideal", {"initial.slider_offset": -3e-4, STIFFNESS: 1e9, STEP: 1e-4}, ""),
        ("crank-pin", {"clearance.slider": 0.3, LAW: "foundation", EXPONENT: 1.2}, ""),
        (PAPER, {"solver.exudyn.formulation": "auto", STEP: 1e-3, "mechanism.crank.centroid": -0.01}, ""),
        (PAPER, {STEP: 1.7e-5, "clearance.slider": 1e-3, "initial.slider_offset": 9e-4}, ""),
        ("adams-impact", {"contact.damping": 100.0, "contact.corner_radius": 2e-3}, ""),
    ],
)
def test_an_implausible_value_is_a_warning_with_its_reason(name, changes, words):
    warnings = load_scene(name, changes).warnings
    assert len(warnings) == bool(words), warnings
    assert words in "".join(warnings)
    if words:
        assert any(warnings[0].startswith(f"{key.removesuffix('.guide')} = ") for key in changes)


def test_no_shipped_scene_is_warned_of():
    assert not [load_scene(name).warnings for name in shipped_scenes() if load_scene(name).warnings]


def test_the_contact_time_is_that_of_the_short_contacts_of_a_run():
    """Half of it is below the shortest contact, the median of all is above it."""
    changes = {"drive.cycles": 0.3, "output.groups": [], EXPONENT: 1.2, f"{MODULUS}.slider": 69e9}
    scene = load_scene(PAPER, changes)
    events = reference_model.simulate(scene.data).events
    lengths = np.asarray(events["end"] - events["start"])[:-1]  # the last may be cut off
    assert 0.5 * lengths.min() < contact_time(scene) < np.median(lengths)
