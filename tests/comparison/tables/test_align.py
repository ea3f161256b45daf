"""Two tables on one grid: nothing changes where nothing has to; interpolation has the order it claims."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from comparison.tables.align import align, resample
from comparison.tables.table import Table, TableError
from comparison.tables.times import SAME_GRID

NAMES = ["slider_x", "slider_vx", "slider_angle"]


def wave(time: np.ndarray) -> Table:
    """x = sin t with its derivative; an angle without its rate."""
    return Table(
        pd.DataFrame(
            {"time": time, "slider_x": np.sin(time), "slider_vx": np.cos(time), "slider_angle": np.cos(time)}
        )
    )


@given(arrays(np.float64, (3, 9), elements=st.floats(-1e6, 1e6)))
def test_a_table_against_itself_is_untouched(values):
    # Without angles: those may be unwrapped.
    names = ["slider_x", "slider_vx", "slider_ax"]
    table = Table(pd.DataFrame({"time": np.linspace(0, 1, 9), **dict(zip(names, values, strict=True))}))
    aligned = align(table, table, names)
    assert aligned.interpolated == ""
    for name in names:
        assert aligned.a[name].tobytes() == aligned.b[name].tobytes() == table.values(name).tobytes()


def test_times_that_lost_their_last_digits_in_a_text_file_are_the_same_grid():
    time = np.linspace(0, 1, 101)
    rounded = time + 0.5 * SAME_GRID * 0.01 * np.sin(1e4 * time)
    assert align(wave(time), wave(rounded), NAMES).interpolated == ""
    assert align(wave(time), wave(time + 10 * SAME_GRID * 0.01 * (time > 0.5)), NAMES).interpolated != ""


def test_the_coarser_grid_is_kept_whichever_side_it_is_on():
    coarse, fine = np.linspace(0, 3, 31), np.linspace(0, 3, 77)
    for a, b, which in ((coarse, fine, "b"), (fine, coarse, "a")):
        aligned = align(wave(a), wave(b), NAMES)
        assert aligned.interpolated == which
        np.testing.assert_array_equal(aligned.time, coarse)
        kept = aligned.a if which == "b" else aligned.b
        np.testing.assert_array_equal(kept["slider_x"], np.sin(coarse))


@pytest.mark.parametrize(("name", "order"), [("slider_x", 4), ("slider_vx", 2), ("slider_angle", 2)])
def test_interpolation_has_fourth_order_with_a_rate_and_second_without(name, order):
    coarse = np.linspace(0, 3, 29)
    errors = []
    counts = (41, 81, 161)
    for count in counts:
        aligned = align(wave(coarse), wave(np.linspace(0, 3, count)), NAMES)
        errors.append(np.abs(aligned.a[name] - aligned.b[name]).max())
    # Where the coarse times fall within the fine intervals varies a little from grid to grid: 0.3.
    assert np.polyfit(np.log(3 / (np.array(counts) - 1)), np.log(errors), 1)[0] == pytest.approx(
        order, abs=0.3
    )


def test_only_the_common_span_is_compared():
    aligned = align(wave(np.linspace(0, 1, 11)), wave(np.linspace(0.25, 1.5, 50)), NAMES)
    assert aligned.time[0] == pytest.approx(0.3)
    assert aligned.time[-1] == 1.0
    with pytest.raises(TableError, match="0 common times: 0 to 1 s against 2 to 3 s"):
        align(wave(np.linspace(0, 1, 11)), wave(np.linspace(2, 3, 50)), NAMES)


def test_turns_of_an_angle_make_no_difference():
    time = np.linspace(0, 4, 200)
    straight = wave(time)
    straight.frame["slider_angle"] = 5 * time + 10
    wrapped = wave(time)
    wrapped.frame["slider_angle"] = np.mod(5 * time + 10, 2 * np.pi)
    aligned = align(straight, wrapped, NAMES)
    coarse = Table(straight.frame.iloc[:200:3].reset_index(drop=True))
    for a in (straight, coarse):  # the first table keeps its count of revolutions
        counted = align(a, wrapped, NAMES).a["slider_angle"]
        np.testing.assert_array_equal(counted[:-1], a.values("slider_angle")[: counted.size - 1])
    # Wrapping rounds at 4e-15; the largest angle is 30, one turn of it is taken out at the start.
    np.testing.assert_allclose(aligned.a["slider_angle"], aligned.b["slider_angle"], rtol=0, atol=2e-14)


def test_half_a_turn_remains_a_difference():
    time = np.linspace(0, 4, 200)
    turned = wave(time)
    turned.frame["slider_angle"] += 3.0
    aligned = align(wave(time), turned, NAMES)
    np.testing.assert_allclose(aligned.b["slider_angle"] - aligned.a["slider_angle"], 3.0, atol=1e-14)


def contacts(*spans: tuple[str, float, float]) -> pd.DataFrame:
    return pd.DataFrame(spans, columns=["corner", "start", "end"])


@st.composite
def some_events(draw):
    edges = st.floats(-0.1, 1.1)
    spans = draw(st.lists(st.tuples(st.sampled_from(["ll", "ur"]), edges, edges), max_size=6))
    return contacts(*((corner, min(one, two), max(one, two)) for corner, one, two in spans))


@settings(max_examples=50)
@given(arrays(np.float64, (4, 9), elements=st.floats(-1e6, 1e6)), some_events())
def test_a_table_on_its_own_grid_is_untouched_whatever_its_contacts(values, events):
    time = np.linspace(0, 1, 9)
    names = ["slider_x", "slider_vx", "slider_ax", "corner_ll_normal"]
    sampled, unknown = resample(time, dict(zip(names, values, strict=True)), time, events)
    assert not unknown
    for name, own in zip(names, values, strict=True):
        np.testing.assert_array_equal(sampled[name], own)


@st.composite
def tables_on_two_grids(draw):
    """Smooth channels, an angle that turns, and a force, over nearly the same time."""
    made = []
    for _ in range(2):
        rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
        time = np.concatenate([[0.0], np.sort(rng.uniform(0, 3, draw(st.integers(40, 60)))), [3.0]])
        time = np.unique(np.round(time, 6))
        table = wave(time)
        table.frame["slider_angle"] += 2 * np.pi * draw(st.integers(-2, 2))
        table.frame["slider_ax"] = np.sin(9 * time)
        made.append(Table(table.frame, draw(st.none() | some_events())))
    return made


@settings(max_examples=30)
@given(tables_on_two_grids())
def test_exchanging_the_two_tables_exchanges_the_result(tables):
    names = [*NAMES, "slider_ax"]
    there, back = align(*tables, names), align(*tables[::-1], names)
    assert {there.interpolated, back.interpolated} in ({"a", "b"}, {""})
    np.testing.assert_array_equal(there.time, back.time)
    for name in names:
        differences = there.a[name] - there.b[name], back.a[name] - back.b[name]
        # Only of an angle the whole turns are taken from the other one: 13 rounds at 2e-15.
        atol = 1e-14 if name == "slider_angle" else 0.0
        np.testing.assert_allclose(differences[0], -differences[1], rtol=0, atol=atol)
    assert there.unknown.keys() == back.unknown.keys()
    for name, where in there.unknown.items():
        np.testing.assert_array_equal(where, back.unknown[name])


def test_of_two_grids_with_one_interval_the_same_one_is_taken_from_either_side():
    time = np.linspace(0, 1, 11)
    bent = time + 0.02 * np.sin(np.pi * time)
    np.testing.assert_array_equal(align(wave(time), wave(bent), NAMES).time, time)
    np.testing.assert_array_equal(align(wave(bent), wave(time), NAMES).time, time)


def test_a_journal_moves_without_a_jump_at_its_own_contacts():
    time, at = np.linspace(0.0, 1.0, 5), np.array([0.4, 0.6])
    events = pd.DataFrame({"corner": ["pin"], "start": [0.45], "end": [0.55]})
    sampled, unknown = resample(time, {"journal_x": time**2}, at, events)
    np.testing.assert_array_equal(sampled["journal_x"], np.interp(at, time, time**2))
    assert not unknown


@given(arrays(np.int8, 60, elements=st.integers(-3, 3)), st.floats(-2.9, 2.9))
def test_whole_turns_anywhere_make_no_difference(turns, slope):
    time = np.linspace(0, 2, 60)
    frame = pd.DataFrame({"time": time, "slider_angle": slope * np.sin(5 * time)})  # steps below half a turn
    other = frame.assign(slider_angle=frame["slider_angle"] + 2 * np.pi * turns)
    aligned = align(Table(frame), Table(other), ["slider_angle"])
    # At most six turns a sample, taken out one after the other, each rounding at 1e-15 times their sum.
    np.testing.assert_allclose(aligned.a["slider_angle"], aligned.b["slider_angle"], rtol=0, atol=1e-11)


# Forces at contacts


def force(time: np.ndarray, *spans: tuple[float, float]) -> np.ndarray:
    """Zero, and within contacts a line from 50 N down: it jumps at both ends of a contact."""
    total = np.zeros_like(time)
    for start, end in spans:
        total += np.where((time >= start) & (time < end), 50 - 10 * (time - start), 0.0)
    return total


COARSE, FINE = np.linspace(0, 3, 31), np.linspace(0, 3, 77)


def pressed(time: np.ndarray, *spans: tuple[float, float], events: bool = True) -> Table:
    frame = pd.DataFrame({"time": time, "corner_ll_normal": force(time, *spans)})
    return Table(frame, contacts(*(("ll", *span) for span in spans)) if events else None)


def test_a_force_keeps_its_left_and_right_limits_at_a_contact():
    spans = (0.4912, 1.013), (1.7, 2.61)
    exact = force(COARSE, *spans)
    for a, b, side in (
        (pressed(COARSE, *spans), pressed(FINE, *spans), "b"),
        (pressed(FINE, *spans), pressed(COARSE, *spans), "a"),
        (pressed(COARSE, *spans), pressed(FINE, *spans, events=False), "b"),  # by the other's events
    ):
        aligned = align(a, b, ["corner_ll_normal"])
        assert aligned.interpolated == side
        assert not aligned.unknown
        # 50 N round at 7e-15, twice over a line that is continued.
        np.testing.assert_allclose(getattr(aligned, side)["corner_ll_normal"], exact, rtol=0, atol=1e-13)
    # Without any events lines are drawn across: what this is about.
    smeared = align(
        pressed(COARSE, *spans, events=False), pressed(FINE, *spans, events=False), ["corner_ll_normal"]
    )
    assert np.abs(smeared.b["corner_ll_normal"] - exact).max() > 10


def test_what_lies_in_a_contact_that_has_no_two_samples_is_unknown():
    step = FINE[1]
    inside = COARSE[10]  # 1.0, between two of the fine samples
    for length in (0.2 * step, 1.1 * step):
        span = inside - length / 2, inside + length / 2
        aligned = align(pressed(COARSE, span), pressed(FINE, span), ["corner_ll_normal"])
        (where,) = aligned.unknown.values()
        np.testing.assert_array_equal(np.flatnonzero(where), [10])
        known = ~where
        np.testing.assert_array_equal(aligned.b["corner_ll_normal"][known], 0.0)


def test_a_sample_at_the_instant_of_an_event_is_its_right_limit():
    span = COARSE[10], COARSE[20]
    aligned = align(pressed(COARSE, span), pressed(FINE, span), ["corner_ll_normal"])
    np.testing.assert_allclose(aligned.b["corner_ll_normal"], force(COARSE, span), rtol=0, atol=1e-13)
    assert aligned.b["corner_ll_normal"][10] == pytest.approx(50.0, abs=1e-12)
    assert aligned.b["corner_ll_normal"][20] == pytest.approx(0.0, abs=1e-12)


def test_a_tables_own_events_count_and_of_a_corner_only_its_own():
    span = 0.5, 1.5
    quiet = Table(pressed(FINE).frame, contacts())  # it says that nothing touches
    aligned = align(pressed(COARSE, span), quiet, ["corner_ll_normal"])
    assert not aligned.unknown
    assert np.abs(aligned.a["corner_ll_normal"] - aligned.b["corner_ll_normal"]).max() > 40
    elsewhere = pressed(FINE, span)
    elsewhere.events["corner"] = "ur"
    aligned = align(pressed(COARSE, span), elsewhere, ["corner_ll_normal"])
    across = np.interp(COARSE, FINE, force(FINE, span))
    np.testing.assert_array_equal(aligned.b["corner_ll_normal"], across)
    smooth = Table(
        pd.DataFrame({"time": FINE, "corner_ll_normal": np.sin(FINE)}), contacts(("ur", 1.0, 1.01))
    )
    by_line = np.interp(COARSE, FINE, np.sin(FINE))
    aligned = align(pressed(COARSE), smooth, ["corner_ll_normal"])
    np.testing.assert_array_equal(aligned.b["corner_ll_normal"], by_line)
    assert not aligned.unknown
