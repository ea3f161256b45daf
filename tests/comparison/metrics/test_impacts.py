"""Impacts matched contact by contact: on tables of which it is known which contacts belong together."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from comparison.metrics.impacts import WINDOW, Impacts, begin_where, compare_impacts, impacts_of, match
from comparison.tables.table import Table
from comparison.verdict.compare import Runs, compare
from comparison.words.record import as_mapping

CORNERS = ("ll", "lr", "ul", "ur")
MOTION = ("time", "slider_x", "slider_y", "slider_angle", "slider_vx", "slider_vy", "slider_omega")
GAP = 0.01  # s, the least between two starts at a corner in `contacts`
seeds = st.integers(0, 2**31)


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


def test_another_corner_does_not_match():
    a = contacts(0)
    mirror = {"ll": "lr", "lr": "ll", "ul": "ur", "ur": "ul"}
    alone = a[a["corner"].isin(["ll", "ul"])]
    mirrored = alone.assign(corner=alone["corner"].map(mirror))
    assert len(match(alone, mirrored, 1.0)) == 0


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


def test_a_contact_before_the_first_or_after_the_last_sample_takes_the_nearest_interval():
    events = contacts(0).iloc[:2].assign(corner="ll", start=[-1e-9, 1 + 1e-9])
    held = np.array([True, True, False])
    np.testing.assert_array_equal(begin_where(events, np.array([0.0, 0.5, 1.0]), {"ll": held}), [True, False])


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


def with_events(table: Table, events: pd.DataFrame | None) -> Runs:
    return Runs(Table(table.frame, events))


def moved(events: pd.DataFrame, by: float) -> pd.DataFrame:
    return events.assign(start=events["start"] + by, end=events["end"] + by)


def test_a_comparison_of_scenes_tells_the_impacts(scene, make_table):
    a = moved(contacts(0, 5), 0.1)
    window = WINDOW * scene.period
    b = moved(a, 0.9 * window)
    result = compare(with_events(make_table(), a), with_events(make_table(), b), scene=scene, tolerance=1e-3)
    # Without uncertainties nothing tells which part is predictable.
    assert list(result.impacts) == ["all"]
    assert result.impacts["all"].recall == 1.0
    impacts = as_mapping(result)["impacts"]["all"]
    assert (impacts["matched"], impacts["count_a"], impacts["precision"]) == (20, 20, 1.0)
    assert "pairs" not in impacts
    late = moved(a, 1.1 * window)
    result = compare(with_events(make_table(), a), with_events(make_table(), late), scene=scene)
    assert result.impacts["all"].recall == 0.0


@pytest.mark.parametrize("lacking", [0, 1])
def test_a_table_without_events_has_no_impacts(scene, make_table, lacking):
    both = [contacts(0, 5), contacts(0, 5)]
    both[lacking] = None
    result = compare(*(with_events(make_table(), events) for events in both), scene=scene)
    assert result.impacts is None
    assert as_mapping(result)["impacts"] is None


def test_nor_have_tables_of_no_known_speed(make_table):
    run = with_events(make_table(), contacts(0, 5))
    assert compare(run, run).impacts is None


def test_a_contact_is_predictable_where_the_gap_of_its_corner_is(scene, make_table):
    """Gaps decide for their corners; where there are none, and for the crank pin, x does."""
    names = ["slider_x", *(f"corner_{corner}_gap" for corner in CORNERS)]
    runs = [Table(make_table(part).frame) for part in (1e-6, 2.5e-7, 4e-6, 4e-6)]
    # One finer run is far off in the gap at lower right, in the second half.
    later = runs[1].time > 0.4
    runs[1].frame.loc[later, "corner_lr_gap"] += 1e-3
    start = [0.6, 0.1, 0.6, 0.6]
    events = contacts(0).iloc[:4].assign(corner=["ll", "lr", "lr", "pin"], start=start, end=0.7)
    run = Runs(Table(runs[0].frame, events), *runs[1:])
    result = compare(run, run, scene=scene)
    assert result.channels["corner_lr_gap"].coverage == pytest.approx(0.5, abs=0.02)
    assert all(result.channels[name].coverage == 1 for name in names if name != "corner_lr_gap")
    part = result.impacts["predictable"]
    assert sorted(part.pairs[:, 0]) == [0, 1, 3]
    without = scene.with_values({"output.groups": []})
    motion = [Table(table.frame[list(MOTION)].copy()) for table in runs]
    motion[1].frame["slider_x"] += 1e-3
    run = Runs(Table(motion[0].frame, events), *motion[1:])
    assert compare(run, run, scene=without).impacts["predictable"].count_a == 0
