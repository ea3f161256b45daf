"""An instant by the crank's cycle and angle, and by the contact it lies in."""

from __future__ import annotations

import pandas as pd
import pytest

from comparison.scene import load_scene
from comparison.words.differences import contact, describe

EVENTS = pd.DataFrame(
    [
        ("ul", 0.010, 0.011),
        ("ll", 0.010, 0.012),
        ("ur", 0.020, 0.021),
        ("ll", 0.030, 0.031),
        ("pin", 0.040, 0.050),
        ("ll", 0.045, 0.046),
    ],
    columns=["corner", "start", "end"],
)
BOTH = "the first contact of the lower left corner and the first contact of the upper left corner"


@pytest.mark.parametrize(
    ("time", "words"),
    [
        (0.005, "before the first contact"),
        (0.0105, f"during {BOTH}"),
        (0.0115, "during the first contact of the lower left corner"),
        # Both touched together, so that both may have made what is seen.
        (0.015, f"after {BOTH}"),
        (0.025, "after the first contact of the upper right corner"),
        (0.0301, "during the second contact of the lower left corner"),
        (0.0455, "during the third contact of the lower left corner and the first contact of the crank pin"),
        (0.050, "during the first contact of the crank pin"),
    ],
)  # fmt: skip
def test_the_contact_in_progress_or_the_last_one_counted_by_corner(time, words):
    assert contact(time, EVENTS) == words
    assert contact(time, EVENTS.iloc[::-1]) == words  # whatever the order of the rows


def test_many_contacts_are_counted_in_figures():
    times = pd.Series(range(1, 123), dtype=float)
    events = pd.DataFrame({"corner": "lr", "start": times, "end": times + 0.5})
    counted = {n: contact(n + 0.1, events).split()[2] for n in (1, 10, 11, 12, 13, 21, 22, 103, 111, 122)}
    assert counted == {
        1: "first", 10: "tenth", 11: "11th", 12: "12th", 13: "13th", 21: "21st", 22: "22nd", 103: "103rd",
        111: "111th", 122: "122nd",
    }  # fmt: skip


def test_both_models_are_named_only_where_they_are_in_different_contacts():
    one, other = EVENTS, EVENTS.assign(corner="lr")
    same = describe(0.0201, {"a": one, "b": one.copy()}, period=None, scene=None)
    assert same == "0.0201 s, during the first contact of the upper right corner"
    assert describe(0.0201, {"a": one, "b": other}, period=None, scene=None) == (
        "0.0201 s, during the first contact of the upper right corner (a), "
        "during the third contact of the lower right corner (b)"
    )
    assert describe(0.0201, {"a": None, "b": one}, period=None, scene=None) == same
    assert describe(0.0201, {"a": None, "b": None}, period=None, scene=None) == "0.0201 s"


def test_cycle_and_angle_of_the_crank_follow_the_scene():
    start = {"mechanism.crank_angle_deg": 350.0}
    forwards = load_scene("150rpm-0.2mm", start).data
    backwards = load_scene("150rpm-0.2mm", start | {"drive.speed_rpm": -150.0}).data
    # 0.42 s at 0.4 s a cycle: 18 degrees into the second.
    assert describe(0.42, {}, period=0.4, scene=forwards) == "0.42 s (cycle 2, crank at 8°)"
    assert describe(0.42, {}, period=0.4, scene=backwards) == "0.42 s (cycle 2, crank at 332°)"
    assert describe(0.42, {}, period=0.4, scene=None) == "0.42 s (cycle 2, crank at 18°)"
