"""Causes of a difference that its shape shows, and the share of it that refining either model leaves.

Causes, whatever their size: the keys in which the scenes differ; a channel of b that is a multiple of a's,
off by a constant or whole turns, or late, if undoing this leaves a tenth of the difference at most; and
causes in the physics of the press (`comparison.verdict.press`).

Attribution: with the difference E = a - b the remainders are E_a = a_finer - b and E_b = a - b_finer: if b's
step causes the difference, refining b divides E by factor^order and refining a leaves it unchanged; if the
equations differ, neither has an effect. Magnitudes are root mean squares over the channel's scale, of the
decisive samples: those outside their band where the models differ, else all judged samples, in the channels
whose verdict is the scene's.
"""

from dataclasses import replace
from math import inf, nan, pi, sqrt
from typing import Any

import numpy as np

from comparison.accuracy.levels import finer
from comparison.accuracy.uncertainty import Runs, observed_order
from comparison.metrics import Fit, fit, rms
from comparison.scene import Scene
from comparison.scene.keys import differences
from comparison.tables.align import Shift, estimate, hermite
from comparison.tables.table import Table
from comparison.tables.units import parse_unit, same_dimension
from comparison.verdict.press import (
    FEW,
    RIVAL,
    SIGNIFICANT,
    Channels,
    Tables,
    friction,
    gravity,
    impact,
    missing_contact,
    of_corners,
)
from comparison.verdict.results import Attribution, Basis, Cause, ChannelComparison, Refinement, decisive

_REST = 0.1  # share of the difference that an undone cause may leave
_MOST = 4096  # samples of a fit, evenly chosen
_SMALL = 1e-4  # of the scale: without a tolerance a smaller difference needs no cause


def diagnose(
    results: Channels,
    tables: Tables,
    *,
    shift: Shift,
    period: float | None,
    outside_from: float,
    agree: bool,
) -> tuple[Cause, ...]:
    """Find the causes of the differences of two results, those that explain most first.

    ``tables`` are the base runs, ``shift`` is that between them, ``outside_from`` the first instant (s)
    outside the threshold, nan if there is none. Where the two ``agree``, causes are keys of the scenes only.
    """
    keys = differing_keys(*tables)
    causes = (Cause("keys", keys=keys),) if keys else ()
    if agree or not results:
        return causes
    relations = _relations(results, shift)
    multiples = {name for cause in relations if cause.kind == "ratio" for name in cause.channels}
    if not multiples & {*of_corners(results, "normal")} and (frictions := friction(results)):
        names = {*of_corners(results, "friction")}
        relations = [cause for cause in relations if not names >= {*cause.channels}] + frictions
    relations = relations or gravity(results, tables) or impact(results, tables, period)
    return (*causes, *(relations or missing_contact(results, tables, period, outside_from)))


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
        sides.append({key: data[key] for key in data if key not in ("scene", "solver", "output")})
    return differences(*sides)


# ---- multiples, constants and delays of channels


def _relations(results: Channels, shift: Shift) -> list[Cause]:
    """Return the simplest relation of each channel that differs; one that several share comes once."""
    causes: list[Cause] = []
    for name, channel in results.items():
        differs = channel.verdict == "differ"
        open_ = channel.threshold is None and channel.verdict != "unexcited" and channel.rms_scaled > _SMALL
        if not (differs or open_) or (cause := _relation(channel, results, shift)) is None:
            continue
        row = next((n for n, other in enumerate(causes) if _alike(other, cause, results)), None)
        if row is None:
            causes.append(cause)
        else:
            causes[row] = replace(causes[row], channels=(*causes[row].channels, name))
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
    if rows.size < FEW or (channel.coverage < channel.limits.coverage and not largest):
        return None
    name, a, b = channel.channel, channel.a[rows], channel.b[rows]
    if np.ptp(b) == 0.0 < np.ptp(a) and channel.nonzero.all():
        return Cause("constant", (name,), float(b[0]), 0.0, rest=0.0)
    unit = parse_unit(channel.unit)
    turn = 2 * pi / float(unit.factor) if unit and same_dimension(unit, parse_unit("rad")) else inf
    turns = np.round((b - a) / turn)
    if turns.any() and np.abs(remainder := b - a - turns * turn).max() <= _REST * turn:
        rest = rms(channel.time[rows], remainder) / rms(channel.time[rows], b - a)
        return Cause("turns", (name,), turn, 0.0, rest=rest)
    offset, ratio = fit(a, b, moved=True), fit(a, b, scaled=True)
    both = fit(a, b, scaled=True, moved=True)
    best = min(offset, ratio, key=lambda fit: fit.rest)
    if offset.rest <= RIVAL * best.rest and not _special(ratio):
        best = offset  # of a channel that hardly varies a multiple looks like a constant
    elif ratio.rest <= RIVAL * best.rest:
        best = ratio
    if both.rest < _REST * best.rest and abs(both.offset) > SIGNIFICANT * both.offset_error:
        best = both
    delay = _delay(channel, results, shift)
    if delay is not None and delay.rest < best.rest:
        return delay
    cause = Cause("ratio", (name,), best.ratio, best.ratio_error, rest=best.rest, offset=best.offset)
    if best is offset:
        cause = Cause("offset", (name,), best.offset, best.offset_error, rest=best.rest)
    change = abs(cause.value - (0.0 if best is offset else 1.0))
    return cause if best.rest <= _REST and change > SIGNIFICANT * cause.uncertainty else None


def _special(fit: Fit) -> bool:
    """Return True for a ratio that hardly anything but units or a sign makes."""
    return fit.ratio < 0 or not 0.1 < fit.ratio < 10.0


def _delay(channel: ChannelComparison, results: Channels, shift: Shift) -> Cause | None:
    """Return the time by which b is late, the one of all channels or that of this channel."""
    if channel.definition.group not in ("motion", "own"):
        return None
    time, name, rate = channel.time, channel.channel, channel.definition.rate or ""
    definitions = {name: channel.definition}
    shifts = []
    for lag in (shift, estimate(time, {name: channel.a}, {name: channel.b}, definitions)):
        if not lag.significant:
            continue
        inside = channel.judged & (time + lag.value >= time[0]) & (time + lag.value <= time[-1])
        slopes = results[rate].b if rate in results else np.gradient(channel.b, time)
        values, _ = hermite(time, channel.b, slopes, time[inside] + lag.value)
        size = rms(time[inside], channel.difference[inside]) if inside.sum() > FEW else 0.0
        if size and (rest := rms(time[inside], values - channel.a[inside]) / size) <= _REST:
            shifts.append(Cause("shift", (name,), lag.value, lag.uncertainty, rest=rest))
    return next(iter(shifts), None)


# ---- attribution to the settings of either model


def attribute(
    runs: tuple[Runs, Runs],
    results: Channels,
    *,
    verdict: str,
    labels: tuple[str, str],
    scene: Scene | None,
) -> Attribution:
    """Attribute the differences of a scene's judged channels.

    For tables without uncertainty it has only the first sample outside the tolerance.
    """
    excited = {name: channel for name, channel in results.items() if channel.verdict != "unexcited"}
    # A scene may differ by a time shift alone, which no channel shows: then all channels count.
    deciding = {name: channel for name, channel in excited.items() if channel.verdict == verdict} or excited
    attribution = _first_outside(deciding if verdict == "differ" else excited)
    if scene is None or not excited or any(channel.u is None for channel in excited.values()):
        return attribution
    first, second = (
        _refinement(label, model, scene, excited) for label, model in zip(labels, runs, strict=True)
    )
    return replace(
        attribution,
        explained=_explained_share(excited),
        remaining=_remaining_shares(runs, deciding),
        refinements=(first, second),
        unpredictable=_unpredictable_shares(results),
    )


def _first_outside(channels: Channels) -> Attribution:
    """Find the first sample outside, and of several channels there the one farthest outside."""
    starts = []
    for name, channel in channels.items():
        if channel.threshold is not None and channel.beyond.any():
            first = int(channel.beyond.argmax())
            size, limit = float(channel.size[first]), float(channel.threshold[first])
            starts.append((float(channel.time[first]), -size / limit if limit else -inf, name))
    if not starts:
        return Attribution()
    time, _, name = min(starts)
    return Attribution(outside_from=time, outside_in=name)


def _explained_share(channels: Channels) -> float:
    total = sum(int(channel.judged.sum()) for channel in channels.values())
    return 1.0 - sum(int(c.beyond.sum()) for c in channels.values()) / total if total else nan


def _remaining_shares(runs: tuple[Runs, Runs], deciding: Channels) -> dict[str, float]:
    """Return the share of the difference that remains with the run of "a", "b" or "both" refined."""
    differs = _explained_share(deciding) < next(iter(deciding.values())).limits.share
    squares = dict.fromkeys(("base", "a", "b", "both"), 0.0)
    for name, channel in deciding.items():
        mask = channel.beyond if differs else channel.judged
        a, b = channel.a[mask], channel.b[mask]
        fine_a, fine_b = (model.finer.values(name)[mask] for model in runs if model.finer is not None)
        for key, delta in {"base": a - b, "a": fine_a - b, "b": a - fine_b, "both": fine_a - fine_b}.items():
            squares[key] += float(np.sum((delta / channel.scale) ** 2))
    base = squares.pop("base")
    return {key: sqrt(square / base) if base > 0 else nan for key, square in squares.items()}


def _unpredictable_shares(results: Channels) -> dict[str, float]:
    """Return the shares of the unpredictable samples of indeterminate channels, by the u that causes them."""
    count = dict.fromkeys(("a", "b", "each", "together"), 0)
    for channel in results.values():
        if channel.verdict != "indeterminate":
            continue
        # The position that it follows must be predictable too.
        parts = [channel, *filter(None, [results.get(channel.definition.follows or "")])]
        of_a, of_b = (
            np.any([~part.limits.predictable(u, part.scale) for part, u in pairs if u is not None], axis=0)
            for pairs in ([(part, part.u_a) for part in parts], [(part, part.u_b) for part in parts])
        )
        cases = of_a & ~of_b, of_b & ~of_a, of_a & of_b, ~(of_a | of_b)
        for key, case in zip(count, cases, strict=True):
            count[key] += int((~channel.predictable & case).sum())
    total = sum(count.values())
    return {key: number / total for key, number in count.items()} if total else {}


def _refinement(label: str, model: Runs, scene: Scene, excited: Channels) -> Refinement:
    """Return the setting that a level refines, and those that change with it."""
    factor, order = model.refinement
    finer_scene, settings = finer(label, scene), {}
    if finer_scene is not None:
        old, new = (each.data["solver"][label] for each in (scene, finer_scene))
        keys = [key for key in old if old[key] != new[key]]
        chief = min(keys, key=lambda key: abs(old[key] / new[key] - factor))
        settings = {chief: old[chief]} | {key: old[key] for key in keys}
    samples = {name: (channel.predictable, channel.scale) for name, channel in excited.items()}
    return Refinement(label, settings, factor, order, observed_order(model, samples))
