"""Averages over parts of the cycle: exact for what is linear, with what samples and cycles leave open.

Coverage of the intervals is measured on signals of which the truth is known.
"""

from itertools import product

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import norm

from comparison.reliability.errors import (
    ENOUGH,
    half_width,
    integrals,
    part_edges,
    proportion,
    standard_error,
)

REPEATED = 1000
SAMPLES = 100
LIMIT = 1.0
# Of 1000 intervals with a probability of 0.95 each, the share that covers is within 0.021 of it in 99.7 %.
CHANCE = 3 * np.sqrt(0.95 * 0.05 / REPEATED)


def remembering(shape, phi, rng):
    """Normal noise of unit variance whose neighbours along the last axis are correlated by phi."""
    steps = rng.normal(size=shape)
    steps[..., 0] /= np.sqrt(1 - phi**2)
    return lfilter([1.0], [1.0, -phi], steps, axis=-1) * np.sqrt(1 - phi**2)


def locked(amplitude):
    return amplitude * np.sin(2 * np.pi * np.arange(SAMPLES) / SAMPLES)


def noise(kind, cycles, rng):
    """Course locked to the crank and what varies around it, (REPEATED, cycles, SAMPLES), P(|e| <= LIMIT)."""
    shape = (REPEATED, cycles, SAMPLES)
    course, deviation, around = {
        "independent": (locked(0.0), 1.0, lambda: rng.normal(size=shape)),
        "correlated": (locked(0.0), 1.0, lambda: remembering(shape, 0.9, rng)),  # over a tenth of the bin
        "rare": (locked(0.0), 1.0, lambda: remembering(shape, 0.9, rng)),
        # A sine twice as large as the correlated noise around it
        "locked": (locked(1.5), 0.5, lambda: remembering(shape, 0.8, rng)),
        # Every cycle is off by a number of its own: all of a bin's samples together are worth one.
        "offset": (locked(1.0), 0.5, lambda: rng.normal(size=shape[:2])[..., None] * np.ones(SAMPLES)),
    }[kind]
    limit = 2.5 if kind == "rare" else LIMIT
    exact = np.mean(norm.cdf((limit - course) / deviation) - norm.cdf((-limit - course) / deviation))
    return course + deviation * around(), exact


@pytest.mark.parametrize(
    ("kind", "cycles", "least"),
    [
        # An interval by Clopper and Pearson may cover more than it says, and estimated correlations cost 2 %.
        *product(["independent", "correlated", "locked", "offset"], [5, ENOUGH, 60], [0.95 - CHANCE - 0.02]),
        # The paper's number of cycles: measured 92, 91 and 89 %.
        ("correlated", 2, 0.89),
        ("locked", 2, 0.89),
        ("offset", 2, 0.84),
        # One sample in eighty, so that most runs show none: measured 99, 89 and 94 %, where resampling covers
        # 59, 67 and 88 %.
        *product(["rare"], [2, 5, ENOUGH], [0.86]),
    ],
)
def test_the_interval_of_the_share_within_a_limit_covers_it_as_often_as_it_says(kind, cycles, least):
    errors, exact = noise(kind, cycles, np.random.default_rng([cycles, len(kind)]))
    within = np.abs(errors) <= (2.5 if kind == "rare" else LIMIT)
    share, (low, high) = within.mean((-2, -1)), proportion(within, np.abs(errors))
    assert np.mean((low <= exact) & (exact <= high)) >= least
    assert np.all((low <= share) & (share <= high))
    # Nor is it merely wide: twice 1.96 deviations of the shares that were found, but for few degrees of
    # freedom (Student's 2.78 for four) and an interval that covers at least what it says.
    if kind != "rare" and cycles > 2:
        assert np.mean(high - low) < (1.4 if cycles >= ENOUGH else 2.2) * 2 * 1.96 * share.std()


@pytest.mark.parametrize("cycles", [5, ENOUGH])
def test_the_interval_of_an_average_covers_it_also_where_the_cycles_share_their_course(cycles):
    errors, _ = noise("locked", cycles, np.random.default_rng(cycles))
    estimate = standard_error(errors)
    error = np.abs(errors.mean((-2, -1)))  # the sine's average is zero
    assert np.mean(error <= half_width(estimate)) == pytest.approx(0.95, abs=CHANCE + 0.02)
    # 100 samples that remember 9 of each other, in each cycle: (1 + 0.8) / (1 - 0.8) = 9.
    known = cycles * SAMPLES / 9 if cycles < ENOUGH else cycles
    assert np.median(estimate.independent) == pytest.approx(known, rel=0.2)


def test_what_repeats_exactly_leaves_nothing_open():
    errors = np.tile(locked(2.0), (3, 1))
    assert standard_error(errors).error == 0.0
    within = np.abs(errors) <= LIMIT
    low, high = proportion(within, np.abs(errors))
    # Three equal cycles are worth three draws, whatever their share.
    assert low < within.mean() < high


def test_where_all_samples_are_within_the_interval_is_that_of_so_many_independent_ones():
    errors = np.random.default_rng(6).uniform(0.0, 0.5, (4, SAMPLES))
    low, high = proportion(errors <= LIMIT, errors)
    assert high == 1.0
    # 400 independent values; the estimate of their number is good to some tens of percent.
    assert 1 - low == pytest.approx(1 - 0.025 ** (1 / 400), rel=0.5)
    assert proportion(errors > LIMIT, errors) == (0.0, pytest.approx(1 - low))
    same = np.tile(errors[:, :1], (1, SAMPLES))  # one value a cycle
    assert 1 - proportion(same <= LIMIT, same)[0] == pytest.approx(1 - 0.025 ** (1 / 4), rel=1e-9)


@pytest.mark.parametrize(
    ("end", "count", "edges"),
    [
        (0.8, 10, 0.04 * np.arange(21)),
        # A cycle and a half of the second part, then less than a part: that is left out.
        (0.4 * 1.37, 4, 0.1 * np.arange(6)),
        # But of a run shorter than a cycle it is the last one.
        (0.4 * 0.37, 4, [0.0, 0.1, 0.148]),
        (0.024, 10, [0.0, 0.024]),
    ],
)
def test_parts_follow_each_other_as_far_as_the_run_goes(end, count, edges):
    assert part_edges(end, 0.4, count) == pytest.approx(edges, rel=1e-14)


@pytest.mark.parametrize("seed", range(5))
def test_what_is_linear_between_samples_is_integrated_exactly_wherever_the_edges_are(seed):
    rng = np.random.default_rng(seed)
    time = np.sort(np.append(rng.uniform(0.0, 1.0, 40), [0.0, 1.0]))
    values, edges = rng.normal(size=(2, time.size)), np.sort(np.append(rng.uniform(0.0, 1.0, 6), [0.0, 1.0]))
    # Gauss's rule of two points in every interval between samples and edges: exact for straight lines.
    every = np.unique(np.concatenate([time, edges]))
    nodes = 0.5 * (every[1:] + every[:-1]) + 0.5 * np.diff(every) * np.array([[-1], [1]]) / np.sqrt(3.0)
    for row, result in zip(values, integrals(time, values, edges), strict=True):
        pieces = np.diff(every) * np.interp(nodes, time, row).mean(0)
        exact = np.add.reduceat(pieces, np.searchsorted(every, edges[:-1]))
        assert result == pytest.approx(exact, abs=1e-14)
