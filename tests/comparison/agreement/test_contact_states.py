"""Shares of the paper's four contact situations, on tables whose answer is counted by hand."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from comparison.agreement.contact_states import SITUATIONS, of_scene, pin_of_scene, pin_share, time_shares
from comparison.execution.run import run_one
from comparison.scene import load_scene
from comparison.tables.table import Table
from comparison.verdict.compare import Runs, compare
from comparison.words.record import as_mapping

# Shares are sums of at most some ten quotients of binary fractions: a few units of the last place.
EXACT = {"rel": 0, "abs": 1e-15}


def contacts(*rows: tuple[str, float, float]) -> pd.DataFrame:
    quantities = dict.fromkeys(("normal_speed", "impulse", "peak_force", "largest_depth"), 0.0)
    return pd.DataFrame(rows, columns=["corner", "start", "end"]).assign(**quantities)


def shares(events: pd.DataFrame, end: float = 8.0) -> list[float]:
    return list(time_shares(events, (0.0, end)).values())


@pytest.mark.parametrize(
    ("rows", "eighths"),
    [
        ([], [8, 0, 0, 0]),
        ([("ll", 1, 3)], [6, 2, 0, 0]),
        ([("ll", 1, 5), ("ul", 3, 6)], [3, 3, 2, 0]),
        ([("lr", 1, 5), ("ur", 5, 6)], [3, 5, 0, 0]),  # touching ends: never both
        ([("ur", 0, 2), ("ur", 2, 3)], [5, 3, 0, 0]),  # one corner's contacts that touch
        ([("ll", 1, 5), ("ur", 3, 6)], [3, 3, 0, 2]),  # a diagonal
        ([("ul", 0, 8), ("lr", 0, 8)], [0, 0, 0, 8]),
        ([("ll", 1, 5), ("lr", 3, 6)], [3, 3, 0, 2]),  # facing: both walls, though no slider can do it
        ([("ll", 1, 6), ("ul", 2, 5), ("ur", 4, 7)], [2, 2, 2, 2]),  # three corners touch both walls
        ([("ll", -1, 1), ("ur", 7, 9)], [6, 2, 0, 0]),  # what is outside the run does not count
        ([("pin", 0, 8)], [8, 0, 0, 0]),  # the journal at A is no corner
    ],
)
def test_hand_made_tables(rows, eighths):
    assert shares(contacts(*rows)) == pytest.approx([n / 8 for n in eighths], **EXACT)


def random_contacts(seed: int) -> pd.DataFrame:
    rng = np.random.default_rng(seed)
    rows = []
    for corner in ("ll", "lr", "ul", "ur"):
        edges = np.sort(rng.uniform(0, 8, size=2 * rng.integers(0, 40)))
        rows += [(corner, start, end) for start, end in edges.reshape(-1, 2)]
    return contacts(*rows)


@pytest.mark.parametrize("seed", range(20))
def test_shares_add_up_and_do_not_change_when_left_and_right_or_up_and_down_do(seed):
    events = random_contacts(seed)
    found = shares(events)
    # Up to 320 edges, each rounded once.
    assert sum(found) == pytest.approx(1, abs=1e-13)
    for pairs in (("ll lr", "ul ur"), ("ll ul", "lr ur")):
        swap = {a: b for pair in pairs for a, b in (pair.split(), pair.split()[::-1])}
        mirrored = events.assign(corner=events["corner"].map(swap)).sample(frac=1, random_state=seed)
        assert shares(mirrored) == found


def test_a_count_over_fine_samples_comes_to_the_same():
    events, end, count = random_contacts(3), 8.0, 200_000
    at = (np.arange(count) + 0.5) * end / count
    closed = {
        corner: np.any((rows["start"].to_numpy()[:, None] <= at) & (at < rows["end"].to_numpy()[:, None]), 0)
        for corner, rows in events.groupby("corner")
    }
    none = np.zeros(count, dtype=bool)
    ll, lr, ul, ur = (closed.get(corner, none) for corner in ("ll", "lr", "ul", "ur"))
    both = (ll | ul) & (lr | ur)
    one_side = ((ll & ul) | (lr & ur)) & ~both
    free = ~(ll | lr | ul | ur)
    sampled = [free.mean(), 1 - free.mean() - one_side.mean() - both.mean(), one_side.mean(), both.mean()]
    # Every one of at most 320 edges may be off by half a sample.
    assert shares(events) == pytest.approx(sampled, abs=160 / count)


def test_the_shares_of_both_results_stand_in_the_numbers(make_table, scene):
    touching, free = contacts(("ll", 0.0, 0.2)), contacts()
    a, b = (Runs(Table(make_table().frame, events)) for events in (touching, free))
    found = as_mapping(compare(a, b, scene=scene, labels=("reference", "exudyn")))["situations"]
    assert found["reference"]["one_corner"] == pytest.approx(0.25, **EXACT)  # of 0.8 s
    assert found["exudyn"]["free"] == 1.0
    assert set(found["exudyn"]) == set(SITUATIONS)


def test_without_events_or_without_corners_there_is_nothing_to_say(make_table, scene):
    a, b = Runs(Table(make_table().frame, contacts())), Runs(make_table())
    first, second = of_scene(compare(a, b, scene=scene))
    assert first is not None
    assert second is None
    ideal = load_scene("ideal", {"output.samples_per_cycle": 200})
    runs = Runs(Table(make_table(of=ideal).frame, contacts()))
    assert of_scene(compare(runs, runs, scene=ideal)) == (None, None)


def test_the_wedge_scene_visits_all_situations_and_the_papers_case_never_two_opposite_corners():
    found = {}
    for name in ("wedge", "150rpm-0.2mm"):
        scene = load_scene(name)
        table = run_one(scene, "reference")
        assert table.events is not None
        found[name] = time_shares(table.events, (0.0, scene.duration))
    assert min(found["wedge"].values()) > 0.02
    assert found["150rpm-0.2mm"]["opposite"] == 0.0
    assert min(found["150rpm-0.2mm"][key] for key in ("free", "one_corner", "one_side")) > 0.0


@pytest.mark.parametrize(
    ("rows", "eighths"),
    [
        ([], 0),
        ([("ll", 0, 8)], 0),  # a corner is no journal
        ([("pin", 1, 3), ("ur", 2, 5), ("pin", 4, 5)], 3),
        ([("pin", -1, 1), ("pin", 7, 9)], 2),
    ],
)
def test_the_pins_share_of_hand_made_tables(rows, eighths):
    assert pin_share(contacts(*rows), (0.0, 8.0)) == pytest.approx(eighths / 8, **EXACT)


def test_a_pin_with_clearance_has_a_share_beside_the_situations_of_a_slider_that_may_have_none():
    for name, situations in (("crank-pin", False), ("both-clearances", True)):
        scene = load_scene(name)
        runs = Runs(run_one(scene, "reference"))
        result = compare(runs, runs, scene=scene, labels=("reference", "exudyn"))
        (share, _), (shares, _) = pin_of_scene(result), of_scene(result)
        # Contacts of 0.1 to 0.4 ms, some five in 24 ms.
        assert 0.01 < share < 0.1
        assert (shares is not None) == situations
        assert as_mapping(result)["crank_pin_contact"]["reference"] == share
    guide = load_scene("150rpm-0.2mm", {"drive.cycles": 0.1})
    runs = Runs(run_one(guide, "reference"))
    assert pin_of_scene(compare(runs, runs, scene=guide)) == (None, None)
