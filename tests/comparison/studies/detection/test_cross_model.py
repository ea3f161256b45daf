"""Both models against each other: what is drawn, where drawing stops, and how it is counted."""

from __future__ import annotations

from math import radians

import numpy as np
import pytest

from comparison.accuracy.levels import tight
from comparison.models import MODELS
from comparison.scene import load_scene
from comparison.studies.detection.changes import AT_CRANK_PIN, AT_SLIDER, BOTH, MOST_KEYS, changed
from comparison.studies.detection.cross_model import (
    KINDS,
    MOST,
    Draw,
    Kind,
    moved,
    sample,
    scenes_with_clearance,
)
from comparison.studies.detection.rates import Counts, count, upper_limit
from comparison.studies.detection.rounding import ROUNDINGS
from comparison.studies.shared.scenes import leaves

AGREE, DIFFER, INDETERMINATE = ({"verdict": verdict} for verdict in ("agree", "differ", "indeterminate"))


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.label)
def test_a_draw_is_a_shipped_scene_with_its_own_cycles_and_its_start_moved(kind):
    names = scenes_with_clearance()
    assert "ideal" not in names
    assert {"crank-pin", "both-clearances", "wedge", "90rpm-0.5mm"} <= set(names)
    drawn = [Draw(kind, ROUNDINGS[2], number).pair for number in range(len(names))]
    # The scenes follow one another in a circle, which each variant enters at another place.
    circle = [names[(number + 2) % len(names)] for number in range(len(names))]
    assert [pair.scene.source for pair in drawn] == circle
    for pair in drawn:
        shipped = load_scene(pair.scene.source)
        if kind.tier == "tight":
            shipped = tight(shipped, MODELS)
        before, after = leaves(shipped.data), leaves(pair.scene.data)
        different = {key for key in after if after[key] != before[key] and not key.startswith("scene.")}
        pin_alone = shipped.data["joints"]["slider"] == "ideal"
        start = (
            {"mechanism.crank_angle_deg"} if pin_alone else {"initial.slider_offset", "initial.slider_angle"}
        )
        assert start <= different
        assert len(different - start) <= (MOST_KEYS if kind.changed else 0)
        assert [side.model for side in pair.sides] == list(MODELS)
        assert {side.scene.hash for side in pair.sides} == {pair.scene.hash}
        assert pair.tier == kind.tier
        assert pair.environment == ROUNDINGS[2].environment != ()


@pytest.mark.parametrize("name", ["150rpm-0.2mm", "crank-pin", "both-clearances", "surface"])
def test_one_to_three_keys_that_the_scene_uses_are_changed_and_each_at_some_time(name):
    scene, rng = load_scene(name), np.random.default_rng(2)
    before, counts, seen = leaves(scene.data), set(), set()
    for _ in range(400):
        after = leaves(changed(scene, rng).data)
        different = {key for key in after if after[key] != before[key] and not key.startswith("scene.")}
        counts.add(len(different))
        seen |= different
    assert counts == {1, 2, 3}
    joints = scene.data["joints"]
    drawn = BOTH | (AT_SLIDER if joints["slider"] == "clearance" else {})
    assert seen == set(drawn | (AT_CRANK_PIN if joints["crank_pin"] == "clearance" else {}))


def test_no_two_draws_have_the_same_start_and_every_one_can_be_repeated():
    draws = [Draw(kind, rounding, number) for kind in KINDS for rounding in ROUNDINGS for number in (0, 1, 9)]
    scenes = [draw.pair.scene for draw in draws]
    starts = {(scene.name, *scene.data["initial"].values(), scene.data["mechanism"]["crank_angle_deg"])
              for scene in scenes}  # fmt: skip
    assert len(starts) == len(draws)
    assert [draw.pair.identity for draw in draws] == [draw.pair.identity for draw in draws]


@pytest.mark.parametrize("name", ["150rpm-0.2mm", "wedge", "both-clearances", "crank-pin"])
def test_starts_fill_the_disc_of_two_percent_of_the_clearance(name):
    scene, rng = load_scene(name), np.random.default_rng(1)
    start, mechanism = scene.data["initial"], scene.data["mechanism"]
    distances = []
    for _ in range(200):
        data = moved(scene, 0.02, rng).data
        if name == "crank-pin":
            turned = radians(data["mechanism"]["crank_angle_deg"] - mechanism["crank_angle_deg"])
            way = [turned * mechanism["crank"]["length"] / data["clearance"]["crank_pin"], 0.0]
        else:
            offset, angle = (data["initial"][key] - start[key] for key in ("slider_offset", "slider_angle"))
            way = np.array([offset, angle * mechanism["slider"]["length"]]) / data["clearance"]["slider"]
        distances.append(np.hypot(*way))
    # An angle of 111 deg has a last digit of 1.4e-14 deg: 1e-17 m at the crank, 1e-11 of 2 % of 0.1 mm.
    assert max(distances) <= 0.02 * (1 + 1e-9)
    assert max(distances) > 0.018
    # Uniform on the disc: half of the starts are within 0.71 of its radius; on the line, half of it.
    assert np.median(distances) / 0.02 == pytest.approx(0.5 if name == "crank-pin" else 0.707, abs=0.1)


def found_by(verdicts):
    """Give each draw a verdict by its number, and keep what was asked for."""
    asked = []

    def find(draws):
        asked.append([(draw.rounding.name, draw.number) for draw in draws])
        return [verdicts(draw) for draw in draws]

    return find, asked


def test_drawing_stops_when_each_variant_has_its_share_of_decided_ones():
    kind = Kind("both models, tight", "tight", 30)
    find, asked = found_by(lambda draw: INDETERMINATE if draw.number in (0, 10) else AGREE)
    drawn = sample(kind, ROUNDINGS[:3], find)
    for rounding in ROUNDINGS[:3]:
        found = drawn[rounding]
        assert len(found) == 12  # ten decided, number 0, and number 10, which replaced it
        assert count(found).decided == 10
        assert found[0] == found[10] == INDETERMINATE
        assert [number for at in asked for name, number in at if name == rounding.name] == list(range(12))


def test_drawing_ends_at_its_limit_where_too_little_is_decided():
    kind = Kind("both models, tight", "tight", 30)
    find, asked = found_by(lambda draw: AGREE if draw.number % 2 else INDETERMINATE)
    (found,) = sample(kind, ROUNDINGS[:1], find).values()
    assert len(found) == 38  # 1.25 times 30, rounded up
    assert MOST * 30 <= len(found) < MOST * 30 + 1
    assert sum(map(len, asked)) == len(found)


def test_a_share_that_does_not_divide_is_rounded_up():
    find, _ = found_by(lambda _: DIFFER)
    drawn = sample(Kind("both models, tight", "tight", 10), ROUNDINGS[:4], find)
    assert [len(found) for found in drawn.values()] == [3, 3, 3, 3]  # a difference is decided as well


def test_the_wanted_number_leaves_room_for_one_alarm_at_the_tight_tier():
    by_tier = {kind.tier: kind for kind in KINDS}
    assert upper_limit(1, by_tier["tight"].wanted) <= 0.01
    assert by_tier["standard"].wanted >= 100


def test_counts_of_verdicts_without_a_fault():
    corrected = AGREE | {"confirmation": {"outcome": "underestimated"}}
    underestimated = INDETERMINATE | {"confirmation": {"outcome": "underestimated"}}
    confirmed = DIFFER | {"confirmation": {"outcome": "confirmed"}}
    refused = {"verdict": "cannot compare"}
    counts = count([AGREE, AGREE, corrected, underestimated, INDETERMINATE, confirmed, DIFFER, refused])
    assert counts == Counts(draws=8, indeterminate=2, underestimated=1, alarms=3)
    assert counts.decided == 6
    assert counts.upper_limit == upper_limit(3, 6)
