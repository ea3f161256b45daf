"""The list of keys is that of the schema (tests/cli has which key a wrong name leads to)."""

import re

import pytest

from comparison.scene import SceneError, load_scene
from comparison.scene.keys import flat, scene_keys

SETTABLE = [key for key in scene_keys() if "[]" not in key.name and not key.name.startswith("scene.")]
RULE = re.compile(r"(>=?|<=?) (\S+)")


def refusal(name, value):
    with pytest.raises(SceneError) as error:
        load_scene("150rpm-0.2mm", {name: value})
    return str(error.value)


def test_every_key_of_a_scene_is_listed_with_the_papers_value_and_described():
    values = flat({name: part for name, part in load_scene("paper").data.items() if name != "scene"})
    listed = {key.name: key.default for key in scene_keys()}
    assert len(listed) == len(scene_keys())
    for name, value in values.items():
        assert listed[name] == (None if name == "initial.slider_offset" else value), name
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
    for key in SETTABLE:
        if " | " in key.bounds and "branch" not in key.name:
            for choice in key.bounds.split(" | "):
                assert load_scene("150rpm-0.2mm", {key.name: choice})
            assert all(f"'{choice}'" in refusal(key.name, "?") for choice in key.bounds.split(" | "))
