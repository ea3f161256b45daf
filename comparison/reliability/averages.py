r"""Time averages over parts of the crank cycle, and by how much they may be wrong.

Between its samples a signal is taken as linear: the trapezoidal rule, exactly over each part, whether or not
its edges are samples. What that misses is estimated from the samples in two ways.

- *Half the samples*, every second one, from the first or from the second: the average by all of them is the
  mean of those by either half, so that it differs from these as much as it errs itself where the signal is
  rough, and three times as much where it is smooth.
- *The integral*: where that is sampled too, as the velocity is that of the acceleration, its change over an
  interval is known, and with it what the trapezoidal rule makes of a pulse of which a sample shows nothing,
  or of one that lasts less than an interval and is hit.

Both are as often positive as negative where samples hit or miss short pulses. So they are taken by blocks of
each part of each cycle, and squares add up; twice the root is stated, which holds 95 % of normal errors.

**How good it is.** Share of the parts of the cycle in which beta by 120,000 samples a cycle lies within the
stated error, of the paper's cases and 60 random scenes of the campaign. Displacement and velocity: 98 % on
100 samples a cycle, more than 99.5 % from 200 on. Acceleration, whose pulses last a 2000th of a cycle:
96 % on 100 samples, 98 % on 200, 99 % from 300 on, where the table has the model's extrema, which tell how
high pulses between samples are. Of tables without extrema 83 % on 100, 91 % on 200, 94 % on 300, 99 % from
1000 on. On 10,000 samples the error stated of the central case's R is 4e-5, while 7e-7 is made.
"""

from __future__ import annotations

import numpy as np

from comparison.tables.arrays import Array

BLOCKS = 8
"""Of a part in one cycle."""
SAFETY = 2.0
"""Of a normal error's deviation, 95 %."""


def part_edges(end: float, period: float, count: int) -> Array:
    """Return the edges of the parts that a run covers one after the other, s, from 0.

    Parameters
    ----------
    end
        Of the run, s.
    period
        Of a crank cycle, s.
    count
        Equal parts of a cycle.

    Returns
    -------
    ndarray
        Shape (n + 1,): n whole parts; of a run shorter than a cycle also its last, incomplete one.
    """
    width = period / count
    whole = int(end / width + 1e-9)
    edges = width * np.arange(whole + 1)
    is_incomplete = whole < count and end > edges[-1] + 1e-9 * width
    return np.append(edges, [end] if is_incomplete else [])


def blocks(edges: Array) -> Array:
    """Return the edges of `BLOCKS` equal blocks of each of n parts, shape (n BLOCKS + 1,)."""
    return np.interp(np.arange((edges.size - 1) * BLOCKS + 1) / BLOCKS, np.arange(edges.size), edges)


def integrals(time: Array, values: Array, edges: Array) -> Array:
    """Return the integrals between successive edges of what is linear between samples.

    Parameters
    ----------
    time
        Of the samples, s, strictly increasing, shape (n,), n >= 2.
    values
        Shape (..., n).
    edges
        Within the samples' span but for rounding, s, shape (m + 1,).

    Returns
    -------
    ndarray
        Shape (..., m).
    """
    step = np.diff(time)
    total = np.zeros(values.shape)
    np.cumsum(0.5 * step * (values[..., 1:] + values[..., :-1]), axis=-1, out=total[..., 1:])
    left = np.clip(np.searchsorted(time, edges, side="right") - 1, 0, step.size - 1)
    into = edges - time[left]
    slope = (values[..., left + 1] - values[..., left]) / step[left]
    return np.asarray(np.diff(total[..., left] + into * (values[..., left] + 0.5 * slope * into)))


def halved(time: Array, values: Array, edges: Array) -> Array:
    """Return by how much the integrals of each block change with either half of the samples.

    Parameters as of `integrals`, with the edges of n parts; shape (..., n, 2 BLOCKS).
    """
    changes = []
    for half in (slice(None, None, 2), slice(1, None, 2)):
        rows = [np.interp(time, time[half], row[half]) for row in values.reshape(-1, time.size)]
        changes.append(integrals(time, values - np.reshape(rows, values.shape), blocks(edges)))
    shape = (*values.shape[:-1], edges.size - 1, BLOCKS)
    return np.concatenate([change.reshape(shape) for change in changes], axis=-1)


def mismatch(time: Array, values: Array, primitive: Array, edges: Array) -> Array:
    """Return by how much the change of a signal's integral exceeds the integral of its size over each block.

    Parameters
    ----------
    time, values, edges
        As of `integrals`, with the edges of n parts.
    primitive
        Whose rate the signal is, shape (n,).

    Returns
    -------
    ndarray
        Shape (n, BLOCKS).
    """
    sizes = np.abs(values)
    excess = np.abs(np.diff(primitive)) - 0.5 * np.diff(time) * (sizes[1:] + sizes[:-1])
    total = np.concatenate([[0.0], np.cumsum(excess)])
    return np.asarray(np.diff(np.interp(blocks(edges), time, total))).reshape(-1, BLOCKS)


def quadrature_error(halves: Array, excess: Array) -> float:
    """Return the error of the average over one part of N cycles.

    Parameters
    ----------
    halves, excess
        What `halved` and `mismatch` say of the cycles, shape (N, 2 BLOCKS) and (N, BLOCKS), as averages over
        the part.
    """
    # Either half of the samples says the same, so that of 2 BLOCKS squares half the sum counts.
    found = np.sqrt(0.5 * np.sum(halves**2)) + np.sqrt(np.sum(excess**2))
    return SAFETY * float(found) / len(excess)
