r"""Methods of nonlinear dynamics on arrays: exponents from perturbed orbits, the 0-1 test, recurrence.

*Exponents.* Perturbed orbits are integrated beside an orbit, the logarithm of the growth of their distance is
recorded, and they are brought back along their direction to the initial distance (G. Benettin, L. Galgani, A.
Giorgilli, J.-M. Strelcyn, Meccanica 15 (1980) 9-30, Part 2) after each *stage*, of which a period has
several: a whole one takes a distance from round-off to the size of the attractor. One more perturbed orbit
starts every stage at round-off: how far it gets is the error of the computation. An orbit that does not get
`CLEAR` times as far is *collapsed*: its growth is only bounded from above, and it starts the next stage in
the direction that it had before.

*0-1 test* (G. A. Gottwald and I. Melbourne, SIAM J. Applied Dynamical Systems 8 (2009) 129-145, Eqs. 2.1-2.4
and Sec. 3.2). From a series phi_j, one value a period, the translation variables

.. math:: p_c(n) = \sum_{j \le n} \phi_j \cos jc, \quad q_c(n) = \sum_{j \le n} \phi_j \sin jc

stay bounded where the motion is regular and diffuse where it is chaotic. K_c is the correlation of their mean
square displacement with time: 0 regular, 1 chaotic; the median over c leaves out resonances with the series.
Noise passes for chaos.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from comparison.tables.channels import Array

CLEAR = 10.0  # times the error: there it changes the logarithm by at most 0.1
CONFIDENCE = 0.95
RESAMPLES = 2000
FEW = 0.1  # share of periods with a collapsed stage that is passed over
FREQUENCIES = 100
BAND = (np.pi / 5, 4 * np.pi / 5)  # rad, of c: away from 0, pi and 2 pi
LEAST = 100  # periods for the 0-1 test; a tenth of them is the longest displacement
LONGEST = 16  # the longest period of a section that is looked for


class Exponent(NamedTuple):
    """A largest Lyapunov exponent per period, with its confidence interval."""

    value: float
    low: float
    high: float
    collapsed: float  # share of the periods that give a bound only

    @property
    def measured(self) -> bool:
        """Whether few enough periods collapsed for ``value`` to be more than an upper bound."""
        return self.collapsed <= FEW

    @property
    def sign(self) -> int:
        """1 or -1 where the interval excludes 0; a bound can only tell that it is negative."""
        if self.high < 0.0:
            return -1
        return 1 if self.low > 0.0 and self.measured else 0


def exponents(
    orbit: Callable[[Array, int], tuple[Array, int]],
    perturbed: Callable[[Array, int, int], Array],
    start: Array,
    when: int,
    until: int,
    *,
    distances: Array,
    round_off: float,
    scale: Array,
    period: int,
    skip: int = 0,
) -> list[Exponent]:
    """Follow an orbit, which starts at a time, with its perturbed orbits; stages begin before ``until``.

    ``orbit`` takes a state and when it is to the end of a stage, which it chooses; ``perturbed`` a state from
    there to a given end, the same state to the same end. Coordinates are multiplied with ``scale`` before
    distances are taken; ``distances`` and ``round_off`` are those of the perturbed orbits at the start of a
    stage and of the one that shows the error. Returns the exponent of each distance per period: a stage
    belongs to that in which it begins; until ``skip`` periods have passed the directions settle.
    """
    state = np.asarray(start, dtype=np.float64)
    even = np.full(state.size, 1.0 / np.sqrt(state.size))
    directions = np.tile(even, (distances.size, 1))
    begins, logs, collapsed = [], [], []
    while when < until:
        after, end = orbit(state, when)
        drift = (perturbed(state + round_off * even / scale, when, end) - after) * scale
        error = float(np.linalg.norm(drift))
        starts = state + distances[:, None] * directions / scale
        apart = (np.array([perturbed(beside, when, end) for beside in starts]) - after) * scale
        grown = np.linalg.norm(apart, axis=1)
        lost = grown <= CLEAR * error
        directions[~lost] = apart[~lost] / grown[~lost, None]
        # Where even the error is zero, so may a distance be: the least number there is has a logarithm.
        least = np.maximum(CLEAR * error, np.finfo(float).tiny)
        begins.append(when)
        logs.append(np.log(np.maximum(grown, least) / distances))
        collapsed.append(lost)
        state, when = after, end
    periods = np.array(begins) // period
    periods -= periods[0]
    results = []
    for growth, lost in zip(np.transpose(logs), np.transpose(collapsed), strict=True):
        each = np.bincount(periods, weights=growth)[skip:].astype(np.float64)
        share = float(np.mean(np.bincount(periods, weights=lost)[skip:] > 0))
        results.append(Exponent(float(np.mean(each)), *mean_interval(each), share))
    return results


def mean_interval(values: Array, seed: int = 0) -> tuple[float, float]:
    """Return the confidence interval of the mean of a stationary series, shape (n,).

    Bootstrap of circular blocks of n^(1/3) periods, which keep the correlation of neighbours (D. N. Politis
    and J. P. Romano, in Exploring the Limits of Bootstrap, 1992, 263-270).
    """
    n = values.size
    length = max(1, round(n ** (1 / 3)))
    starts = np.random.default_rng(seed).integers(n, size=(RESAMPLES, -(-n // length)))
    rows = (starts[:, :, None] + np.arange(length)).reshape(RESAMPLES, -1)[:, :n] % n
    tail = 0.5 * (1.0 - CONFIDENCE)
    low, high = np.quantile(np.mean(values[rows], axis=1), (tail, 1.0 - tail))
    return float(low), float(high)


def chaos_indicator(series: Array) -> float:
    """Return K, the median of K_c over random c, of one value a period: near 0 regular, near 1 chaotic.

    Raises ValueError if the series is shorter than `LEAST`.
    """
    n, spread = series.size, np.std(series)
    if n < LEAST:
        raise ValueError(f"the 0-1 test needs {LEAST} periods or more, not {n}")
    if spread == 0.0:
        return 0.0
    # Shifted by its mean and scaled: neither changes K, and both keep the sums small.
    phi = (series - np.mean(series)) / spread
    c = np.random.default_rng(0).uniform(*BAND, FREQUENCIES)
    walk = np.cumsum(phi * np.exp(1j * np.outer(c, np.arange(1, n + 1))), axis=1)
    longest = n // 10
    start, lags = walk[:, : n - longest], np.arange(1, longest + 1)
    moved = [np.mean(np.abs(walk[:, k : k + n - longest] - start) ** 2, axis=1) for k in lags]
    return float(np.median([np.corrcoef(lags, displacement)[0, 1] for displacement in np.array(moved).T]))


def recurrence(section: Array, tolerance: float) -> int | None:
    """Return after how many periods, the fewest, the whole of a stroboscopic section repeats.

    The section has one value or state a period, shape (n,) or (n, k); two that are as close as the tolerance
    are the same. None: no period up to `LONGEST` holds, or the section is too short to show it twice.
    """
    points = section.reshape(len(section), -1)
    for count in range(1, min(LONGEST, len(points) // 2) + 1):
        if np.max(np.linalg.norm(points[count:] - points[:-count], axis=1)) <= tolerance:
            return count
    return None
