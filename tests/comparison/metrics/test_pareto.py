"""The Pareto front is what nothing beats."""

import numpy as np
import pytest

from comparison.accuracy.work_precision import pareto


@pytest.mark.parametrize("seed", range(5))
def test_of_any_two_points_of_the_front_neither_beats_the_other_and_the_rest_is_beaten(seed):
    rng = np.random.default_rng(seed)
    error, cost = rng.integers(0, 12, 40).astype(float), rng.integers(0, 12, 40).astype(float)
    front = pareto(error, cost)

    def beaten(one):
        as_good = (error <= error[one]) & (cost <= cost[one])
        return bool((as_good & ((error < error[one]) | (cost < cost[one]))).any())

    points = set(zip(error[front], cost[front], strict=True))
    assert len(points) == front.sum()  # equal points once
    for one in range(40):
        assert ((error[one], cost[one]) in points) != beaten(one)


def test_no_points_have_no_front():
    assert pareto(np.empty(0), np.empty(0)).size == 0
