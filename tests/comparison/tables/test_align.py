"""Two tables on one grid: nothing changes where nothing has to; interpolation has the order it claims.

Interpolation between random contacts is in `tests/judge`, by a second way.
"""

import numpy as np
import pandas as pd
import pytest
from contact_tables import contacts_of
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from comparison.tables.align import SAME_GRID, align, resample
from comparison.tables.table import Table, TableError

NAMES = ["slider_x", "slider_vx", "slider_angle"]
FORCE = "corner_ll_normal"
COARSE, FINE = np.linspace(0, 3, 31), np.linspace(0, 3, 77)


def wave(time, events=None, **columns):
    """x = sin t with its derivative; an angle without its rate."""
    frame = {"time": time, "slider_x": np.sin(time), "slider_vx": np.cos(time), "slider_angle": np.cos(time)}
    return Table(pd.DataFrame(frame | columns), events)


@st.composite
def some_events(draw):
    edges = st.floats(-0.1, 1.1)
    spans = draw(st.lists(st.tuples(st.sampled_from(["ll", "ur"]), edges, edges), max_size=6))
    return contacts_of(*((corner, min(one, two), max(one, two)) for corner, one, two in spans))


@settings(max_examples=50)
@given(arrays(np.float64, (4, 9), elements=st.floats(-1e6, 1e6)), some_events())
def test_a_table_on_its_own_grid_is_untouched_whatever_its_contacts(values, events):
    names = ["slider_x", "slider_vx", "slider_ax", FORCE]  # an angle may be unwrapped
    columns, time = dict(zip(names, values, strict=True)), np.linspace(0, 1, 9)
    sampled, unknown = resample(time, columns, time, events)
    table = Table(pd.DataFrame({"time": time, **columns}), events)
    aligned = align(table, table, names)
    assert (aligned.interpolated, unknown) == ("", {})
    for name, own in columns.items():
        np.testing.assert_array_equal(sampled[name], own)
        assert aligned.a[name].tobytes() == aligned.b[name].tobytes() == own.tobytes()


@pytest.mark.parametrize(("lost", "side"), [(0.5, {""}), (10, {"a", "b"})])
def test_times_that_lost_their_last_digits_in_a_text_file_are_the_same_grid(lost, side):
    time = np.linspace(0, 1, 101)
    rounded = time + lost * SAME_GRID * 0.01 * np.sin(1e4 * time)
    assert align(wave(time), wave(rounded), NAMES).interpolated in side


@pytest.mark.parametrize(("name", "order"), [("slider_x", 4), ("slider_vx", 2), ("slider_angle", 2)])
def test_interpolation_has_fourth_order_with_a_rate_and_second_without(name, order):
    counts, coarse = np.array([41, 81, 161]), np.linspace(0, 3, 29)
    aligned = [align(wave(coarse), wave(np.linspace(0, 3, count)), NAMES) for count in counts]
    errors = [np.abs(each.a[name] - each.b[name]).max() for each in aligned]
    # Where the coarse times fall within the fine intervals varies a little from grid to grid: 0.3.
    assert np.polyfit(np.log(3 / (counts - 1)), np.log(errors), 1)[0] == pytest.approx(order, abs=0.3)


def test_only_the_common_span_is_compared():
    aligned = align(wave(np.linspace(0, 1, 11)), wave(np.linspace(0.25, 1.5, 50)), NAMES)
    assert aligned.time[[0, -1]] == pytest.approx([0.3, 1.0])
    with pytest.raises(TableError, match="0 common times: 0 to 1 s against 2 to 3 s"):
        align(wave(np.linspace(0, 1, 11)), wave(np.linspace(2, 3, 50)), NAMES)


@settings(max_examples=30)
@given(st.integers(0, 2**32 - 1), st.lists(st.none() | some_events(), min_size=2, max_size=2))
def test_exchanging_the_two_tables_exchanges_the_result_and_the_coarser_grid_is_kept(seed, events):
    rng, tables, names = np.random.default_rng(seed), [], [*NAMES, "slider_ax"]
    for own, count in zip(events, rng.integers(40, 43, 2), strict=True):
        time = np.unique(np.round(np.concatenate([[0.0], rng.uniform(0, 3, count), [3.0]]), 6))
        angle = np.cos(time) + 2 * np.pi * rng.integers(-2, 3)
        tables.append(wave(time, own, slider_angle=angle, slider_ax=np.sin(9 * time)))
    there, back = align(*tables, names), align(*tables[::-1], names)
    assert {there.interpolated, back.interpolated} == {"a", "b"}
    fewest = min(table.time.size for table in tables)  # of one span
    assert any(np.array_equal(there.time, table.time) for table in tables if table.time.size == fewest)
    np.testing.assert_array_equal(there.time, back.time)
    for name in names:
        differences = there.a[name] - there.b[name], back.a[name] - back.b[name]
        # Only of an angle the whole turns are taken from the other one: 13 rounds at 2e-15.
        atol = 1e-14 if name == "slider_angle" else 0.0
        np.testing.assert_allclose(differences[0], -differences[1], rtol=0, atol=atol)
    assert there.unknown.keys() == back.unknown.keys()
    for name, where in there.unknown.items():
        np.testing.assert_array_equal(where, back.unknown[name])


@pytest.mark.parametrize("every", [1, 7, 11])
def test_the_finer_table_tells_how_often_an_angle_has_turned_and_the_first_one_how_it_is_counted(every):
    time = np.arange(0, 1.54, 0.01)
    angle = 7.3 * 2 * np.pi * time  # of the coarsest table eight tenths of a turn from row to row
    wrapped = np.mod(angle + np.pi, 2 * np.pi) - np.pi
    fine = wave(time, slider_angle=wrapped)
    for counted in (wrapped, angle, angle + 6 * np.pi):
        coarse = wave(time[::every], slider_angle=counted[::every])
        for pair in ((fine, coarse), (coarse, fine)):
            aligned = align(*pair, NAMES)
            # 70 rad round at 1e-14, and a line between two samples is as exact.
            a, b = aligned.a["slider_angle"], aligned.b["slider_angle"]
            np.testing.assert_allclose(a, b, rtol=0, atol=1e-12)
            np.testing.assert_allclose(np.diff(a), np.diff(angle[::every]), rtol=0, atol=1e-12)
            assert a[0] == pytest.approx(pair[0].values("slider_angle")[0], abs=1e-12)


def pressed(time, *spans):
    """A force that is zero, and within contacts a line from 50 N down: it jumps at both ends of a contact."""
    held = [np.where((time >= start) & (time < end), 50 - 10 * (time - start), 0.0) for start, end in spans]
    frame = pd.DataFrame({"time": time, FORCE: np.sum(held, axis=0)})
    return Table(frame, contacts_of(*(("ll", *span) for span in spans)))


@pytest.mark.parametrize("spans", [[(0.4912, 1.013), (1.7, 2.61)], [(COARSE[10], COARSE[20])]])
def test_a_force_keeps_its_left_and_right_limits_at_a_contact_of_either_table(spans):
    coarse, fine = pressed(COARSE, *spans), pressed(FINE, *spans)
    without = Table(fine.frame)
    for a, b, side in ((coarse, fine, "b"), (fine, coarse, "a"), (coarse, without, "b")):
        aligned = align(a, b, [FORCE])
        assert (aligned.interpolated, aligned.unknown) == (side, {})
        # 50 N round at 7e-15, twice over a line that is continued.
        np.testing.assert_allclose(getattr(aligned, side)[FORCE], coarse.values(FORCE), rtol=0, atol=1e-13)


def test_a_table_that_says_that_nothing_touches_is_not_asked_again():
    coarse, fine = pressed(COARSE, (0.5, 1.5)), pressed(FINE, (0.5, 1.5)).frame
    aligned = align(coarse, Table(fine, contacts_of()), [FORCE])
    np.testing.assert_array_equal(aligned.b[FORCE], np.interp(COARSE, FINE, fine[FORCE]))
    assert not aligned.unknown
