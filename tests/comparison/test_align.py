"""Two tables on one grid: nothing changes where nothing has to; interpolation has the order it claims."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from comparison.align import SAME_GRID, align
from comparison.table import Table, TableError

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
    # Wrapping rounds at 4e-15; the largest angle is 30, one turn of it is taken out at the start.
    np.testing.assert_allclose(aligned.a["slider_angle"], aligned.b["slider_angle"], rtol=0, atol=2e-14)


def test_half_a_turn_remains_a_difference():
    time = np.linspace(0, 4, 200)
    turned = wave(time)
    turned.frame["slider_angle"] += 3.0
    aligned = align(wave(time), turned, NAMES)
    np.testing.assert_allclose(aligned.b["slider_angle"] - aligned.a["slider_angle"], 3.0, atol=1e-14)
