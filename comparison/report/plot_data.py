"""Data of the interactive plots: both models, their difference and its threshold, packed for the page.

A channel is stored by sample as the first model's value less an offset (32 bits), the difference and the
threshold (the upper 16 bits of 32, i.e. to 0.4 %): the second model's value is their difference, exact where
both lie together. The numbers are deflated, and written as Base64.
"""

from __future__ import annotations

import base64
import json
import zlib
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from comparison.files import plain
from comparison.formatting import pretty_unit
from comparison.report.decimate import envelope, upper_envelope
from comparison.report.gallery import is_derived
from comparison.tables.arrays import Array
from comparison.tables.channels import CONTACTS
from comparison.verdict.results import ChannelComparison, SceneComparison
from comparison.words.verdicts import threshold_name

if TYPE_CHECKING:
    from comparison.metrics.contacts import Pulse

MOST = 12_000
"""Samples of a tier; of a longer run the envelopes are kept."""
_UNIFORM = 1e-9  # of the run time: such times are stored by their ends


def plot_data(scene: SceneComparison) -> str:
    """Return the plots of a scene at one tier as Base64; empty if there is nothing to draw.

    Unexcited channels are omitted, and those that follow from others (`comparison.report.gallery`), unless
    one of these decides the verdict. The pulses are the resolved contacts of either model: times and forces
    are stored as shares of the last and of the largest one (16 bits each).
    """
    deciding = scene.decisive
    shown = [
        channel
        for channel in scene.channels.values()
        if channel.verdict != "unexcited" and (channel is deciding or not is_derived(channel))
    ]
    if not shown or scene.time.size < 2:
        return ""
    kept = _kept(shown, scene.time)
    time, arrays = scene.time[kept], []
    head: dict[str, Any] = {
        "labels": list(scene.labels),
        "tier": scene.tier,
        "period": scene.period,
        "samples": int(kept.size),
        "of": int(scene.time.size),
        "time": [float(time[0]), float(time[-1])],
        "contacts": [_contacts(events) for events in scene.events],
        "first": _shown_first(scene, shown),
    }
    even = np.linspace(time[0], time[-1], time.size)
    if np.abs(time - even).max() > _UNIFORM * (time[-1] - time[0]):
        head["uneven"] = True
        arrays.append(_planes(time - time[0], np.float64))
    channels = []
    for channel in shown:
        described, packed = _channel(scene, channel, kept)
        channels.append(described)
        arrays += packed
    head["pulses"] = []
    for events, resolved in zip(scene.events, scene.pulses, strict=True):
        described, packed = _pulses(events, resolved)
        head["pulses"].append(described)
        arrays += packed
    text = json.dumps(plain(head | {"channels": channels}), separators=(",", ":"), ensure_ascii=True)
    body = len(text).to_bytes(4, "little") + text.encode() + b"".join(arrays)
    return base64.b64encode(zlib.compress(body, 9)).decode()


def _channel(
    scene: SceneComparison, channel: ChannelComparison, kept: NDArray[np.intp]
) -> tuple[dict[str, Any], list[bytes]]:
    threshold, name = channel.threshold, threshold_name(channel)
    guide = channel.channel == "slider_x" and scene.scene is not None
    offset = (
        float(scene.scene["mechanism"]["guide_x"])
        if guide and scene.scene is not None
        else float(channel.a[0])
    )
    limit = np.zeros(kept.size) if threshold is None else np.asarray(threshold)[kept].copy()
    # The sign is free: negative where the sample is not predictable.
    limit[~channel.predictable[kept]] *= -1.0
    described = {
        "name": channel.channel,
        "label": channel.label,
        "unit": pretty_unit(channel.unit),
        "verdict": channel.verdict,
        "offset": offset,
        # A clearance of 0.2 mm is invisible on an axis of half a metre.
        "zero": offset if guide else 0.0,
        "threshold": name if threshold is not None else "",
        "limit": channel.predictable_below,
        "outside": np.flatnonzero(channel.beyond[kept])[:1].tolist(),
    }
    arrays = [
        _planes(channel.a[kept] - offset, np.float32),
        _halves(channel.difference[kept]),
        _halves(limit),
    ]
    return described, arrays


def _kept(shown: list[ChannelComparison], time: Array) -> NDArray[np.intp]:
    """Return the indices of the samples to be drawn, increasing."""
    if time.size <= MOST:
        return np.arange(time.size)
    columns = MOST // (4 * len(shown))
    indices = [np.array([0, time.size - 1])]
    for channel in shown:
        indices += [envelope(channel.a, columns), upper_envelope(np.abs(channel.difference), columns)]
        indices.append(upper_envelope(channel.beyond.astype(np.float64), columns))
    return np.unique(np.concatenate(indices))


def _contacts(events: pd.DataFrame | None) -> list[list[Any]]:
    """Return corner, start (s), duration (s) and peak force (N) of each contact, by start."""
    if events is None:
        return []
    order = list(CONTACTS)
    return [
        [order.index(corner), round(start, 8), round(end - start, 8), float(f"{peak:.4g}")]
        for corner, start, end, peak in events.sort_values("start", kind="stable")[
            ["corner", "start", "end", "peak_force"]
        ].itertuples(index=False)
    ]


def _pulses(events: pd.DataFrame | None, pulses: Sequence[Pulse]) -> tuple[dict[str, Any], list[bytes]]:
    """Return which of the sorted contacts (`_contacts`) are resolved, by how many points, and these."""
    if events is None or not pulses:
        return {"of": [], "count": [], "last": [], "peak": []}, []
    place = np.argsort(np.argsort(events["start"].to_numpy(), kind="stable"))
    ordered = sorted(pulses, key=lambda pulse: int(place[pulse.row]))
    last = [float(pulse.time[-1]) for pulse in ordered]
    peak = [float(pulse.force.max()) for pulse in ordered]
    described = {
        "of": [int(place[pulse.row]) for pulse in ordered],
        "count": [pulse.time.size for pulse in ordered],
        "last": [float(f"{value:.6g}") for value in last],
        "peak": [float(f"{value:.6g}") for value in peak],
    }
    times = [pulse.time / end for pulse, end in zip(ordered, last, strict=True)]
    forces = [pulse.force / most for pulse, most in zip(ordered, peak, strict=True)]
    return described, [_shares(np.concatenate(times)), _shares(np.concatenate(forces))]


def _shown_first(scene: SceneComparison, shown: list[ChannelComparison]) -> list[str]:
    """Return the channels that are drawn before any is picked: the deciding one and slider_x."""
    names = [channel.channel for channel in shown]
    worst = scene.decisive
    wanted = ["slider_x", *([worst.channel] if worst is not None else [])]
    return [name for name in dict.fromkeys(wanted) if name in names] or names[:1]


def _planes(values: Array, kind: type[np.floating[Any]]) -> bytes:
    """Return little-endian numbers, byte by byte of all samples: neighbours are alike and deflate well."""
    number = np.dtype(kind).newbyteorder("<")
    return values.astype(number).view(np.uint8).reshape(-1, number.itemsize).T.tobytes()


def _shares(values: Array) -> bytes:
    """Return shares from 0 to 1 in 16 bits, the low bytes first."""
    return (
        np.rint(65535.0 * np.clip(values, 0.0, 1.0)).astype("<u2").view(np.uint8).reshape(-1, 2).T.tobytes()
    )


def _halves(values: Array) -> bytes:
    """Return the upper halves of 32-bit numbers, rounded."""
    bits = values.astype("<f4").view("<u4")
    return ((bits + 0x8000) >> 16).astype("<u2").view(np.uint8).reshape(-1, 2).T.tobytes()
