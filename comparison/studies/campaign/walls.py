"""What a table shows against its own model: a corner in its wall outside contacts, contacts that overlap.

Written from the tables alone, on purpose: it shares nothing with the code by which a model locates contacts.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import label

from comparison.tables.channels import CORNERS, touching
from comparison.tables.table import Table

OPEN_DEPTH = 1e-11
"""m. A touch is located to where the gap rounds, a difference of coordinates of half a metre, 1e-16 m times
the tens of operations it is made of; the interpolant of a sample errs by the tolerance, 1e-12 to 1e-11."""
OVERLAP = 1e-12
"""s. A corner that leaves and touches again at one instant ends one contact and begins another at one number;
time in a run of seconds rounds at 1e-15 s."""


@dataclass(frozen=True)
class Breach:
    """Something that no correct run shows."""

    name: str
    """"open-depth" or "overlap", as the models call these invariants."""
    corner: str
    """Of `comparison.tables.channels.CORNERS`; for overlaps also "pin"."""
    time: float
    """s: of the deepest sample; where the overlap begins."""
    value: float
    bound: float
    """m or s."""
    since: float
    until: float
    """s: first and last of the consecutive samples about it that are outside the bound; an overlap's ends."""


def breaches(table: Table) -> list[Breach]:
    """Return the worst breach of each kind and corner; none of a table without contacts recorded."""
    if table.events is None:
        return []
    return [*_inside(table), *_overlapping(table)]


def _inside(table: Table) -> Iterator[Breach]:
    events, time = table.events, table.time
    assert events is not None
    for corner in CORNERS:
        channel = f"corner_{corner}_gap"
        if channel not in table.frame:
            continue
        gap = table.values(channel)
        sharing = touching(corner, table.provenance.get("scene", {}))
        own = events.loc[events["corner"].isin(sharing), ["start", "end"]].to_numpy(float)
        # How many contacts have begun before a sample, less how many have ended: closed intervals.
        begun = np.searchsorted(np.sort(own[:, 0]), time, side="right")
        over = np.searchsorted(np.sort(own[:, 1]), time, side="left")
        inside = (begun == over) & (gap < -OPEN_DEPTH)
        if inside.any():
            at = int(np.where(inside, gap, np.inf).argmin())
            labels, _ = label(inside)
            since, until = np.flatnonzero(labels == labels[at])[[0, -1]]
            yield Breach(
                "open-depth", corner, float(time[at]), float(-gap[at]), OPEN_DEPTH,
                float(time[since]), float(time[until]),
            )  # fmt: skip


def _overlapping(table: Table) -> Iterator[Breach]:
    events = table.events
    assert events is not None
    scene = table.provenance.get("scene", {})
    for corner, own in events.groupby(events["corner"].map(lambda place: touching(place, scene)[0])):
        ordered = own.sort_values("start", kind="stable")
        starts, ends = ordered["start"].to_numpy(float), ordered["end"].to_numpy(float)
        # The latest end so far: a long contact may cover several later ones.
        overlap = np.maximum.accumulate(ends)[:-1] - starts[1:]
        if overlap.size and overlap.max() > OVERLAP:
            at = int(overlap.argmax())
            begin = float(starts[at + 1])
            yield Breach("overlap", str(corner), begin, float(overlap[at]), OVERLAP, begin, float(ends[at]))
