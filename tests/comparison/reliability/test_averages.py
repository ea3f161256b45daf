"""Averages over parts of the cycle: exact for what is linear, with what samples and cycles leave open.

Coverage of the intervals is measured on signals of which the truth is known.
"""

import numpy as np
import pytest
from scipy.signal import lfilter

from comparison.reliability.errors import (
    MANY,
    half_width,
    integrals,
    part_edges,
    standard_error,
)

REPEATED = 1000
SAMPLES = 100
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
    """A course locked to the crank, whose average is zero, and what varies around it."""
    shape = (REPEATED, cycles, SAMPLES)
    return {
        "independent": lambda: rng.normal(size=shape),
        "correlated": lambda: remembering(shape, 0.9, rng),  # over a tenth of the bin
        # A sine twice as large as the correlated noise around it
        "locked": lambda: locked(1.5) + 0.5 * remembering(shape, 0.8, rng),
        # Every cycle is off by a number of its own: all of a bin's samples together are worth one.
        "offset": lambda: locked(1.0) + 0.5 * rng.normal(size=shape[:2])[..., None] * np.ones(SAMPLES),
    }[kind]()


@pytest.mark.parametrize("kind", ["independent", "correlated", "locked", "offset"])
@pytest.mark.parametrize("cycles", [5, MANY])
def test_the_interval_of_an_average_covers_it_also_where_the_cycles_share_their_course(kind, cycles):
    errors = noise(kind, cycles, np.random.default_rng(cycles))
    widths, off = half_width(standard_error(errors)), np.abs(errors.mean((-2, -1)))
    # Estimated correlations cost 2 %.
    assert np.mean(off <= widths) >= 0.95 - CHANCE - 0.02
    # Nor is it merely wide: 1.96 deviations of the averages, but for few degrees of freedom.
    assert np.mean(widths) < (1.4 if cycles >= MANY else 2.2) * 1.96 * off.std() / np.sqrt(1 - 2 / np.pi)
    assert standard_error(np.tile(locked(2.0), (3, 1))).error == 0.0  # what repeats leaves nothing open


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
