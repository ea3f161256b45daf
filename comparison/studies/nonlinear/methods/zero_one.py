r"""The 0-1 test for chaos of Gottwald and Melbourne.

From a series phi_j that is sampled once a period, two translation variables are built,

.. math:: p_c(n) = \sum_{j \le n} \phi_j \cos jc, \quad q_c(n) = \sum_{j \le n} \phi_j \sin jc .

They stay bounded where the motion is regular and diffuse like a random walk where it is chaotic. K_c is the
correlation of their mean square displacement with time: 0 regular, 1 chaotic. The median over c leaves out
the few c that resonate with a frequency of the series.

The test hears noise as chaos: it says nothing about where an irregular series comes from.

Source: G. A. Gottwald and I. Melbourne, On the implementation of the 0-1 test for chaos, SIAM J. Applied
Dynamical Systems 8 (2009) 129-145: Eqs. (2.1)-(2.4), the correlation method of Sec. 3.2.
"""

from __future__ import annotations

import numpy as np

from comparison.tables.arrays import Array

FREQUENCIES = 100
BAND = (np.pi / 5, 4 * np.pi / 5)
"""rad: away from 0, pi and 2 pi, as the authors do."""
LEAST = 100
"""Periods; a tenth of them is the longest displacement, and fewer than ten say nothing of growth."""


def growth_rates(series: Array) -> Array:
    """Return K_c for `FREQUENCIES` random c, shape (FREQUENCIES,), of one value a period, shape (n,).

    Raises
    ------
    ValueError
        If the series is shorter than `LEAST`.
    """
    n = series.size
    if n < LEAST:
        raise ValueError(f"the 0-1 test needs {LEAST} periods or more, not {n}")
    longest = n // 10
    c = np.random.default_rng(0).uniform(*BAND, FREQUENCIES)
    # Shifted by its mean and scaled: neither changes K, and both keep the sums small.
    spread = np.std(series)
    if spread == 0.0:
        return np.zeros(FREQUENCIES)
    phi = (series - np.mean(series)) / spread
    walk = np.cumsum(phi * np.exp(1j * np.outer(c, np.arange(1, n + 1))), axis=1)
    start = walk[:, : n - longest]
    lags = np.arange(1, longest + 1)
    displacement = np.stack(
        [np.mean(np.abs(walk[:, k : k + n - longest] - start) ** 2, axis=1) for k in lags], axis=1
    )
    # The bounded oscillation that a mean of phi would add is zero after the shift: M_c = D_c.
    time = lags - np.mean(lags)
    apart = displacement - np.mean(displacement, axis=1, keepdims=True)
    size = np.sqrt(np.sum(time**2) * np.sum(apart**2, axis=1))
    return np.asarray(np.divide(apart @ time, size, out=np.zeros_like(size), where=size > 0))


def chaos_indicator(series: Array) -> float:
    """Return K, the median of `growth_rates`: near 0 for a regular series, near 1 for a chaotic one."""
    return float(np.median(growth_rates(series)))
