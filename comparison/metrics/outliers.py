"""Rank test of whether a run belongs to an ensemble of runs, and detection of clusters in an ensemble.

For one channel with members M_i, i = 1 ... n, and a run S, at the same m samples:

    T(S)   = max over samples of |S - mean(M)| / max(std(M), u)
    T(M_i) = the same of M_i against the other members, without M_i.

If S is drawn as the members are, every one of the n + 1 runs is as likely as any other to be the farthest
out, whatever the distribution, so T(S) exceeds all T(M_i) about once in n + 1 draws (a permutation test;
B. Phipson, G. K. Smyth, Stat. Appl. Genet. Mol. Biol. 9, 2010, 39). Less often where errors spread over
decades, since the farthest member widens the ensemble for S but not for itself: half as often, measured over
six decades. Of several channels the largest T counts, so that it stays one statistic.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil
from typing import NamedTuple

import numpy as np
import pandas as pd

from comparison.metrics.contacts import WINDOW
from comparison.tables.arrays import Array, BoolArray
from comparison.tables.channels import CONTACTS

# Gap over the wider of two groups. Errors of one kind do not look like that even if they spread over six
# decades; two families of trajectories, a contact apart, do.
SEPARATION = 3.0
SMALLEST = 0.05
"""Share of an ensemble that makes a cluster, and not a few stragglers; two members at least."""
PARTED = 0.9
"""By how much the shares of two groups that have a contact must differ for it to part them."""


def distances(members: Array, run: Array, floor: Array) -> tuple[Array, float]:
    """Evaluate the statistic of one channel, for each member left out and for a run.

    Parameters
    ----------
    members
        Values of the ensemble, shape (n, m), n >= 3.
    run
        Of the run, shape (m,).
    floor
        The numerical uncertainty u, below which no distance is significant, shape (m,), positive. Without it
        the local errors of a solver would count, which moved starts do not show where motion forgets them.

    Returns
    -------
    members, run
        T of each, shape (n,), and of the run; zero without a sample.
    """
    count = members.shape[0]
    if not run.size:
        return np.zeros(count), 0.0
    centre = members.mean(axis=0)
    off = members - centre
    squares = (off**2).sum(axis=0)
    away = float((np.abs(run - centre) / np.maximum(np.sqrt(squares / count), floor)).max())
    # Without member i the mean moves by -off_i / (n - 1); the sum of squares about it follows from that.
    rest = np.maximum(squares - off**2 * (count / (count - 1)), 0.0) / (count - 1)
    left_out = np.abs(off) * (count / (count - 1)) / np.maximum(np.sqrt(rest), floor)
    return left_out.max(axis=1), away


def clustered(members: Array, floor: Array) -> BoolArray:
    """Return the samples at which an ensemble falls into two clusters, shape (m,).

    That is into groups of at least `SMALLEST` of the members each, farther apart than `SEPARATION` times the
    width of either, and than the floor.

    Parameters
    ----------
    members
        Values of the ensemble, shape (n, m).
    floor
        The numerical uncertainty, shape (m,).
    """
    count = members.shape[0]
    least = max(2, ceil(SMALLEST * count))
    if count < 2 * least:
        return np.zeros(members.shape[1], dtype=np.bool_)
    ordered = np.sort(members, axis=0)
    gaps = np.diff(ordered, axis=0)[least - 1 : count - least]
    row, column = gaps.argmax(axis=0) + least - 1, np.arange(members.shape[1])
    gap = ordered[row + 1, column] - ordered[row, column]
    width = np.maximum(ordered[row, column] - ordered[0], ordered[-1] - ordered[row + 1, column])
    parted: BoolArray = (gap > SEPARATION * width) & (gap > floor)
    return parted


def split(values: Array) -> BoolArray:
    """Return which of the values lie above the widest gap between them, shape (n,)."""
    ordered = np.sort(values)
    above: BoolArray = values > ordered[np.diff(ordered).argmax()]
    return above


class Parting(NamedTuple):
    """A contact that the runs of one group have and those of another lack."""

    corner: str
    start: float
    having: tuple[int, int]
    """How many runs of either group have it."""
    sizes: tuple[int, int]
    """How many runs either group has."""


def parting_contact(
    groups: tuple[Sequence[pd.DataFrame], Sequence[pd.DataFrame]], *, period: float, until: float
) -> Parting | None:
    """Find the first contact that parts two groups of runs; None where no contact does.

    Parameters
    ----------
    groups
        The event tables of each, none empty of tables. A run has a contact if one of the same corner starts
        within `comparison.metrics.contacts.WINDOW` of a crank cycle of it.
    period
        Of a crank cycle, s.
    until
        s; later contacts are consequences.
    """
    first = None
    window, sizes = WINDOW * period, (len(groups[0]), len(groups[1]))
    for corner in CONTACTS:
        starts = [[_starts(events, corner) for events in group] for group in groups]
        candidates = np.concatenate([own for group in starts for own in group])
        candidates = candidates[candidates <= until]
        one, other = (np.sum([_near(candidates, own, window) for own in group], axis=0) for group in starts)
        apart = np.abs(one / sizes[0] - other / sizes[1])
        if not np.any(apart >= PARTED):
            continue
        # Of the starts of this contact in all runs that by which most of them are told apart.
        earliest = candidates[apart >= PARTED].min()
        nearby = np.flatnonzero((candidates >= earliest) & (candidates <= earliest + window))
        k = int(nearby[apart[nearby].argmax()])
        if first is None or candidates[k] < first.start:
            first = Parting(corner, float(candidates[k]), (int(one[k]), int(other[k])), sizes)
    return first


def _starts(events: pd.DataFrame, corner: str) -> Array:
    starts = events["start"].to_numpy(np.float64)[(events["corner"] == corner).to_numpy()]
    return np.sort(starts)


def _near(instants: Array, starts: Array, window: float) -> BoolArray:
    """Return whether a start lies within the window of each instant, shape (n,)."""
    first, last = (np.searchsorted(starts, instants + side * window) for side in (-1.0, 1.0))
    return np.asarray(last > first)
