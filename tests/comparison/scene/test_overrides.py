"""Values of keys as they are given on the command line."""

from __future__ import annotations

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from comparison.scene import SceneError, load_scene, parse_set

PAPER = "150rpm-0.2mm"


def test_set_reads_toml_values_and_takes_bare_words_as_text():
    assert parse_set(["a.b=1", "c=2e-9", "d=[1, 2]", "e=true", "f=ideal", "g='x y'", "h=a=b"]) == {
        "a.b": 1, "c": 2e-9, "d": [1, 2], "e": True, "f": "ideal", "g": "x y", "h": "a=b",
    }  # fmt: skip
    # A line break must not smuggle in a second key.
    assert parse_set(["a=1\nb=2"]) == {"a": "1\nb=2"}


@pytest.mark.parametrize("text", ["drive.speed_rpm", "=3", "a..b=1"])
def test_set_without_key_or_value_is_refused(text):
    with pytest.raises(SceneError, match="must be key=value"):
        parse_set([text])


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_any_number_given_on_the_command_line_arrives_bit_for_bit(value):
    assert parse_set([f"x={value!r}"]) == {"x": value}


ANY_KEY = st.sampled_from(["drive", "clearance.slider", "contact.law", "output.groups", "scene"])


ANY_SCALAR = st.one_of(st.none(), st.booleans(), st.integers(), st.floats(), st.text(max_size=5))


ANY_VALUE = st.one_of(ANY_SCALAR, st.lists(ANY_SCALAR, max_size=3))


@given(st.dictionaries(ANY_KEY, ANY_VALUE, min_size=1))
def test_whatever_is_given_the_scene_is_valid_or_refused_in_one_line(values):
    try:
        outcome = f"clearance {load_scene(PAPER, values).data['clearance']['slider']}"
    except SceneError as error:
        outcome = str(error)
    assert re.fullmatch(r"clearance [0-9][^\n]*|scene [^\n]*", outcome)
