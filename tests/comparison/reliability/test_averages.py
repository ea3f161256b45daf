"""Averages over parts of the cycle: exact for what is linear, with an error that says how much is missed."""

from __future__ import annotations

import numpy as np
import pytest

from comparison.reliability.averages import (
    BLOCKS,
    SAFETY,
    halved,
    integrals,
    mismatch,
    part_edges,
    quadrature_error,
)


def error_of(time, values, edges):
    """The stated error of the average of each of the parts between edges, each of one cycle."""
    width = np.diff(edges)[:, None]
    changes = halved(time, values, edges) / width
    none = np.zeros((1, BLOCKS))
    return np.array([quadrature_error(part[None], none) for part in changes])


def test_parts_follow_each_other_as_far_as_the_run_goes():
    assert part_edges(0.8, 0.4, 10) == pytest.approx(0.04 * np.arange(21), rel=1e-14)
    # A cycle and a half of the second part, then less than a part: that is left out.
    assert part_edges(0.4 * 1.37, 0.4, 4) == pytest.approx(0.1 * np.arange(6), rel=1e-14)
    # But of a run shorter than a cycle it is the last one.
    assert part_edges(0.4 * 0.37, 0.4, 4) == pytest.approx([0.0, 0.1, 0.148], rel=1e-14)
    assert part_edges(0.024, 0.4, 10) == pytest.approx([0.0, 0.024], rel=1e-14)


@pytest.mark.parametrize("seed", range(5))
def test_what_is_linear_between_samples_is_integrated_exactly_wherever_the_edges_are(seed):
    rng = np.random.default_rng(seed)
    time = np.sort(np.append(rng.uniform(0.0, 1.0, 40), [0.0, 1.0]))
    values, edges = rng.normal(size=(2, time.size)), np.sort(np.append(rng.uniform(0.0, 1.0, 6), [0.0, 1.0]))
    # Gauss's rule of two points in every interval between samples and edges: exact for straight lines.
    every = np.unique(np.concatenate([time, edges]))
    nodes = 0.5 * (every[1:] + every[:-1]) + 0.5 * np.diff(every) * np.array([[-1], [1]]) / np.sqrt(3.0)
    for row, found in zip(values, integrals(time, values, edges), strict=True):
        pieces = np.diff(every) * np.interp(nodes, time, row).mean(0)
        exact = np.add.reduceat(pieces, np.searchsorted(every, edges[:-1]))
        assert found == pytest.approx(exact, abs=1e-14)


@pytest.mark.parametrize("samples", [100, 101, 333, 1000])
def test_the_error_of_a_smooth_signal_is_stated_and_falls_with_the_square_of_the_interval(samples):
    time, edges = np.linspace(0.0, 1.0, samples + 1), np.linspace(0.0, 1.0, 8)
    values = np.sin(7 * time) ** 2
    antiderivative = edges / 2 - np.sin(14 * edges) / 28
    exact = np.diff(antiderivative) / np.diff(edges)
    found = integrals(time, values, edges) / np.diff(edges)
    stated = error_of(time, values, edges)
    # h^2 / 12 times the change of the slope, which is 14 sin(14 t) / 2 ... at most 98 a unit of time.
    assert np.all(np.abs(found - exact) <= 98 / 12 / samples**2 * 1.01)
    assert np.all(np.abs(found - exact) <= stated)
    # Half the samples err by four times as much, and differ by three; the squares of blocks add up to less.
    assert np.all(stated <= SAFETY * 3 * 98 / 12 / samples**2 * 1.3)


@pytest.mark.parametrize("samples", [300, 1000, 3000])
def test_the_error_of_pulses_that_samples_hit_or_miss_is_stated(samples):
    """Half waves of about a thousandth at random: each hit counts an interval, each miss nothing."""
    rng = np.random.default_rng(samples)
    inside = []
    for _ in range(200):
        starts, height = rng.uniform(0.0, 0.998, 40), rng.uniform(0.5, 1.0, 40)
        # Of one length, three intervals to a pulse say the same by either half whatever they err.
        length = rng.uniform(0.5e-3, 2e-3, 40)
        time = np.linspace(0.0, 1.0, samples + 1)
        phase = (time[:, None] - starts) / length
        values = np.where((phase > 0) & (phase < 1), height * np.sin(np.pi * phase), 0.0).sum(1)
        exact = float((height * length).sum() * 2 / np.pi)
        edges = np.array([0.0, 1.0])
        inside.append(
            abs(float(integrals(time, values, edges)[0]) - exact) <= error_of(time, values, edges)[0]
        )
    # 95 % are promised of normal errors; these are of few hits. Three deviations of 200 draws: 0.046.
    assert np.mean(inside) >= 0.95 - 0.05


def test_the_integral_tells_of_pulses_between_all_samples():
    time, edges = np.linspace(0.0, 1.0, 101), np.linspace(0.0, 1.0, 5)
    values = np.zeros(101)
    primitive = np.where(time > 0.304, 2.0, 0.0) - np.where(time > 0.605, 0.5, 0.0)
    found = mismatch(time, values, primitive, edges)
    assert found.sum(1) == pytest.approx([0.0, 2.0, 0.5, 0.0], abs=1e-15)
    # One that is hit and lasts a tenth of an interval: nine tenths are too much.
    values[40], primitive = 10.0, np.where(time >= 0.40, 0.01, 0.0)
    assert mismatch(time, values, primitive, edges).sum(1) == pytest.approx([0, 0.01 - 0.1, 0, 0], abs=1e-15)


def test_cycles_are_averaged_and_their_errors_add_up_by_squares():
    halves, excess = np.zeros((4, 2 * BLOCKS)), np.zeros((4, BLOCKS))
    # 1 by either half in one block of each cycle.
    halves[:, [0, BLOCKS]] = 1.0
    assert quadrature_error(halves, excess) == pytest.approx(SAFETY / 2)
    excess[0, 3] = 3.0
    assert quadrature_error(0 * halves, excess) == pytest.approx(SAFETY * 3.0 / 4)
