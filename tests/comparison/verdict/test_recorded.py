"""The verdicts on record: written, read, and what is said where a scene's is another one."""

from __future__ import annotations

import tomllib
from dataclasses import replace

import pytest

from comparison.scene import load_scene
from comparison.verdict.compare import Runs, compare
from comparison.verdict.shipped import as_toml
from comparison.verdict.shipped import departures as departed
from comparison.words import verdicts as words

MADE = {"machine": 'A "x", numpy 2', "date": "2030-01-01"}


def departures(scenes, comparisons, record) -> str:
    return words.departures(departed(scenes, comparisons, record), record["made"])


@pytest.fixture
def found(scene, make_table):
    """The comparison of a scene at both tiers."""
    sides = [Runs(*(make_table(part * error) for part in (1, 0.25, 4, 4, 4))) for error in (1e-8, 2e-8)]
    usual, tight = (
        compare(*sides, scene=scene, labels=("reference", "exudyn"), tier=tier)
        for tier in ("standard", "tight")
    )
    return replace(usual, tight=tight)


def test_the_same_verdicts_are_not_reported(scene, found):
    record = tomllib.loads(as_toml([scene], [found], MADE))
    assert record["made"] == MADE
    assert departures([scene], [found], record) == ""


def test_another_verdict_is_reported_in_one_line_with_what_is_on_record(scene, found):
    record = tomllib.loads(as_toml([scene], [found], MADE))
    now = replace(found, tight=replace(found.tight, verdict="differ"))
    assert departures([scene, scene], [found, now], record) == (
        f'not the verdicts on record (on A "x", numpy 2; 2030-01-01): {scene.name}, tight: differ, not agree'
    )


def test_a_changed_scene_or_one_that_is_not_shipped_is_not_compared(scene, found):
    record = tomllib.loads(as_toml([scene], [found], MADE))
    now = replace(found, verdict="differ")
    assert departures([scene], [now], record) != ""
    changed = scene.variant({"contact.youngs_modulus": 1e9})  # under the name on record
    other = load_scene("wedge")
    assert departures([changed, other], [now, now], record) == ""


def test_a_tier_that_is_not_on_record_is_not_compared(scene, found):
    record = tomllib.loads(as_toml([scene], [replace(found, tight=None)], MADE))
    assert departures([scene], [found], record) == ""
