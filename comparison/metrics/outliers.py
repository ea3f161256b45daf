"""Rank test of whether a run belongs to an ensemble of runs, and detection of clusters in an ensemble.

The statistic T of a run S is the largest |S - mean(M)| / max(std(M), u) over the samples of one channel, with
the members M; that of a member is against the others. If S is drawn as the members are, T(S) exceeds all
T(M_i), i = 1 ... n, about once in n + 1 draws, whatever the distribution (a permutation test; B. Phipson, G.
K. Smyth, Stat. Appl. Genet. Mol. Biol. 9, 2010, 39). Of several channels the largest T counts.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil
from typing import NamedTuple

import numpy as np
import pandas as pd

from comparison.metrics.contacts import WINDOW, starts_at
from comparison.tables.arrays import Array, BoolArray
from comparison.tables.channels import CONTACTS

# Gap over the wider of two groups. Errors of one kind do not look like that even if they spread over six
# decades; two families of trajectories, a contact apart, do.
SEPARATION = 3.0
SMALLEST = 0.05  # share of an ensemble that makes a cluster, and not a few stragglers; two members at least
PARTED = 0.9  # by how much the shares of two groups that have a contact must differ for it to part them


def distances(members: Array, run: Array, floor: Array) -> tuple[Array, float]:
    """Return T of one channel, for each of n >= 3 members left out, and for a run; zero without a sample.

    Shapes (n, m) and (m,). The floor is the numerical uncertainty u, shape (m,), positive: without it the
    local errors of a solver would count, which moved starts do not show where motion forgets them.
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
    """Return the samples, shape (m,), at which an ensemble, shape (n, m), falls into two clusters.

    That is into groups of at least `SMALLEST` of the members each, farther apart than `SEPARATION` times the
    width of either, and than the floor.
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
    """A contact that the runs of one group have and those of another lack: so many runs of so many each."""

    corner: str
    start: float
    having: tuple[int, int]
    sizes: tuple[int, int]


def parting_contact(
    groups: tuple[Sequence[pd.DataFrame], Sequence[pd.DataFrame]], *, period: float, until: float
) -> Parting | None:
    """Find the first contact that parts two groups of runs, of their event tables; None where none does.

    A run has a contact if one of the same corner starts within `comparison.metrics.contacts.WINDOW` of a
    crank cycle of it. Contacts later than ``until`` (s) are consequences.
    """
    first = None
    window, sizes = WINDOW * period, (len(groups[0]), len(groups[1]))
    for corner in CONTACTS:
        starts = [[starts_at(events, corner)[1] for events in group] for group in groups]
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


def _near(instants: Array, starts: Array, window: float) -> BoolArray:
    first, last = (np.searchsorted(starts, instants + side * window) for side in (-1.0, 1.0))
    return np.asarray(last > first)
