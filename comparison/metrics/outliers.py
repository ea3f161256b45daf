"""Rank test of whether a run belongs to an ensemble of runs, and detection of clusters in an ensemble.

The statistic T of a run S is the largest |S - mean(M)| / max(std(M), u) over the samples of one channel, with
the members M; that of a member is against the others. If S is drawn as the members are, T(S) exceeds all
T(M_i), i = 1 ... n, about once in n + 1 draws, whatever the distribution (a permutation test; B. Phipson, G.
K. Smyth, Stat. Appl. Genet. Mol. Biol. 9, 2010, 39). Of several channels the largest T counts.
"""

from collections.abc import Sequence
from math import ceil
from typing import NamedTuple

import numpy as np
import pandas as pd

from comparison.metrics.contacts import WINDOW, starts_at
from comparison.tables.channels import CONTACTS, Array, BoolArray

# Gap over the wider of two groups. Errors of one kind do not look like that even if they spread over six
# decades; two families of trajectories, a contact apart, do.
SEPARATION = 3.0
SMALLEST = 0.05  # share of an ensemble that makes a cluster, and not a few stragglers; two members at least
PARTED = 0.9  # by how much the shares of two groups that have a contact must differ for it to part them


def distances(members: Array, run: Array, floor: Array) -> tuple[Array, float]:
    """Return T of one channel, for each of n >= 3 members left out, and for a run; zero without a sample.

    Shapes (n, m) and (m,). Without the floor u, shape (m,), the local errors of a solver would count.
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

    Of at least `SMALLEST` of the members each, farther apart than `SEPARATION` times either's width and the
    floor.
    """
    count = members.shape[0]
    least = max(2, ceil(SMALLEST * count))
    if count < 2 * least:
        return np.zeros(members.shape[1], dtype=np.bool_)
    ordered = np.sort(members, axis=0)
    gaps = np.diff(ordered, axis=0)[least - 1 : count - least]
    row, column = gaps.argmax(axis=0) + least - 1, np.arange(members.shape[1])
    below, above = ordered[row, column], ordered[row + 1, column]
    width = np.maximum(below - ordered[0], ordered[-1] - above)
    return np.asarray((above - below > SEPARATION * width) & (above - below > floor))


def split(values: Array) -> BoolArray:
    """Return which of the values lie above the widest gap between them, shape (n,)."""
    ordered = np.sort(values)
    return np.asarray(values > ordered[np.diff(ordered).argmax()])


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

    A run has a contact if one of the same corner starts within `WINDOW`. Those after ``until`` (s) are
    consequences.
    """
    partings = []
    window, sizes = WINDOW * period, (len(groups[0]), len(groups[1]))

    def near(instants: Array, starts: Array) -> BoolArray:
        return np.searchsorted(starts, instants + window) > np.searchsorted(starts, instants - window)

    for corner in CONTACTS:
        starts = [[starts_at(events, corner)[1] for events in group] for group in groups]
        candidates = np.concatenate([own for group in starts for own in group])
        candidates = candidates[candidates <= until]
        one, other = (np.sum([near(candidates, own) for own in group], axis=0) for group in starts)
        apart = np.abs(one / sizes[0] - other / sizes[1])
        if np.any(apart >= PARTED):
            # Of the starts of this contact in all runs that by which most of them are told apart.
            earliest = candidates[apart >= PARTED].min()
            nearby = np.flatnonzero((candidates >= earliest) & (candidates <= earliest + window))
            k = nearby[apart[nearby].argmax()]
            partings.append(Parting(corner, float(candidates[k]), (int(one[k]), int(other[k])), sizes))
    return min(partings, key=lambda parting: parting.start, default=None)
