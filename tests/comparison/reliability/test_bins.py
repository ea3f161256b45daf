"""Which samples are in which part of the cycle."""

from __future__ import annotations

import numpy as np

from comparison.reliability.bins import bins


def test_ten_bins_of_36_degrees_hold_their_upper_edge_and_not_their_lower():
    found = bins(10, 1000, 2000)
    assert [part.angle for part in found] == [36.0 * k for k in range(1, 11)]
    for part in found:
        assert part.rows.shape == (2, 100)
        angle = (part.rows + 1) * 0.36
        assert np.allclose(angle[:, -1] % 360.0 % part.angle, 0.0, atol=1e-9)  # 720 deg is 360 deg
        assert np.allclose(angle[0, 0], part.angle - 36.0 + 0.36)
    assert np.array_equal(np.sort(np.concatenate([part.rows.ravel() for part in found])), np.arange(2000))


def test_parts_that_do_not_divide_the_samples_still_hold_each_sample_once():
    for count, per_cycle in ((7, 1000), (10, 33), (3, 2), (16, 10)):
        found = bins(count, per_cycle, 3 * per_cycle)
        rows = np.concatenate([part.rows.ravel() for part in found])
        assert np.array_equal(np.sort(rows), np.arange(3 * per_cycle))
        for part in found:
            angle = (part.rows[0] + 1) * 360.0 / per_cycle
            assert np.all(angle <= part.angle * (1 + 1e-12))
            assert np.all(angle > part.angle - 360.0 / count - 1e-9)


def test_a_cycle_that_ends_inside_a_bin_counts_there_only_if_it_is_the_first():
    # A cycle and a half of the second bin, then less than the first bin.
    long = bins(4, 100, 100 + 37)
    assert [part.rows.shape[0] for part in long] == [2, 1, 1, 1]
    assert all(part.whole for part in long)
    (short,) = bins(4, 100, 10)
    assert short.rows.tolist() == [list(range(10))]
    assert not short.whole
