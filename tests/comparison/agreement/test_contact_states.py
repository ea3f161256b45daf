"""Contact situations of both results of a scene, where they mean something."""

from __future__ import annotations

import pandas as pd
import pytest

from comparison.execution.run import run_one
from comparison.metrics.contacts import SITUATIONS
from comparison.scene import load_scene
from comparison.tables.table import Table
from comparison.verdict.compare import Runs, compare
from comparison.words.record import as_mapping

# Shares are sums of at most some ten quotients of binary fractions: a few units of the last place.
EXACT = {"rel": 0, "abs": 1e-15}


def contacts(*rows: tuple[str, float, float]) -> pd.DataFrame:
    quantities = dict.fromkeys(("normal_speed", "impulse", "peak_force", "largest_depth"), 0.0)
    return pd.DataFrame(rows, columns=["corner", "start", "end"]).assign(**quantities)


def test_the_shares_of_both_results_stand_in_the_numbers(make_table, scene):
    touching, free = contacts(("ll", 0.0, 0.2)), contacts()
    a, b = (Runs(Table(make_table().frame, events)) for events in (touching, free))
    found = as_mapping(compare(a, b, scene=scene, labels=("reference", "exudyn")))["situations"]
    assert found["reference"]["one_corner"] == pytest.approx(0.25, **EXACT)  # of 0.8 s
    assert found["exudyn"]["free"] == 1.0
    assert set(found["exudyn"]) == set(SITUATIONS)


def test_without_events_or_without_corners_there_is_nothing_to_say(make_table, scene):
    a, b = Runs(Table(make_table().frame, contacts())), Runs(make_table())
    first, second = compare(a, b, scene=scene).situations
    assert first is not None
    assert second is None
    ideal = load_scene("ideal", {"output.samples_per_cycle": 200})
    runs = Runs(Table(make_table(of=ideal).frame, contacts()))
    assert compare(runs, runs, scene=ideal).situations == (None, None)


def test_a_pin_with_clearance_has_a_share_beside_the_situations_of_a_slider_that_may_have_none():
    for name, situations in (("crank-pin", False), ("both-clearances", True)):
        scene = load_scene(name)
        runs = Runs(run_one(scene, "reference"))
        result = compare(runs, runs, scene=scene, labels=("reference", "exudyn"))
        (share, _), (shares, _) = result.pin_contact, result.situations
        # Contacts of 0.1 to 0.4 ms, some five in 24 ms.
        assert 0.01 < share < 0.1
        assert (shares is not None) == situations
        assert as_mapping(result)["crank_pin_contact"]["reference"] == share
    guide = load_scene("150rpm-0.2mm", {"drive.cycles": 0.1})
    runs = Runs(run_one(guide, "reference"))
    assert compare(runs, runs, scene=guide).pin_contact == (None, None)
