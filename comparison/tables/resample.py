"""Interpolation of a table's channels at other times."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from comparison.tables.arrays import Array, BoolArray
from comparison.tables.channels import CONTACTS, Channel, channels


def resample(
    time: Array,
    columns: dict[str, Array],
    at: Array,
    events: pd.DataFrame | None,
    known: Mapping[str, Channel] | None = None,
) -> tuple[dict[str, Array], dict[str, BoolArray]]:
    """Interpolate channels.

    Positions whose velocity is among the channels use the cubic Hermite polynomial of both (error of order
    h^4), all other channels linear interpolation (h^2). Forces and accelerations jump at the start and end of
    a contact, and interpolation across a jump would produce values that occur on neither side. Each interval
    between two such instants is therefore interpolated separately, if it holds two samples, with linear
    extrapolation to its ends. An instant itself belongs to the following interval.

    Parameters
    ----------
    time, columns
        Times, s, strictly increasing, and the channels at these; shape (n,), n >= 2.
    at
        Times of the interpolation, s, inside the span of ``time``, shape (m,).
    events
        Contacts with ``corner``, ``start`` and ``end``; None: unknown.
    known
        Definitions of the channels; None: those of the press.

    Returns
    -------
    columns
        Shape (m,) each.
    unknown
        Channel -> where no samples determine it, because its interval has fewer than two: shape (m,). The
        values there, interpolated across the event, serve plotting only. Only channels with such instants.
    """
    known = channels() if known is None else known
    stretches: dict[str, tuple[NDArray[np.intp], BoolArray] | None] = {}
    sampled, unknown = {}, {}
    for name, values in columns.items():
        rate = known[name].rate if name in known else None
        place = _jumps_with(known[name]) if name in known else None
        if place is not None and place not in stretches:
            edges = _edges(events, place, time)
            stretches[place] = _stretches(time, at, edges) if edges.size else None
        cut = stretches.get(place or "")
        if rate is not None and rate in columns:
            sampled[name], _ = hermite(time, values, columns[rate], at)
        elif cut is None:
            sampled[name] = np.interp(at, time, values)
        else:
            first, outside = cut
            step = (values[first + 1] - values[first]) / (time[first + 1] - time[first])
            line = values[first] + step * (at - time[first])
            sampled[name] = np.where(at == time[-1], values[-1], line)
            if outside.any():
                unknown[name] = outside
    return sampled, unknown


def hermite(time: Array, values: Array, slopes: Array, at: Array) -> tuple[Array, Array]:
    """Evaluate the piecewise cubic with given nodal values and slopes, and its derivative.

    Equal to `scipy.interpolate.CubicHermiteSpline` (verified by a test), without its coefficients, which take
    four times the memory of the table, and without its import, which takes longer than most comparisons.

    Parameters
    ----------
    time, values, slopes
        Nodes, strictly increasing; shape (n,), n >= 2.
    at
        Inside the span of the nodes, shape (m,).

    Returns
    -------
    value, slope
        Shape (m,).
    """
    left = np.clip(np.searchsorted(time, at, side="right") - 1, 0, time.size - 2)
    width = time[left + 1] - time[left]
    s = (at - time[left]) / width
    # In the form v0 + s (...), so that the values at nodes are reproduced exactly; the last node is set
    # separately.
    rise = (values[left + 1] - values[left]) / width
    second = 3 * rise - 2 * slopes[left] - slopes[left + 1]
    third = slopes[left] + slopes[left + 1] - 2 * rise
    value = values[left] + width * s * (slopes[left] + s * (second + s * third))
    value = np.where(at == time[-1], values[-1], value)
    return value, slopes[left] + s * (2 * second + 3 * s * third)


def _jumps_with(channel: Channel) -> str | None:
    """Return the contact at whose events a channel jumps, "all" for any contact; None: it is continuous."""
    if channel.name.startswith("corner_"):
        _, corner, quantity = channel.name.split("_")
        return corner if quantity in {"normal", "friction"} else None
    return "all" if channel.group in {"accelerations", "joints"} else None


def _edges(events: pd.DataFrame | None, place: str, time: Array) -> Array:
    """Return the starts and ends of contacts inside the span, sorted, s."""
    if events is None:
        return np.empty(0)
    places = list(CONTACTS) if place == "all" else [place]
    edges = events.loc[events["corner"].isin(places), ["start", "end"]].to_numpy(np.float64).ravel()
    return np.unique(edges[(edges > time[0]) & (edges <= time[-1])])


def _stretches(time: Array, at: Array, edges: Array) -> tuple[NDArray[np.intp], BoolArray]:
    """Return the first of the two samples that determine each instant, and where there are none."""
    own, wanted = (np.searchsorted(edges, instants, side="right") for instants in (time, at))
    last = time.size - 2
    here = np.clip(np.searchsorted(time, at, side="right") - 1, 0, last)
    first = np.full(at.shape, -1, dtype=np.intp)
    for offset in (0, -1, 1):  # the samples around, else the two before, else the two after
        pair = np.clip(here + offset, 0, last)
        fits = (first < 0) & (own[pair] == wanted) & (own[pair + 1] == wanted)
        first[fits] = pair[fits]
    outside: BoolArray = (first < 0) & (time[here] != at) & (at != time[-1])
    # At a sample the value is known regardless of its neighbours.
    first = np.where((time[here] == at) | (first < 0), here, first)
    return first, outside
