"""Contacts matched one by one, their situations and their forces, on tables of which these are known."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from contact_tables import contacts_of
from hypothesis import given
from hypothesis import strategies as st

from comparison.execution.run import run_one
from comparison.metrics.contacts import (
    PULSE_PEAK,
    PULSE_POINTS,
    WINDOW,
    Impacts,
    begin_where,
    compare_impacts,
    impacts_of,
    match,
    noted,
    pin_share,
    time_shares,
)
from comparison.scene import load_scene
from comparison.tables.channels import touching
from comparison.tables.table import Table

CORNERS = ("ll", "lr", "ul", "ur")
GAP = 0.01  # s, the least between two starts at a corner in `contacts`
seeds = st.integers(0, 2**31)
# Shares are sums of at most some ten quotients of binary fractions: a few units of the last place.
EXACT = {"rel": 0, "abs": 1e-15}


def contacts(seed: int, count: int = 40) -> pd.DataFrame:
    """Return contacts at every corner, in a random order of rows."""
    rng = np.random.default_rng(seed)
    starts = np.concatenate([np.cumsum(GAP + rng.exponential(GAP, count)) for _ in CORNERS])
    events = pd.DataFrame(
        {
            "corner": np.repeat(CORNERS, count),
            "start": starts,
            "end": starts + 0.1 * GAP,
            "normal_speed": rng.uniform(0.01, 0.2, starts.size),
            "impulse": rng.uniform(1e-4, 1e-2, starts.size),
            "peak_force": rng.uniform(1, 60, starts.size),
            "largest_depth": rng.uniform(1e-7, 1e-5, starts.size),
        }
    )
    return events.sample(frac=1, random_state=seed, ignore_index=True)


def numbers(found: Impacts) -> dict[str, float]:
    return {name: value for name, value in vars(found).items() if name != "pairs"}


@given(seeds)
def test_a_copy_matches_every_contact_without_error(seed):
    a = contacts(seed)
    order = np.random.default_rng(seed).permutation(len(a))
    found = compare_impacts(a, a.iloc[order], window=0.0)
    assert (found.precision, found.recall, found.count_a, found.count_b) == (1.0, 1.0, 160, 160)
    np.testing.assert_array_equal(order[found.pairs[:, 1]], found.pairs[:, 0])
    errors = ("largest_delay", "median_delay", "normal_speed_error", "impulse_error", "peak_force_error")
    assert [getattr(found, name) for name in errors] == [0.0] * 5
    # 160 terms in another order.
    assert found.total_impulse_error == pytest.approx(0, abs=1e-14)
    assert np.all(np.diff(a["start"].to_numpy()[found.pairs[:, 0]]) >= 0)


@given(seeds, st.integers(0, 160), st.integers(0, 30))
def test_missing_and_added_contacts_give_the_exact_shares(seed, missing, added):
    a = contacts(seed)
    kept = a.sample(160 - missing, random_state=seed)
    # Half a gap before the first start: further than the window from any.
    extra = a.iloc[:added].assign(start=lambda rows: -np.arange(len(rows)) * GAP - GAP / 2)
    b = pd.concat([kept, extra])
    found = compare_impacts(a, b, window=GAP / 3)
    assert len(found.pairs) == 160 - missing
    assert found.recall == (160 - missing) / 160
    if len(b):
        assert found.precision == (160 - missing) / len(b)
    else:
        assert np.isnan(found.precision)


@given(seeds, st.floats(0, 0.5))
def test_exchanging_the_tables_exchanges_the_pairs(seed, jitter):
    rng = np.random.default_rng(seed)
    a = contacts(seed, 20)
    b = contacts(seed + 1, 20)
    b.loc[:40, "start"] = a["start"][:41] + jitter * GAP * rng.normal(size=41)
    b.loc[:40, "corner"] = a["corner"][:41]
    there, back = (compare_impacts(*pair, window=GAP / 3) for pair in ((a, b), (b, a)))
    assert {tuple(pair) for pair in there.pairs} == {tuple(pair[::-1]) for pair in back.pairs}
    swapped = {"count_a": "count_b", "count_b": "count_a", "precision": "recall", "recall": "precision"}
    for name, value in numbers(there).items():
        # Sums are taken in another order.
        assert getattr(back, swapped.get(name, name)) == pytest.approx(
            value, rel=1e-13, abs=1e-14, nan_ok=True
        )


@given(seeds, st.floats(0, 1))
def test_every_contact_is_matched_once_with_one_of_its_corner_inside_the_window(seed, window):
    a, b = contacts(seed, 20), contacts(seed + 1, 25)
    pairs = match(a, b, window * GAP)
    for column in (0, 1):
        assert len(set(pairs[:, column])) == len(pairs)
    first, second = a.iloc[pairs[:, 0]], b.iloc[pairs[:, 1]]
    assert (first["corner"].to_numpy() == second["corner"].to_numpy()).all()
    assert (np.abs(first["start"].to_numpy() - second["start"].to_numpy()) <= window * GAP).all()
    np.testing.assert_array_equal(pairs, match(a, b, window * GAP))


def test_a_shift_is_the_delay_and_beyond_the_window_nothing_matches():
    a = contacts(0)
    shifted = a.assign(start=a["start"] + 0.2 * GAP)
    found = compare_impacts(a, shifted, window=0.21 * GAP)
    assert found.recall == 1.0
    # Starts below 1 s round at 1e-16 s.
    assert found.largest_delay == pytest.approx(0.2 * GAP, abs=1e-15)
    assert found.median_delay == pytest.approx(0.2 * GAP, abs=1e-15)
    found = compare_impacts(a, shifted, window=0.19 * GAP)
    assert (len(found.pairs), found.precision, found.recall) == (0, 0.0, 0.0)
    rest = ("largest_delay", "median_delay", "normal_speed_error", "impulse_error", "peak_force_error")
    assert np.isnan([getattr(found, name) for name in rest]).all()


def test_a_lasting_contact_that_one_model_interrupts_changes_single_impulses_and_not_the_total():
    whole = contacts(0).iloc[:1].assign(corner="ll", start=1.0, impulse=1.0)
    parts = pd.concat([whole.assign(impulse=0.01), whole.assign(start=1.5, impulse=0.99)])
    found = compare_impacts(whole, parts, window=0.1)
    assert (found.recall, found.precision) == (1.0, 0.5)
    assert found.impulse_error == pytest.approx(0.99, rel=1e-14)
    assert found.total_impulse_error == pytest.approx(0, abs=1e-15)


def test_one_contact_against_two_takes_the_nearer_and_of_equals_the_earlier():
    one, two = contacts(0).iloc[:1], contacts(0).iloc[[0, 0]]
    near = two.assign(start=one["start"].iloc[0] + np.array([-0.25, 0.125]))
    assert match(one, near, 1.0).tolist() == [[0, 1]]
    equal = two.assign(start=[0.75, 0.25])
    assert match(one.assign(start=0.5), equal, 1.0).tolist() == [[0, 1]]


def test_errors_are_those_of_the_definitions():
    a = contacts(0).iloc[:3].assign(corner="ll", start=[0.0, 1.0, 2.0])
    a = a.assign(normal_speed=[0.1, 0.4, 0.2], impulse=[1.0, 2.0, 3.0], peak_force=[10.0, 40.0, 20.0])
    b = a.iloc[:2].assign(normal_speed=[0.15, 0.5], impulse=[1.5, 1.0], peak_force=[15.0, 20.0])
    found = compare_impacts(a, b, window=0.1)
    assert found.normal_speed_error == pytest.approx(0.1 / 0.5, rel=1e-14)
    assert found.total_impulse_error == pytest.approx(3.5 / 4.25, rel=1e-14)
    # |1 - 1.5| + |2 - 1| over the mean of 6 and 2.5.
    assert found.impulse_error == pytest.approx(1.5 / 4.25, rel=1e-14)
    assert found.peak_force_error == pytest.approx(20 / 40, rel=1e-14)


@given(seeds, st.sampled_from([1e-6, 1e-3, 60.0, 1e3]), st.sampled_from([1e-3, 1e3, 4.448]))
def test_shares_and_errors_do_not_change_with_the_units(seed, second, newton):
    a, b = contacts(seed), contacts(seed)
    b["start"] += np.random.default_rng(seed).uniform(-0.4, 0.4, len(b)) * GAP
    b["impulse"] *= 1.1
    units = {"start": second, "impulse": newton * second, "peak_force": newton, "normal_speed": 1 / second}
    plain = compare_impacts(a, b, 0.3 * GAP)
    scaled = (events.assign(**{k: f * events[k] for k, f in units.items()}) for events in (a, b))
    other = compare_impacts(*scaled, 0.3 * GAP * second)
    for name, value in numbers(plain).items():
        unit = second if name.endswith("delay") else 1.0
        assert getattr(other, name) == pytest.approx(value * unit, rel=1e-9, abs=1e-14 * unit, nan_ok=True)


def test_a_part_counts_the_contacts_that_begin_in_it_and_loses_no_partner_at_its_edge():
    time_ = np.linspace(0, 1, 11)
    predictable = {"ll": time_ < 0.55, "lr": time_ < 0}
    a = contacts(0).iloc[:4].assign(corner=["ll", "ll", "ll", "lr"], start=[0.1, 0.49999, 0.8, 0.2])
    b = a.assign(start=a["start"] + 1e-4)
    # Between the samples at 0.5 and 0.6 it does not hold on both sides.
    np.testing.assert_array_equal(begin_where(a, time_, predictable), [True, True, False, False])
    np.testing.assert_array_equal(begin_where(b, time_, predictable), [True, False, False, False])
    both = impacts_of(a, b, time=time_, period=10.0, predictable=predictable)
    part = both["predictable"]
    assert (part.count_a, part.count_b, part.precision, part.recall) == (2, 2, 1.0, 1.0)
    assert both["all"].count_a == 4
    lost = impacts_of(a, b.iloc[[0, 2, 3]], time=time_, period=10.0, predictable=predictable)["predictable"]
    assert (lost.count_a, lost.count_b, lost.precision, lost.recall) == (2, 1, 1.0, 0.5)
    # Before the first or after the last sample the nearest interval counts.
    beyond = a.iloc[:2].assign(start=[-1e-9, 1 + 1e-9])
    np.testing.assert_array_equal(begin_where(beyond, time_, predictable), [True, False])


@pytest.mark.parametrize("empty", [pd.DataFrame(), contacts(0).iloc[:0]])
def test_without_contacts_there_are_no_shares(empty):
    a = contacts(0)
    found = compare_impacts(empty, empty, 0.1)
    assert (found.count_a, found.count_b, len(found.pairs)) == (0, 0, 0)
    assert np.isnan([found.precision, found.recall]).all()
    found = compare_impacts(a, empty, 0.1)
    assert np.isnan(found.precision)
    assert found.recall == 0.0


def test_a_hundred_thousand_contacts_are_not_looped_over(lines_run):
    a, b = contacts(0, 25_000), contacts(0, 25_000)
    b["start"] += np.random.default_rng(0).normal(size=len(b)) * GAP / 10
    results = []
    # 6,000.
    assert lines_run(lambda: results.append(compare_impacts(a, b, GAP / 2))) < 50_000
    (found,) = results
    # All within the window of 5 standard deviations, hardly any nearer to a neighbour a gap away.
    assert 0.999 < found.recall <= 1.0
    assert found.count_a == 100_000


def test_chatter_leaves_no_choice_of_partners():
    """The window is less than half of the shortest interval seen at a corner, 4.4e-4 of a cycle."""
    assert 2 * WINDOW < 4.4e-4


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
    assert shares(contacts_of(*rows)) == pytest.approx([n / 8 for n in eighths], **EXACT)


def random_contacts(seed: int) -> pd.DataFrame:
    rng = np.random.default_rng(seed)
    rows = []
    for corner in ("ll", "lr", "ul", "ur"):
        edges = np.sort(rng.uniform(0, 8, size=2 * rng.integers(0, 40)))
        rows += [(corner, start, end) for start, end in edges.reshape(-1, 2)]
    return contacts_of(*rows)


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
        ([("pin", 1, 4), ("pin", 3, 5)], 4),  # rows that overlap are no second contact
    ],
)
def test_the_pins_share_of_hand_made_tables(rows, eighths):
    assert pin_share(contacts_of(*rows), (0.0, 8.0)) == pytest.approx(eighths / 8, **EXACT)


def contact(
    start: float = 0.01, count: int = 30, peak: float = 40.0, corner: str = "ll"
) -> dict[str, object]:
    phase = np.linspace(0.0, 1.0, count)
    force = peak * np.sin(np.pi * phase)
    force[count // 2] = peak
    return {"corner": corner, "start": start, "time": list(2e-4 * phase), "force": list(force)}


@pytest.fixture
def events() -> pd.DataFrame:
    start = np.array([0.01, 0.02])
    return pd.DataFrame(
        {"corner": ["ll", "ur"], "start": start, "end": start + 2e-4, "peak_force": [40.0, 40.0]}
    )


def pulse_columns(of: dict[str, object], row: int) -> dict[str, np.ndarray]:
    """The columns of one contact in a table."""
    time, force = (np.array(of[name]) for name in ("time", "force"))
    return {"row": np.full(time.size, row), "time": of["start"] + time, "force": force}


@pytest.mark.parametrize(
    ("count", "peak", "drawn"),
    [(30, 40.0, 1), (20, 40.3, 1), (5, 40.0, 1), (4, 40.0, 0), (30, 40.5, 0), (30, 0.0, 0)],
)
def test_what_a_table_has_of_a_contact_is_drawn_with_enough_points_and_the_same_peak(
    events, count, peak, drawn
):
    found = contact(start=0.02, count=count, peak=peak)
    found["time"] = 1e-6 + np.array(found["time"])  # the touch is inside a step
    frame = pd.DataFrame({"time": [0.0, 1.0]})
    pulses = noted(Table(frame, events, pulses=pulse_columns(found, row=1)))
    assert [pulse.row for pulse in pulses] == [1] * drawn
    for pulse in pulses:
        # Differences of times of 0.02 s, rounded at 3.5e-18 s each
        np.testing.assert_allclose(
            pulse.time[:: (pulse.time.size - 1) // (count - 1)], found["time"], rtol=0, atol=1e-17
        )
        # A spline's nodes round at 1e-16 of the largest
        noted_force = pulse.force[:: (pulse.time.size - 1) // (count - 1)]
        np.testing.assert_allclose(noted_force, found["force"], rtol=0, atol=1e-15 * peak)
        assert pulse.time.size >= PULSE_POINTS
        assert pulse.force.max() == max(found["force"])  # the spline is monotone between points


@pytest.mark.parametrize(
    ("model", "changes"),
    [
        ("reference", {}),
        ("reference", {"solver.reference.formulation": "multiplier"}),
        ("reference", {"contact.law": "foundation"}),
        ("exudyn", {"solver.exudyn.formulation": "full"}),
        ("exudyn", {"solver.exudyn.formulation": "tree", "solver.exudyn.tolerance": 1e-9}),
        # A side is one contact
        ("exudyn", {"solver.exudyn.formulation": "tree", "contact.law": "foundation"}),
    ],
)
def test_what_a_model_notes_is_what_samples_inside_contacts_show(model, changes):
    # The first impacts, some of them chatter; later ones of another sampling are other ones
    values = {"drive.cycles": 0.1, "output.groups": ["corners"], **changes}
    base = run_one(load_scene("150rpm-0.2mm", values), model)
    dense = run_one(load_scene("150rpm-0.2mm", {**values, "output.samples_per_cycle": 50_000}), model)
    assert base.events is not None
    pulses = noted(base)
    # All but the last, which may last at the end
    assert {pulse.row for pulse in pulses} >= set(range(len(base.events) - 1))
    assert len(pulses) >= 5
    for pulse in pulses:
        event = base.events.iloc[pulse.row]
        time = dense.time - event["start"]
        inside = (time >= pulse.time[0]) & (time <= pulse.time[-1])
        sharing = touching(event["corner"], base.provenance["scene"])
        force = np.sum([dense.values(f"corner_{name}_normal")[inside] for name in sharing], axis=0)
        # Points of an envelope are up to two of 16 parts apart, over which a line misses a half sine by
        # (pi / 8)^2 / 8 of its peak, 0.019
        line = np.interp(time[inside], pulse.time, pulse.force)
        np.testing.assert_allclose(line, force, rtol=0, atol=0.04 * pulse.force.max())
        assert pulse.time.size >= PULSE_POINTS == 20
        assert pulse.force.max() == pytest.approx(event["peak_force"], rel=PULSE_PEAK)
        assert PULSE_PEAK == 0.01
        assert np.all(np.diff(pulse.time) > 0.0)
        # The pulse's zero of time is the touch
        assert 0.0 <= pulse.time[0] < pulse.time[-1] <= 1.0001 * (event["end"] - event["start"])
