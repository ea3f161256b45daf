"""Time shares of the paper's four contact situations of the slider (Sec. 2, Fig. 3).

A wall is touched by no corner, one or both of its own. Two opposite corners (Fig. 3b) means contact at both
walls at once, whichever corners: the slider is narrower than its guide, so lower left and lower right
cannot touch together, and what is left are the two diagonals.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TypeVar

import numpy as np
import pandas as pd

from comparison.tables.arrays import Array, BoolArray
from comparison.tables.channels import CORNERS, PIN
from comparison.verdict.results import SceneComparison

SITUATIONS = {
    "free": "free",
    "one_corner": "one corner",
    "one_side": "two corners of one side",
    "opposite": "two opposite corners",
}
"""Situations by key, with their descriptions."""

Shares = Mapping[str, float]
T = TypeVar("T")


def time_shares(events: pd.DataFrame, span: tuple[float, float]) -> Shares:
    """Return the share of a span of time that the slider spends in each situation.

    Exact from the contacts' starts and ends, to round-off; no sample is involved.

    Parameters
    ----------
    events
        One row a contact: ``corner`` (others than the slider's four are not looked at), ``start`` and ``end``
        in s. What lies outside the span is cut off.
    span
        First and last instant, s.

    Returns
    -------
    shares
        `SITUATIONS` -> share; their sum is 1.
    """
    spans = {
        corner: np.clip(events.loc[events["corner"] == corner, ["start", "end"]].to_numpy(float), *span)
        for corner in CORNERS
    }
    edges = np.unique(np.concatenate([span, *(contacts.ravel() for contacts in spans.values())]))
    closed = {corner: _closed(contacts, edges) for corner, contacts in spans.items()}
    left = closed["ll"].astype(int) + closed["ul"]
    right = closed["lr"].astype(int) + closed["ur"]
    holds = {
        "free": left + right == 0,
        "one_corner": left + right == 1,
        "one_side": (np.maximum(left, right) == 2) & (np.minimum(left, right) == 0),
        "opposite": np.minimum(left, right) > 0,
    }
    lengths = np.diff(edges) / (span[1] - span[0])
    return {situation: float(lengths[holds[situation]].sum()) for situation in SITUATIONS}


def of_scene(scene: SceneComparison) -> tuple[Shares | None, Shares | None]:
    """Return the shares in both results; None without events, without corners, or where a row is a side's."""
    of_corners = scene.scene is None or (
        scene.scene["joints"]["slider"] == "clearance" and scene.scene["contact"]["law"] != "foundation"
    )
    return _of_both(scene, time_shares) if of_corners else (None, None)


def pin_share(events: pd.DataFrame, span: tuple[float, float]) -> float:
    """Return the share of a span of time in which the journal at A touches its bearing; see `time_shares`."""
    contacts = np.clip(events.loc[events["corner"] == PIN, ["start", "end"]].to_numpy(float), *span)
    return float((contacts[:, 1] - contacts[:, 0]).sum()) / (span[1] - span[0])


def pin_of_scene(scene: SceneComparison) -> tuple[float | None, float | None]:
    """Return the pin's share in both results; None where there are no events, or no clearance at the pin."""
    has_clearance = scene.scene is not None and scene.scene["joints"]["crank_pin"] == "clearance"
    return _of_both(scene, pin_share) if has_clearance else (None, None)


def _of_both(
    scene: SceneComparison, share: Callable[[pd.DataFrame, tuple[float, float]], T]
) -> tuple[T | None, T | None]:
    if not scene.time.size:
        return None, None
    span = float(scene.time[0]), float(scene.time[-1])
    first, second = scene.events
    return (
        None if first is None else share(first, span),
        None if second is None else share(second, span),
    )


def _closed(contacts: Array, edges: Array) -> BoolArray:
    """Return whether a corner touches between each two edges.

    Parameters
    ----------
    contacts
        Start and end of each contact, all of them among the edges, shape (m, 2).
    edges
        Increasing, shape (n,).

    Returns
    -------
    closed
        Shape (n - 1,).
    """
    starts, ends = (np.searchsorted(edges, contacts[:, column]) for column in (0, 1))
    change = np.bincount(starts, minlength=edges.size) - np.bincount(ends, minlength=edges.size)
    return np.cumsum(change)[:-1] > 0
