"""Scenes are complete, hashed by what can change a result, and refused in one line (tests/cli has more)."""

import pickle

import pytest

from comparison.scene import (
    Reliability,
    SceneError,
    load_scene,
    parse_set,
    scene_from_mapping,
    shipped_scenes,
)

PAPER = "150rpm-0.2mm"
FULL = {"formulation": "full", "method": "auto", "step": 2e-6, "tolerance": 1e-7}
TREE = {"formulation": "tree", "method": "auto", "step": 1e-4, "tolerance": 1e-10}
FORMULATION = "solver.exudyn.formulation"


def refused(name, changes=None):
    with pytest.raises(SceneError) as error:
        load_scene(name, changes)
    message = str(error.value)
    assert (message[:6], "\n" in message) == ("scene ", False)
    return message


def exudyn(scene):
    return scene.data["solver"]["exudyn"]


def test_every_shipped_scene_loads_and_the_base_is_not_among_them():
    assert {PAPER, "ideal"} <= set(shipped_scenes()) - {"paper"} == set(shipped_scenes())
    for name in shipped_scenes():
        scene = load_scene(name)
        assert (scene.name, scene.warnings, bool(scene.title)) == (name, (), True)


def test_the_mapping_is_complete_plain_and_without_the_criteria():
    scene = load_scene(PAPER, {"drive.speed_rpm": -210, "compare.tolerance": 1e-3, "reliability.bins": 36})
    data = scene.data
    assert data["initial"]["slider_offset"] == data["mechanism"]["reference_offset"] == 5e-5
    assert (data["solver"]["reference"]["tolerance"], data["solver"]["exudyn"]) == (1e-10, FULL)
    assert (type(data["mechanism"]["rod4"]), type(data["drive"]["speed_rpm"])) == (dict, float)
    assert not {"compare", "reliability", "random"} & set(data)
    assert (scene.compare.tolerance, scene.reliability.bins) == (1e-3, 36)
    assert load_scene("paper").reliability == Reliability()
    # The end is that of the last sample.
    shorter = scene.with_values({"drive.cycles": 0.3334, "output.samples_per_cycle": 100})
    assert shorter.duration == pytest.approx(33 * 60 / 21000, rel=1e-15)  # one rounding
    assert scene.period == pytest.approx(60 / 210, rel=1e-15)


@pytest.mark.parametrize(
    ("changes", "formulation"),
    [
        ({}, "tree"),
        ({"joints.crank_pin": "clearance"}, "tree"),
        ({"joints.crank_pin": "clearance", "joints.slider": "ideal"}, "tree"),
        ({"joints.slider": "ideal"}, "full"),
        ({"output.groups": ["accelerations", "joints"]}, "full"),
        ({"output.groups": ["energy"]}, "full"),
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
    more = auto.with_values({"output.groups": ["joints"], "solver.exudyn.method": "auto"})
    assert exudyn(more) == FULL


def test_clearance_is_that_of_the_joints_that_have_some():
    for name, loose in (("ideal", ()), (PAPER, ("slider",)), ("both-clearances", ("crank_pin", "slider"))):
        scene = load_scene(name)
        sizes = {joint: scene.data["clearance"][joint] for joint in loose}
        assert scene.loose == loose
        assert {joint: scene.clearance(joint) for joint in ("slider", "crank_pin")} == {
            "slider": 0.0, "crank_pin": 0.0, **sizes,
        }  # fmt: skip


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


EACH = "contact.youngs_modulus"


@pytest.mark.parametrize(
    ("key", "value", "line"),
    [
        # tests/cli/test_mistakes.py has more
        ("drive.speed_rpm", True, "drive.speed_rpm = True must be a number"),
        ("drive.cycles.x", 1, "drive.cycles = {'x': 1} must be a number"),
        ("solver", None, "solver = None must be a section with keys of its own"),
        ("mechanism.rocker_pivot", ["x", 1.0], "mechanism.rocker_pivot.0 = 'x' must be a number"),
        *(("mechanism.slider_branch", value, f"mechanism.slider_branch = {value!r} must be -1 or 1")
          for value in (True, 1.0, "1")),  # true is equal to 1, but not meant as such
        (f"{EACH}.guide", 0.0, f"{EACH}.guide = 0.0 Pa must be > 0"),
        (f"{EACH}.slidr", 1e9, f"{EACH}.slidr is not a known key; did you mean {EACH}.slider?"),
        (EACH, {}, f"{EACH}.slider is missing"),
        ("output.groups", ["corners", "corners"], "must not contain a group twice"),
        ("reliability.velocity.lower", 0.5, "reliability.velocity.lower = 0.5 m/s must be < upper = 0.02"),
        pytest.param("scene.name", 10**5000, "thousands of digits must be a string", id="digits"),
        ("a b.c", 1, "'a b' is not a known key"),
    ],
)  # fmt: skip
def test_a_bad_value_is_refused_in_one_line_with_key_value_unit_and_rule(key, value, line):
    assert line in refused(PAPER, {key: value})


@pytest.mark.parametrize(
    ("values", "line"),
    [
        ({"contact.law": "adams-impact"}, "contact.damping_model = 'flores' needs contact.law = 'hertz-corn"),
        ({"contact.restitution": 0.0}, "contact.restitution = 0.0 must be >= 0.01, by which"),
    ],
)
def test_a_damping_model_is_refused_where_it_has_no_meaning(values, line):
    assert line in refused(PAPER, {"contact.damping_model": "flores", **values})


BASE = '[scene]\nextends = "paper"\n'


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            BASE + '[[random]]\nkey = "a"\ndistribution = "normal"\ndeviation = 1.0\nelment = 1\n',
            "did you mean random[].element?",
        ),
        (f"{BASE}[drive]\ncycles = {'9' * 5000}\n", "cannot be read as TOML: Exceeds the limit"),
        (f"{BASE}[drive]\ncycles = 1e308\n", "must give 1 to 100000000 samples, not inf"),
        (f"{BASE}[drive]\nspeed_rpm = 1e-310\n", "last for ever"),
        (f'[scene]\nextends = "paper"\nname = "{"a" * 240}"\n', "must have at most 100 characters"),
        (f"{BASE}[{'.'.join('a' * 3000)}]\nb = 1\n", "is nested too deeply"),
        (BASE.replace("paper", "a" * 5000), "File name too long"),
        (BASE.replace('"paper"', "3"), "scene.extends = 3 must be a shipped name or a path"),
    ],
)
def test_a_scene_file_is_refused_in_one_line(text, message, tmp_path):
    path = tmp_path / "odd.toml"
    path.write_text(text)
    line = refused(path)
    assert message in line
    assert len(line) < 600 or "File name" in message


def test_extends_takes_numbers_but_not_texts_and_leads_over_so_many_files(tmp_path):
    for number in range(30):
        extends = f'[scene]\nextends = "{number + 1}.toml"\n[drive]\n'  # a section that changes nothing
        (tmp_path / f"{number}.toml").write_text(extends)
    assert "leads over more than 20 files" in refused(tmp_path / "0.toml")
    (tmp_path / "30.toml").write_text(
        '[scene]\ntitle = "Base"\nextends = "paper"\n[drive]\nspeed_rpm = 33.0\n'
    )
    scene = load_scene(tmp_path / "20.toml")
    assert (scene.name, scene.title, scene.data["drive"]["speed_rpm"]) == ("20", "20", 33.0)


def test_set_reads_toml_values_and_takes_bare_words_as_text():
    assert parse_set(["a.b=1", "c=2e-9", "d=[1, 2]", "e=true", "f=ideal", "g='x y'", "h=a=b"]) == {
        "a.b": 1, "c": 2e-9, "d": [1, 2], "e": True, "f": "ideal", "g": "x y", "h": "a=b",
    }  # fmt: skip
    # A line break must not smuggle in a second key.
    assert parse_set(["a=1\nb=2"]) == {"a": "1\nb=2"}
    for text in ("9" * 5000, "[" * 3000, "{a=" * 3000):  # what TOML cannot read
        assert parse_set([f"drive.cycles={text}"]) == {"drive.cycles": text}
    with pytest.raises(SceneError, match="must be key=value"):
        parse_set(["a..b=1"])


def test_the_hash_sees_numbers_and_not_texts():
    scene = load_scene(PAPER, {"drive.speed_rpm": 77.7})
    same = {"scene.title": "other", "compare.tolerance": 1e-3, "reliability.bins": 36}
    assert scene.with_values(same).hash == scene.hash
    changes = {"drive.speed_rpm": -77.7, "solver.exudyn.step": 1e-6, "output.groups": []}
    assert len({scene.hash, *(scene.with_values({key: value}).hash for key, value in changes.items())}) == 4
    # It survives its mapping and the way to a worker.
    assert scene_from_mapping(scene.data).hash == scene.hash
    assert pickle.loads(pickle.dumps(scene)).hash == scene.hash  # noqa: S301
