"""Scenes are complete, and hashed by what can change a result (tests/cli has how they are refused)."""

import pickle

import pytest

from comparison.scene import load_scene, parse_set, scene_from_mapping

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
    shorter = scene.with_values({"drive.cycles": 0.3334, "output.samples_per_cycle": 100})
    assert shorter.duration == pytest.approx(33 * 60 / 21000, rel=1e-15)  # one rounding
    assert scene.period == pytest.approx(60 / 210, rel=1e-15)


@pytest.mark.parametrize(
    ("changes", "formulation"),
    [
        ({}, "tree"),
        ({"joints.crank_pin": "clearance", "joints.slider": "ideal"}, "tree"),
        ({"joints.slider": "ideal"}, "full"),
        ({"output.groups": ["accelerations", "joints"]}, "full"),
        ({"solver.exudyn.method": "generalized-alpha"}, "full"),
    ],
)
def test_exudyn_left_open_integrates_no_more_than_what_is_requested(changes, formulation):
    usual = {"joints.crank_pin": "ideal", "joints.slider": "clearance", FORMULATION: "auto"}
    auto = load_scene("crank-pin", usual | changes)
    named = auto.with_values({FORMULATION: formulation})
    # The steps that the file gives five bodies are not the tree's, nor are those of a run that requests more;
    # named, as in the file, the five bodies have the file's.
    steps = [exudyn(scene)["step"] for scene in (auto, named)]
    assert steps == {"tree": [1e-4, 1e-4], "full": [2e-6, 2.5e-7]}[formulation]
    assert exudyn(auto) | {"step": steps[1]} == exudyn(named)


def test_settings_and_a_start_that_are_left_open_follow_what_is_changed():
    tree = load_scene(PAPER, {FORMULATION: "tree"})
    assert exudyn(tree) == exudyn(load_scene("crank-pin").with_values({FORMULATION: "tree"})) == TREE
    back = tree.with_values({FORMULATION: "full", "solver.exudyn.step": 1e-6})
    assert exudyn(back) == FULL | {"step": 1e-6}
    own = load_scene(PAPER, {"solver.exudyn.tolerance": 1e-8, FORMULATION: "tree"})
    assert exudyn(own) == TREE | {"tolerance": 1e-8}
    for given, offset in ({}, 0.0), ({"initial.slider_offset": 1e-5}, 1e-5):
        moved = load_scene(PAPER, given).with_values({"mechanism.reference_offset": 0.0})
        assert moved.data["initial"]["slider_offset"] == offset


def test_set_reads_toml_values_and_takes_bare_words_as_text():
    known = {"a.b": 1, "c": 2e-9, "d": [1, 2], "e": True, "f": "ideal", "g": "x y", "h": "a=b"}
    assert parse_set(["a.b=1", "c=2e-9", "d=[1, 2]", "e=true", "f=ideal", "g='x y'", "h=a=b"]) == known
    # A line break must not smuggle in a second key.
    assert parse_set(["a=1\nb=2"]) == {"a": "1\nb=2"}


def test_the_hash_sees_numbers_and_not_texts():
    scene = load_scene(PAPER, {"drive.speed_rpm": 77.7})
    same = {"scene.title": "other", "compare.tolerance": 1e-3, "reliability.bins": 36}
    assert scene.with_values(same).hash == scene.hash
    changes = {"drive.speed_rpm": -77.7, "solver.exudyn.step": 1e-6, "output.groups": []}
    assert len({scene.hash, *(scene.with_values({key: value}).hash for key, value in changes.items())}) == 4
    # It survives its mapping and the way to a worker.
    assert scene_from_mapping(scene.data).hash == scene.hash
    assert pickle.loads(pickle.dumps(scene)).hash == scene.hash  # noqa: S301
