"""Data of the interactive plots: curves of two or more models, their differences and thresholds, packed.

The numbers have the digits that a plot shows, are deflated, and written as Base64; ``plots.js`` reads them.
Of a channel the first model's values are stored in 65,534 steps of their range, the others by their
difference from it and the threshold with 5 bits of mantissa, i.e. to 1.6 %.
"""

import base64
import json
import math
import zlib
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from comparison.files import plain
from comparison.formatting import pretty_unit
from comparison.metrics.contacts import Pulse, noted
from comparison.report.curves import contact_of, guide_of, least_range
from comparison.report.svg import envelope, upper_envelope
from comparison.tables.channels import CONTACTS, CORNERS, Array, Channel, channels
from comparison.tables.table import Table
from comparison.verdict.results import ChannelComparison, SceneComparison
from comparison.words.verdicts import threshold_name

MOST = 6_000
"""Samples; of a longer run the envelopes are kept."""
MOTION = ("slider_x", "slider_y", "slider_angle")
"""Channels that the moving drawing needs."""
FORCES = tuple(f"corner_{corner}_normal" for corner in CORNERS)
_MANTISSA = 5  # bits of differences and thresholds
_PULSE = 25  # points of a resolved contact at most
_STEPS = 20  # of those in which values are stored, at least, are the range of an axis
_UNIFORM = 1e-9  # of the run time: such times are stored by their steps


class Curve(NamedTuple):
    """A channel of two or more models, what is subtracted from its values, and how it was judged."""

    channel: Channel
    zero: float
    models: Sequence[Array]
    judged: ChannelComparison | None = None


def independent(scene: SceneComparison) -> list[str]:
    """Return the excited channels, of corners only normal forces and what differs: the others follow."""
    return [
        name
        for name, channel in scene.excited.items()
        if not name.startswith("corner_") or name.endswith("_normal") or channel.verdict == "differ"
    ]


def shown(scene: SceneComparison) -> list[ChannelComparison]:
    """Return the channels to be drawn: those that are independent, and that which decides."""
    decisive, drawn = scene.decisive or scene.worst_channel, independent(scene)
    channels = [c for name, c in scene.excited.items() if name in drawn or c is decisive]
    return channels if scene.time.size > 1 else []


def scene_plots(scene: SceneComparison) -> str:
    """Return the plots of a scene at one tier as Base64; empty if there is nothing to draw."""
    decisive, drawn = scene.decisive or scene.worst_channel, shown(scene)
    head = {
        "labels": scene.labels,
        "tier": scene.tier,
        "period": scene.period,
        "threshold": threshold_name(decisive or drawn[0]) if drawn else "",
        "first": ["slider_x", *([decisive.channel] if decisive is not None else [])],
    }
    curves = [
        Curve(each.definition, guide_of(each.channel, scene.scene), (each.a, each.b), each) for each in drawn
    ]
    return _packed(head, scene.time, curves, scene.scene, scene.events, scene.pulses) if drawn else ""


def table_plots(
    tables: Mapping[str, Table], names: Sequence[str], scene: Mapping[str, Any] | None = None
) -> str:
    """Return plots of the channels that all tables of a scene have as Base64."""
    time = next(iter(tables.values())).time
    curves = [
        Curve(
            channels()[name],
            guide_of(name, scene),
            [np.interp(time, table.time, table.values(name)) for table in tables.values()],
        )
        for name in names
        if all(name in table.channels for table in tables.values())
    ]
    period = None if scene is None else 60.0 / abs(float(scene["drive"]["speed_rpm"]))
    head = {"labels": list(tables), "tier": "", "period": period, "threshold": "", "first": ["slider_x"]}
    events = [table.events for table in tables.values()]
    pulses = [noted(table) for table in tables.values()]
    return _packed(head, time, curves, scene, events, pulses)


def _packed(
    head: dict[str, Any],
    time: Array,
    curves: Sequence[Curve],
    scene: Mapping[str, Any] | None,
    events: Sequence[pd.DataFrame | None],
    pulses: Sequence[Sequence[Pulse]],
) -> str:
    kept = _kept(curves, time)
    interval = (time[-1] - time[0]) / (time.size - 1)
    even = np.abs(time - time[0] - interval * np.arange(time.size)).max() <= _UNIFORM * (time[-1] - time[0])
    arrays = [_integers(np.diff(kept, prepend=0)) if even else _planes(time[kept] - time[0], "<f8")]
    described = []
    for channel, zero, models, judged in curves:
        first, *others = (np.asarray(values)[kept] - zero for values in models)
        # Zero lies on the grid of values, so that what does not touch or move is exactly zero.
        low, high = float(first.min()), float(first.max())
        step = (high - low) / 65534.0 or abs(low) or 1.0
        lowest = math.floor(low / step)
        arrays.append(_integers(np.diff(np.rint(first / step) - lowest, n=2, prepend=[0.0, 0.0])))
        arrays += [_halves(first - other) for other in others]
        # The plotted |a - b| is not what a threshold within a time tolerance limits.
        limit = None if judged is None or judged.time_tolerance else judged.threshold
        if judged is not None and limit is not None:
            # The sign is free: negative where the sample is not predictable.
            arrays.append(_halves(np.where(judged.predictable, limit, -limit)[kept]))
        shifted = [np.asarray(values) - zero for values in models]
        extremes = min(float(v.min()) for v in shifted), max(float(v.max()) for v in shifted)
        # No plot shows the steps in which the values are stored, or the rounding of a constant.
        least = max(least_range(channel, scene, extremes), _STEPS * (high - low) / 65534.0)
        contact = contact_of(channel.name, scene)
        described.append(
            {
                "name": channel.name,
                "label": channel.label,
                "unit": pretty_unit(channel.unit),
                "verdict": "" if judged is None else judged.verdict,
                "guide": bool(zero),
                "contact": list(CONTACTS).index(contact) if contact else -1,
                "least": float(f"{least:.3g}"),
                "floor": channel.floor,
                "grid": [lowest, step],
                "threshold": limit is not None,
                "outside": [] if judged is None else np.flatnonzero(judged.beyond[kept])[:1].tolist(),
            }
        )
    if not any(contact_of(curve.channel.name, scene) for curve in curves):
        pulses = [()] * len(events)
    resolved = [_pulses(table, own) for table, own in zip(events, pulses, strict=True)]
    names = [curve.channel.name for curve in curves]
    head |= {
        "samples": int(kept.size),
        "of": int(time.size),
        "start": float(time[0]),
        "step": float(interval) if even else None,
        "contacts": [_contacts(table) for table in events],
        "first": [name for name in dict.fromkeys(head["first"]) if name in names] or names[:1],
        "pulses": [what for what, _ in resolved],
        "channels": described,
    }
    text = json.dumps(plain(head), separators=(",", ":")).encode()
    body = [len(text).to_bytes(4, "little"), text, *arrays, *(shares for _, shares in resolved)]
    return base64.b64encode(zlib.compress(b"".join(body), 9)).decode()


def _kept(curves: Sequence[Curve], time: Array) -> NDArray[np.intp]:
    """Return the indices of the samples to be drawn, increasing."""
    if time.size <= MOST:
        return np.arange(time.size)
    columns = MOST // (4 * len(curves))
    indices = [np.array([0, time.size - 1])]
    for curve in curves:
        first, *others = curve.models
        indices.append(envelope(first, columns))
        indices += [upper_envelope(np.abs(first - other), columns) for other in others]
        beyond = np.zeros(time.size) if curve.judged is None else curve.judged.beyond.astype(np.float64)
        indices.append(upper_envelope(beyond, columns))
    return np.unique(np.concatenate(indices))


def _contacts(events: pd.DataFrame | None) -> list[list[Any]]:
    """Return corner, start (s), duration (s) and peak force (N) of each contact, by start."""
    if events is None:
        return []
    places = list(CONTACTS)
    peaks = events["peak_force"] if "peak_force" in events else pd.Series(0.0, events.index)
    rows = zip(events["corner"], events["start"], events["end"], peaks, strict=True)
    return [
        [places.index(corner), round(start, 8), float(f"{end - start:.4g}"), float(f"{peak:.4g}")]
        for corner, start, end, peak in sorted(rows, key=lambda row: float(row[1]))
    ]


def _pulses(events: pd.DataFrame | None, pulses: Sequence[Pulse]) -> tuple[dict[str, Any], bytes]:
    """Return which of the sorted contacts are resolved, by how many points, and these in shares of 8 bits."""
    if events is None or not pulses:
        return {"of": [], "count": [], "last": [], "peak": []}, b""
    place = np.argsort(np.argsort(events["start"].to_numpy(), kind="stable"))
    ordered = sorted(pulses, key=lambda pulse: int(place[pulse.row]))
    drawn = []
    for pulse in ordered:  # evenly chosen points, the ends and the peak among them
        even = np.linspace(0, pulse.time.size - 1, min(pulse.time.size, _PULSE)).round().astype(np.intp)
        drawn.append(np.union1d(even, int(pulse.force.argmax())))
    described = {
        "of": [int(place[pulse.row]) for pulse in ordered],
        "count": [part.size for part in drawn],
        "last": [float(f"{pulse.time[-1]:.6g}") for pulse in ordered],
        "peak": [float(f"{pulse.force.max():.6g}") for pulse in ordered],
    }
    times = [pulse.time[part] / pulse.time[-1] for pulse, part in zip(ordered, drawn, strict=True)]
    forces = [pulse.force[part] / pulse.force.max() for pulse, part in zip(ordered, drawn, strict=True)]
    shares = np.clip(np.concatenate([*times, *forces]), 0.0, 1.0)
    return described, np.rint(255.0 * shares).astype(np.uint8).tobytes()


def _integers(values: Array | NDArray[np.intp]) -> bytes:
    """Return integers modulo 65,536."""
    return _planes(np.asarray(values).astype(np.int64) & 0xFFFF, "<u2")


def _halves(values: Array) -> bytes:
    """Return the upper halves of 32-bit numbers, rounded to `_MANTISSA` bits."""
    dropped = 23 - _MANTISSA
    bits = values.astype("<f4").view("<u4")
    return _planes((bits + (1 << (dropped - 1))) >> dropped << (dropped - 16), "<u2")


def _planes(values: Array | NDArray[Any], kind: str) -> bytes:
    """Return numbers byte by byte of all samples: neighbours are alike and deflate well."""
    number = np.dtype(kind)
    return values.astype(number).view(np.uint8).reshape(-1, number.itemsize).T.tobytes()
