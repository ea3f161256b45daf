"""Missing rows: told from the times alone, whatever steps a program takes."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from comparison.tables.times import Hole, holes, isolated

EVEN = np.arange(201) * 0.01


@given(first=st.integers(1, 198), count=st.integers(1, 150))
def test_rows_taken_out_of_equidistant_times_are_counted(first, count):
    kept = np.delete(EVEN, np.arange(first, min(first + count, 200)))
    (hole,) = holes(kept)
    assert hole == Hole(EVEN[first - 1], kept[first], 201 - kept.size)


@pytest.mark.parametrize(
    "time",
    [
        EVEN,
        np.round(np.arange(100) / 30, 4),  # few digits: steps of 0.0333 and 0.0334
        np.round(np.arange(100) * 0.015, 2),  # steps of 0.01 and 0.02 in turn
        np.geomspace(1e-6, 1.0, 50),  # a solver that gets faster
        np.sort(np.concatenate([EVEN, [0.1234, 1.2345]])),  # rows at events
        np.concatenate([k + np.append(np.arange(20) * 1e-5, 0.1) for k in range(10)]),  # bursts at contacts
        np.array([0.0, 1.0]),
        np.array([0.0, 1.0, 100.0]),
    ],
)  # fmt: skip
def test_steps_of_a_solver_are_no_holes(time):
    assert holes(time) == []


def test_a_hole_in_times_of_varying_steps():
    rng = np.random.default_rng(0)
    time = np.cumsum(rng.uniform(0.5e-3, 2e-3, 1000))
    kept = np.delete(time, np.arange(300, 800))
    assert holes(time) == []
    assert holes(kept) == [Hole(time[299], time[800], 0)]


def test_a_sample_that_stands_out_is_told_by_its_distance():
    values = 3.0 * EVEN
    values[70] += 1.0
    distance = isolated(EVEN, values, 0.6)
    assert np.flatnonzero(distance).tolist() == [70]
    assert distance[70] == pytest.approx(1.0, rel=1e-12)  # sums of a few numbers around 1
