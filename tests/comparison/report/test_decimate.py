"""A drawing of few points must show what the samples hold."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from comparison.report.decimate import envelope, spans, upper_envelope


@given(st.integers(2, 3000), st.integers(1, 50), st.integers(0, 2**32 - 1))
def test_envelope_keeps_the_extrema_of_every_column(n: int, columns: int, seed: int) -> None:
    values = np.random.default_rng(seed).standard_normal(n)
    kept = envelope(values, columns)
    assert np.all(np.diff(kept) > 0)
    assert kept[0] == 0
    assert kept[-1] == n - 1
    assert len(kept) <= max(2 * columns + 2, n if n <= 2 * columns else 0)
    edges = (np.arange(columns + 1) * n) // columns
    for start, stop in pairwise(edges):
        inside = values[kept[(kept >= start) & (kept < stop)]]
        if stop > start:
            assert inside.min() == values[start:stop].min()
            assert inside.max() == values[start:stop].max()


def test_one_sample_of_contact_force_in_a_hundred_cycles_is_kept() -> None:
    force = np.zeros(100_001)
    force[73_123] = 50.0
    kept = envelope(force)
    assert len(kept) <= 802  # two a column of 400, and both ends
    assert force[kept].max() == 50.0
    assert force[upper_envelope(force)].max() == 50.0


@given(st.integers(1, 3000), st.integers(1, 50), st.integers(0, 2**32 - 1))
def test_upper_envelope_is_the_maximum_of_each_column(n: int, columns: int, seed: int) -> None:
    values = np.random.default_rng(seed).standard_normal(n)
    kept = upper_envelope(values, columns)
    assert len(kept) == min(n, columns)
    edges = (np.arange(len(kept) + 1) * n) // len(kept)
    expected = [values[start:stop].max() for start, stop in pairwise(edges)]
    np.testing.assert_array_equal(values[kept], expected)


@given(st.lists(st.booleans(), min_size=2, max_size=400))
def test_spans_cover_the_mask_and_nothing_else(mask: list[bool]) -> None:
    time = np.arange(len(mask)) * 0.1
    # As many columns as samples: no stretch needs widening but the halves at both ends.
    found = spans(np.array(mask), time, columns=len(mask))
    covered = [any(low - 1e-12 <= t <= high + 1e-12 for low, high in found) for t in time]
    assert covered == mask
    assert all(end < start for (_, end), (start, _) in pairwise(found))


def test_a_single_sample_of_a_long_run_is_as_wide_as_a_column() -> None:
    mask = np.zeros(100_001, dtype=bool)
    mask[50_000] = True
    ((low, high),) = spans(mask, np.linspace(0.0, 40.0, mask.size), columns=400)
    assert high - low == pytest.approx(0.1)
    assert low < 20.0 < high


def test_widened_stretches_join_and_stay_inside() -> None:
    mask = np.zeros(1001, dtype=bool)
    mask[[0, 2, 1000]] = True
    assert spans(mask, np.linspace(0.0, 1.0, 1001), columns=100) == [
        (0.0, pytest.approx(0.007)),
        (pytest.approx(0.99475), 1.0),
    ]
