"""Diagnosis: the causes of a difference that its shape shows, whatever its size.

The keys in which the scenes differ; a channel of b that is a multiple of a's, moved by a constant, or late,
named where undoing it leaves a tenth of the difference; and causes in the physics of the press.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from comparison.metrics.signals import Fit, fit, rms
from comparison.scene.keys import flat
from comparison.tables.align import Shift, estimate, hermite
from comparison.tables.table import Table
from comparison.verdict import physics
from comparison.verdict.results import Basis, Cause, ChannelComparison, decisive

Channels = Mapping[str, ChannelComparison]

_REST = 0.1  # of the difference, that an undone cause may leave
_RIVAL = 3.0  # times the remainder of the best fit, within which another one is as good
_SIGNIFICANT = 3.0  # times its uncertainty, above which a number is a finding
_FEW = 5  # samples; fewer tell nothing
_MOST = 4096  # samples of a fit, evenly chosen
_SMALL = 1e-4  # of the scale: without a tolerance a smaller difference needs no cause


def diagnose(
    results: Channels,
    tables: tuple[Table, Table],
    *,
    shift: Shift,
    period: float | None,
    outside_from: float,
    agree: bool,
) -> tuple[Cause, ...]:
    """Find the causes of the differences of two results, those that explain most first.

    ``tables`` are the base runs, ``shift`` that between them, ``outside_from`` the first instant (s) outside
    the threshold, nan if there is none. Where the two ``agree`` only keys of their scenes are named.
    """
    keys = differing_keys(*tables)
    causes = (Cause("keys", keys=keys),) if keys else ()
    if agree or not results:
        return causes
    related = _relations(results, shift)
    scaled = {name for cause in related if cause.kind == "ratio" for name in cause.channels}
    if not scaled & {*physics.of_corners(results, "normal")} and (rubbing := physics.friction(results)):
        theirs = {*physics.of_corners(results, "friction")}
        related = [cause for cause in related if not theirs >= {*cause.channels}] + rubbing
    related = related or physics.gravity(results, tables) or physics.impact(results, tables, period)
    return (*causes, *(related or physics.missing_contact(results, tables, period, outside_from)))


def differing_keys(a: Table, b: Table) -> tuple[tuple[str, Any, Any], ...]:
    """Return the keys in which the recorded scenes differ, with both values; None where one lacks the key.

    Keys of settings and output do not count; without a recorded scene there are none.
    """
    sides = []
    for table in (a, b):
        record = table.provenance.get("scene")
        if not isinstance(record, dict):
            return ()
        # `Table.scene` has the keys that an earlier version did not write.
        data = record if (scene := table.scene) is None else scene.data
        sides.append(flat({key: data[key] for key in data if key not in ("scene", "solver", "output")}))
    first, second = sides
    names = [key for key in {**first, **second} if first.get(key) != second.get(key)]
    return tuple((key, first.get(key), second.get(key)) for key in names)


# ---- multiples, constants and delays of channels


def _relations(results: Channels, shift: Shift) -> list[Cause]:
    """Name the simplest relation of each channel that differs; one that several share is named once."""
    causes: list[Cause] = []
    for name, channel in results.items():
        differs = channel.verdict == "differ"
        open_ = channel.threshold is None and channel.verdict != "unexcited" and channel.rms_scaled > _SMALL
        if not (differs or open_) or (cause := _relation(channel, results, shift)) is None:
            continue
        same = next((n for n, other in enumerate(causes) if _alike(other, cause, results)), None)
        if same is None:
            causes.append(cause)
        else:
            causes[same] = replace(causes[same], channels=(*causes[same].channels, name))
    worst = decisive(channel for channel in results.values() if channel.verdict == "differ")
    return sorted(causes, key=lambda cause: worst is None or worst.channel not in cause.channels)


def _alike(one: Cause, other: Cause, results: Channels) -> bool:
    units = {results[cause.channels[0]].unit for cause in (one, other)}
    close = abs(one.value - other.value) <= one.uncertainty + other.uncertainty
    unitless = one.kind in ("ratio", "shift") and not one.offset and not other.offset
    return one.kind == other.kind and close and (unitless or (len(units) == 1 and one.offset == other.offset))


def _relation(channel: ChannelComparison, results: Channels, shift: Shift) -> Cause | None:
    largest = channel.basis is Basis.LARGEST
    rows = np.flatnonzero(channel.nonzero if largest else channel.judged)
    rows = rows[np.linspace(0, rows.size - 1, min(rows.size, _MOST)).astype(np.intp)]
    # On a small part of a cycle any two smooth curves are nearly multiples of each other.
    if rows.size < _FEW or (channel.coverage < channel.limits.coverage and not largest):
        return None
    name, a, b = channel.channel, channel.a[rows], channel.b[rows]
    if np.ptp(b) == 0.0 < np.ptp(a) and channel.nonzero.all():
        return Cause("constant", (name,), float(b[0]), 0.0, rest=0.0)
    offset, ratio = fit(a, b, moved=True), fit(a, b, scaled=True)
    both = fit(a, b, scaled=True, moved=True)
    best = min(offset, ratio, key=lambda fit: fit.rest)
    if offset.rest <= _RIVAL * best.rest and not _special(ratio):
        best = offset  # of a channel that hardly varies a multiple looks like a constant
    elif ratio.rest <= _RIVAL * best.rest:
        best = ratio
    if both.rest < _REST * best.rest and abs(both.offset) > _SIGNIFICANT * both.offset_error:
        best = both
    delay = _delay(channel, results, shift)
    if delay is not None and delay.rest < best.rest:
        return delay
    cause = Cause("ratio", (name,), best.ratio, best.ratio_error, rest=best.rest, offset=best.offset)
    if best is offset:
        cause = Cause("offset", (name,), best.offset, best.offset_error, rest=best.rest)
    change = abs(cause.value - (0.0 if best is offset else 1.0))
    return cause if best.rest <= _REST and change > _SIGNIFICANT * cause.uncertainty else None


def _special(fit: Fit) -> bool:
    """Whether a ratio is one that units or a sign make, and nothing else is likely to."""
    return fit.ratio < 0 or not 0.1 < fit.ratio < 10.0


def _delay(channel: ChannelComparison, results: Channels, shift: Shift) -> Cause | None:
    """Name the time by which b is late, the same for all channels or this one's own."""
    if channel.definition.group not in ("motion", "own"):
        return None
    time, name, rate = channel.time, channel.channel, channel.definition.rate or ""
    known = {name: channel.definition}
    found = []
    for lag in (shift, estimate(time, {name: channel.a}, {name: channel.b}, known)):
        if not lag.significant:
            continue
        inside = channel.judged & (time + lag.value >= time[0]) & (time + lag.value <= time[-1])
        slopes = results[rate].b if rate in results else np.gradient(channel.b, time)
        earlier, _ = hermite(time, channel.b, slopes, time[inside] + lag.value)
        before = rms(time[inside], channel.difference[inside]) if inside.sum() > _FEW else 0.0
        if before and (rest := rms(time[inside], earlier - channel.a[inside]) / before) <= _REST:
            found.append(Cause("shift", (name,), lag.value, lag.uncertainty, rest=rest))
    return next(iter(found), None)
