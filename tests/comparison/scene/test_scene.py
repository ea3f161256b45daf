"""Scenes are complete, checked with one clear line, and hashed by what can change a result."""

from __future__ import annotations

import math
import pickle
from pathlib import Path

import pytest

from comparison.scene import SceneError, load_scene, scene_from_mapping, shipped_scenes
from comparison.scene.criteria import Reliability
from comparison.tables.channels import expected

PAPER = "150rpm-0.2mm"

AUTO = {"solver.exudyn.formulation": "auto"}


ASKED_FOR_FORCES = {"formulation": "full", "method": "auto", "step": 2e-6, "tolerance": 1e-7}


def write(folder: Path, name: str, text: str) -> Path:
    path = folder / f"{name}.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_every_shipped_scene_loads_and_the_base_is_not_among_them():
    assert "paper" not in shipped_scenes()
    assert {
        "150rpm-0.2mm",
        "300rpm-0.2mm",
        "90rpm-0.1mm",
        "90rpm-0.5mm",
        "69GPa",
        "poisson-0.33",
        "ideal",
    } <= set(shipped_scenes())
    assert shipped_scenes() == sorted(shipped_scenes())
    for name in shipped_scenes():
        scene = load_scene(name)
        assert scene.name == name
        assert scene.title
        assert not scene.warnings


def test_the_mapping_is_complete_and_plain():
    data = load_scene(PAPER).data
    assert set(data) == {
        "scene", "mechanism", "drive", "initial", "joints", "clearance", "contact", "friction", "environment",
        "output", "solver",
    }  # fmt: skip
    assert data["initial"]["slider_offset"] == data["mechanism"]["reference_offset"] == 5e-5
    assert data["solver"]["reference"]["tolerance"] == 1e-10
    assert data["solver"]["exudyn"] == {
        "formulation": "full",
        "method": "auto",
        "step": 2e-6,
        "tolerance": 1e-7,
    }
    assert type(data["mechanism"]["rod4"]) is dict
    assert type(load_scene(PAPER, {"drive.speed_rpm": 210}).data["drive"]["speed_rpm"]) is float


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
def test_exudyn_left_open_integrates_no_more_than_what_is_asked_for(changes, formulation):
    auto = load_scene(
        "crank-pin", {"joints.crank_pin": "ideal", "joints.slider": "clearance"} | changes | AUTO
    )
    named = auto.with_values({"solver.exudyn.formulation": formulation})
    steps = [of.data["solver"]["exudyn"]["step"] for of in (auto, named)]
    assert auto.data["solver"]["exudyn"] | {"step": steps[1]} == named.data["solver"]["exudyn"]
    # The steps that the file gives five bodies are not the tree's, nor are those of a run that asks for more;
    # named, as in the file, the five bodies have the file's.
    assert steps == {"tree": [1e-4, 1e-4], "full": [2e-6, 2.5e-7]}[formulation]
    more = auto.with_values({"output.groups": ["joints"], "solver.exudyn.method": "auto"})
    assert more.data["solver"]["exudyn"] == ASKED_FOR_FORCES


def test_settings_that_are_left_open_follow_the_formulation():
    tree = load_scene(PAPER, {"solver.exudyn.formulation": "tree"})
    assert tree.data["solver"]["exudyn"] | {"method": ""} == {
        "formulation": "tree",
        "method": "",
        "step": 1e-4,
        "tolerance": 1e-10,
    }
    back = tree.with_values({"solver.exudyn.formulation": "full", "solver.exudyn.step": 1e-6})
    assert back.data["solver"]["exudyn"]["tolerance"] == 1e-7
    of_five_bodies = load_scene("crank-pin")
    assert of_five_bodies.data["solver"]["exudyn"]["step"] == 2.5e-7
    assert (
        of_five_bodies.with_values({"solver.exudyn.formulation": "tree"}).data["solver"]["exudyn"]
        == tree.data["solver"]["exudyn"]
    )
    given = load_scene(PAPER, {"solver.exudyn.formulation": "tree", "solver.exudyn.tolerance": 1e-8})
    assert given.data["solver"]["exudyn"]["step"] == 1e-4
    assert given.data["solver"]["exudyn"]["tolerance"] == 1e-8


def test_the_start_follows_the_reference_offset_unless_it_is_given():
    moved = load_scene(PAPER).with_values({"mechanism.reference_offset": 0.0})
    assert moved.data["initial"]["slider_offset"] == 0.0
    fixed = load_scene(PAPER, {"initial.slider_offset": 1e-5}).with_values(
        {"mechanism.reference_offset": 0.0}
    )
    assert fixed.data["initial"]["slider_offset"] == 1e-5


@pytest.mark.parametrize(
    ("key", "value", "line"),
    [
        ("clearance.slider", -1e-4, "clearance.slider = -0.0001 m must be >= 0"),
        ("clearance.slider", 0, "clearance.slider = 0.0 m must be > 0 where joints.slider = 'clearance'"),
        ("clearance.slidr", 1, "clearance.slidr is not a known key; did you mean clearance.slider?"),
        ("drive.speed_rpm", 0, "drive.speed_rpm = 0.0 rpm must not be zero"),
        ("drive.speed_rpm", True, "drive.speed_rpm = True must be a number"),
        ("drive.speed_rpm", "fast", "drive.speed_rpm = 'fast' must be a number"),
        ("drive.speed_rpm", math.nan, "drive.speed_rpm = nan rpm must be finite"),
        ("drive.cycles", math.inf, "drive.cycles = inf must be finite"),
        ("drive", 5, "drive = 5 must be a section with keys of its own"),
        ("mechanism.rod4.mass", 0.0, "mechanism.rod4.mass = 0.0 kg must be > 0"),
        ("mechanism.rocker_pivot", [1.0], "mechanism.rocker_pivot = [1.0] must hold 2 values, not 1"),
        ("mechanism.slider_branch", 0, "mechanism.slider_branch = 0 must be -1 or 1"),
        ("contact.law", "hertz", "contact.law = 'hertz' must be 'hertz-corners', 'paper-switching'"),
        ("contact.law", "strip",
         "contact.law = 'strip' is gone: the continuous law of a whole side is 'foundation'"),
        ("solver.exudyn.formulation", "native", "solver.exudyn.formulation = 'native' is gone: "),
        ("contact.poisson", 0.6, "contact.poisson = 0.6 must be <= 0.5"),
        ("contact.poisson.slider", -1.0, "contact.poisson.slider = -1.0 must be > -1"),
        ("contact.youngs_modulus.guide", 0.0, "contact.youngs_modulus.guide = 0.0 Pa must be > 0"),
        ("contact.youngs_modulus.slider", "soft", "contact.youngs_modulus.slider = 'soft' must be a number"),
        ("contact.youngs_modulus.slidr", 1e9,
         "contact.youngs_modulus.slidr is not a known key; did you mean contact.youngs_modulus.slider?"),
        ("contact.youngs_modulus", {}, "contact.youngs_modulus.slider is missing"),
        ("contact.poisson", [0.28, 0.3], "contact.poisson = [0.28, 0.3] must be a number"),
        ("contact.restitution", 1.1, "contact.restitution = 1.1 must be <= 1"),
        ("friction.transition_speed", 1e-5,
         "friction.transition_speed = 1e-05 m/s must be > friction.static_speed = 0.0001 m/s"),
        ("output.samples_per_cycle", 10.5, "output.samples_per_cycle = 10.5 must be an integer"),
        ("output.groups", ["corners", "corners"], "must not contain a group twice"),
        ("drive.cycles", 1e9, "must give 1 to 100000000 samples, not 1e+12"),
        ("initial.slider_angle", math.inf, "initial.slider_angle = inf rad must be finite"),
        ("solver.exudyn.step", -1e-6, "solver.exudyn.step = -1e-06 s must be > 0"),
        ("reliability.velocity.lower", 0.5,
         "reliability.velocity.lower = 0.5 m/s must be < upper = 0.02 m/s"),
        ("reliability.acceleration.upper", 0, "reliability.acceleration.upper = 0 m/s^2 must be > 0"),
        ("reliability.bins", 0, "reliability.bins = 0 must be >= 1"),
        ("reliability.errors", "squared", "reliability.errors = 'squared' must be 'signed' or 'absolute'"),
        ("scene.name", "a/b", "it names files"),
        ("weather.wind", 1, "weather is not a known key"),
    ],
)  # fmt: skip
def test_a_bad_value_is_refused_in_one_line_with_key_value_unit_and_rule(key, value, line):
    with pytest.raises(SceneError) as refused:
        load_scene(PAPER, {key: value})
    message = str(refused.value)
    assert message.startswith("scene ")
    assert line in message
    assert "\n" not in message


def test_a_missing_number_is_named(tmp_path):
    path = write(tmp_path, "bare", "[drive]\nspeed_rpm = 10.0\ncycles = 1.0\n")
    with pytest.raises(SceneError, match=r"^scene 'bare': mechanism is missing \(scene\.extends"):
        load_scene(path)


def test_extends_takes_numbers_but_not_texts_and_may_be_a_path_relative_to_the_file(tmp_path):
    (tmp_path / "inner").mkdir()
    write(tmp_path, "base", '[scene]\ntitle = "Base"\nextends = "paper"\n[drive]\nspeed_rpm = 33.0\n')
    path = write(
        tmp_path / "inner", "child", '[scene]\nextends = "../base.toml"\n[clearance]\nslider = 0.3e-3\n'
    )
    scene = load_scene(path)
    assert (scene.name, scene.title) == ("child", "child")
    assert scene.data["drive"] == {"speed_rpm": 33.0, "cycles": 2.0}
    assert scene.data["clearance"]["slider"] == 0.3e-3


def test_a_circle_of_extends_is_refused(tmp_path):
    write(tmp_path, "a", '[scene]\nextends = "b.toml"\n')
    write(tmp_path, "b", '[scene]\nextends = "a.toml"\n')
    with pytest.raises(SceneError, match=r"is circular: a\.toml -> b\.toml -> a\.toml"):
        load_scene(tmp_path / "a.toml")


@pytest.mark.parametrize("content", [b"[drive\n", b"\xff\xfe"])
def test_a_file_that_cannot_be_read_is_one_line(tmp_path, content):
    path = tmp_path / "broken.toml"
    path.write_bytes(content)
    with pytest.raises(SceneError, match=r"^scene 'broken': .*broken\.toml is not .*$"):
        load_scene(path)


def test_an_unknown_name_suggests_the_nearest():
    with pytest.raises(SceneError, match="did you mean '69GPa'"):
        load_scene("69Gpa")


def test_the_hash_sees_numbers_and_not_texts():
    scene = load_scene(PAPER)
    assert scene.hash == load_scene(PAPER, {"drive.speed_rpm": 150, "scene.title": "other"}).hash
    assert scene.hash == load_scene(PAPER, {"compare.tolerance": 1e-3}).hash
    assert scene.hash == load_scene(PAPER, {"reliability.bins": 36}).hash
    changed = {
        scene.with_values({key: value}).hash
        for key, value in {"drive.speed_rpm": -150, "solver.exudyn.step": 1e-6, "output.groups": []}.items()
    }
    assert scene.hash not in changed
    assert len(changed) == 3


def test_a_scene_survives_its_mapping_and_the_way_to_a_worker():
    scene = load_scene(PAPER, {"drive.speed_rpm": 77.7})
    assert scene_from_mapping(scene.data).hash == scene.hash
    assert pickle.loads(pickle.dumps(scene)).hash == scene.hash  # noqa: S301


def test_with_values_checks_again_and_leaves_the_scene_as_it_was():
    scene = load_scene(PAPER)
    before = scene.hash
    with pytest.raises(SceneError, match="must not be zero"):
        scene.with_values({"drive.speed_rpm": 0})
    assert scene.with_values({"drive.speed_rpm": 210}).period == pytest.approx(60 / 210, rel=1e-15)
    assert scene.hash == before


def test_a_start_inside_the_wall_is_a_warning_and_only_with_clearance():
    assert "starts inside the wall" in load_scene(PAPER, {"initial.slider_offset": -3e-4}).warnings[0]
    assert not load_scene("ideal", {"initial.slider_offset": -3e-4}).warnings


def test_a_step_outside_the_range_in_which_errors_fall_with_it_is_reported():
    (warning,) = load_scene(PAPER, {"solver.exudyn.step": 2.5e-5}).warnings
    assert "solver.exudyn.step = 2.5e-05 s is outside the asymptotic range" in warning
    for changes in ({"solver.exudyn.step": 2e-5}, AUTO | {"solver.exudyn.step": 1e-3}):
        assert not load_scene(PAPER, changes).warnings
    assert not load_scene("ideal", {"solver.exudyn.step": 1e-4}).warnings


def test_the_limits_that_a_scene_may_leave_open_are_those_of_the_base_scene():
    assert load_scene("paper").reliability == Reliability()


def test_the_sections_on_comparison_and_reliability_do_not_reach_the_models():
    scene = load_scene(PAPER, {"compare.tolerance": 1e-3, "reliability.velocity.upper": 0.5})
    assert scene.reliability.velocity.upper == 0.5
    assert "reliability" not in scene.data
    assert scene.tolerance == 1e-3
    assert "compare" not in scene.data


def test_the_duration_is_that_of_the_last_sample():
    scene = load_scene(PAPER, {"drive.cycles": 0.3334, "output.samples_per_cycle": 100})
    assert scene.duration == pytest.approx(33 * 0.004, rel=1e-15)


def test_an_ideal_slider_has_no_corner_channels():
    asked = expected(load_scene("ideal", {"output.groups": ["corners"]}).data)
    assert asked == ["slider_x", "slider_y", "slider_angle", "slider_vx", "slider_vy", "slider_omega"]
    assert len(expected(load_scene(PAPER).data)) == 6 + 3 + 12


def test_a_journal_has_channels_where_the_crank_pin_has_clearance():
    journal = ["journal_x", "journal_y"]
    pin, both = (
        load_scene(name, {"output.groups": ["corners"]}).data for name in ("crank-pin", "both-clearances")
    )
    assert expected(pin)[6:] == journal
    assert len(expected(both)) == 6 + 2 + 12
    assert set(journal) <= set(expected(both))
    assert not set(journal) & set(expected(load_scene(PAPER).data))


def test_every_group_has_its_channels_and_the_guide_reacts_only_on_an_ideal_slider():
    groups = {"output.groups": ["joints", "energy"]}
    assert len(expected(load_scene("ideal", groups).data)) == 6 + (12 + 1 + 2) + 7
    assert len(expected(load_scene(PAPER, groups).data)) == 6 + (12 + 1) + 7
