"""Causes of a difference that its shape shows, and the share of it that refining either model leaves.

Causes, whatever their size: the keys in which the scenes differ; a channel of b that is a multiple of a's,
moved by a constant, or late, named where undoing it leaves a tenth of the difference; and causes in the
physics of the press.

Attribution: with the difference E = a - b the remainders are E_a = a_finer - b and E_b = a - b_finer: if b's
step causes the difference, refining b divides E by factor^order and refining a leaves it unchanged; if the
equations differ, neither has an effect. Magnitudes are root mean squares over the channel's scale, of the
decisive samples: those outside their band where the models differ, else all judged samples, in the channels
whose verdict is the scene's.
"""

from collections.abc import Mapping
from dataclasses import replace
from math import inf, isnan, log, nan, sqrt
from typing import Any, Literal

import numpy as np
import pandas as pd

from comparison.accuracy.levels import finer
from comparison.accuracy.uncertainty import Runs, observed_order
from comparison.metrics import WINDOW, Fit, fit, match, rms, starts_at
from comparison.scene import Scene
from comparison.scene.keys import flat
from comparison.tables.align import Shift, estimate, hermite
from comparison.tables.channels import CONTACTS, CORNERS, Array
from comparison.tables.table import Table
from comparison.verdict.results import Attribution, Basis, Cause, ChannelComparison, Refinement, decisive

Channels = Mapping[str, ChannelComparison]
Tables = tuple[Table, Table]

_REST = 0.1  # of the difference, that an undone cause may leave
_RIVAL = 3.0  # times the remainder of the best fit, within which another one is as good
_SIGNIFICANT = 3.0  # times its uncertainty, above which a number is a finding
_FEW = 5  # samples; fewer tell nothing
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

    ``tables`` are the base runs, ``shift`` that between them, ``outside_from`` the first instant (s) outside
    the threshold, nan if there is none. Where the two ``agree`` only keys of their scenes are named.
    """
    keys = differing_keys(*tables)
    causes = (Cause("keys", keys=keys),) if keys else ()
    if agree or not results:
        return causes
    related = _relations(results, shift)
    scaled = {name for cause in related if cause.kind == "ratio" for name in cause.channels}
    if not scaled & {*of_corners(results, "normal")} and (rubbing := friction(results)):
        theirs = {*of_corners(results, "friction")}
        related = [cause for cause in related if not theirs >= {*cause.channels}] + rubbing
    related = related or gravity(results, tables) or impact(results, tables, period)
    return (*causes, *(related or missing_contact(results, tables, period, outside_from)))


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


# ---- causes in the physics of the press
#
# They show before the motions of two models part, or in each model by itself; afterwards everything differs,
# whatever the cause.

_LEAST = 1e-4  # change of a coefficient, an impact, or ax over ay: errors of usual settings stay below
_SLIDES = 0.1  # of the largest speed, above which friction does not depend on it
_PRESSES = 0.01  # of the largest force, above which noise is not taken for a contact
_FLIGHT = 10  # samples before the first contact, at least
_STEADY = 0.01  # of what is constant in these, that may vary: a mass or a length leaves twice as much
_PURE = 0.15  # of an impact's change, by which it may miss the pattern of its cause
_NEAR = 0.02  # of a crank cycle, within which a contact of the other run is the same one


def friction(results: Channels) -> list[Cause]:
    """Name the coefficient of friction: friction over normal force of sliding corners, in each run alone."""
    speed = results.get("slider_vy")
    pairs = [(f"corner_{corner}_normal", f"corner_{corner}_friction") for corner in CORNERS]
    corners = [pair for pair in pairs if results.keys() >= {*pair}]
    if speed is None or not corners:
        return []
    slides = np.abs(speed.a) > _SLIDES * np.abs(speed.a).max()
    sides: list[tuple[float, float]] = []
    for side in ("a", "b"):
        shares = []
        for names in corners:
            normal, rubbing = (getattr(results[name], side) for name in names)
            touches = slides & (normal > _PRESSES * normal.max())
            shares.append(np.abs(rubbing[touches]) / normal[touches])
        values = np.concatenate(shares)
        middle = float(np.median(values)) if values.size >= _FEW else 0.0
        if not middle:
            return []
        # Of a normal distribution two standard errors of the median are 3.7 median deviations over root n.
        sides.append((middle, 3.7 * float(np.median(np.abs(values - middle))) / np.sqrt(values.size)))
    (first, error), (second, its_error) = sides
    ratio = second / first
    uncertainty = ratio * float(np.hypot(error / first, its_error / second))
    if abs(log(ratio)) <= max(_SIGNIFICANT * uncertainty / ratio, _LEAST):
        return []
    return [Cause("friction", of_corners(results, "friction"), ratio, uncertainty, values=(first, second))]


def of_corners(results: Channels, part: str) -> tuple[str, ...]:
    """Return the names of a force ("normal" or "friction") of the corners that there are."""
    return tuple(name for corner in CORNERS if (name := f"corner_{corner}_{part}") in results)


def gravity(results: Channels, tables: Tables) -> list[Cause]:
    """Name gravity: before the first contact the slider's ax differs by what does not follow its ay.

    In flight the guide leaves x free, and rod 4 at the angle beta gives ax = (ay + g) tan(beta). A mass, a
    length or the drive changes the part with ay, which varies; another start shows in x at once.
    """
    x, ax, ay = (results.get(f"slider_{name}") for name in ("x", "ax", "ay"))
    starts = [
        table.events["start"].min() for table in tables if table.events is not None and len(table.events)
    ]
    if x is None or ax is None or ay is None or len(starts) < 2:
        return []
    flight = ax.time < min(starts)
    if flight.sum() < _FLIGHT or not ay.a[flight].any():
        return []
    difference, follows, moved = -ax.difference[flight], ay.a[flight], np.abs(x.difference[flight])
    if np.abs(difference).max() <= _LEAST * np.abs(follows).max() or moved[0] > _STEADY * moved.max():
        return []
    steady = fit(np.zeros(difference.size), difference, moved=True)
    along = follows * (difference @ follows) / (follows @ follows)
    rest = float(np.sqrt(np.mean((difference - along) ** 2) / np.mean(difference**2)))
    if steady.rest > min(_STEADY, rest / _RIVAL):
        return []
    return [Cause("gravity", ("slider_ax",), steady.offset, steady.offset_error, rest=steady.rest)]


def impact(results: Channels, tables: Tables, period: float | None) -> list[Cause]:
    """Name stiffness or restitution by the first impact, which both enter at one speed.

    A stiffer contact (force K depth^n) divides depth and duration by what it multiplies the peak force by,
    and leaves the impulse. Less is lost where the impulse is larger and the contact no longer.
    """
    a, b = (table.events for table in tables)
    if a is None or b is None or period is None or not len(a) or not len(b):
        return []
    window = WINDOW * period
    first = min(a["start"].min(), b["start"].min())
    pairs = [
        (a.iloc[row], b.iloc[its])
        for row, its in match(a, b, window)
        if a["start"].iloc[row] <= first + window
    ]
    names = ("normal_speed", "impulse", "peak_force", "largest_depth")
    logs = []
    for one, other in pairs:
        sides = [[*map(float, each[[*names]]), float(each["end"] - each["start"])] for each in (one, other)]
        if min(map(min, sides)) <= 0.0:
            return []
        logs.append([log(its / own) for own, its in zip(*sides, strict=True)])
    if not logs:
        return []
    speed, impulse, peak, depth, duration = np.array(logs).T
    place, time = str(pairs[0][0]["corner"]), float(first)

    def within(values: Array, size: Array) -> bool:
        return bool((np.abs(values) <= _PURE * np.abs(size)).all())

    def cause(kind: Literal["stiffness", "restitution"], values: Array, error: float) -> list[Cause]:
        ratio = float(np.exp(values.mean()))
        error = ratio * (error + float(np.ptp(values)) / 2)
        return [Cause(kind, of_corners(results, "normal"), ratio, error, time=time, place=place)]

    if min(np.abs(peak)) > _LEAST and all(
        within(v, peak) for v in (speed, impulse, peak + depth, peak + duration)
    ):
        exponent = _exponent(tables[0])
        powers = (peak - depth) / 2 * (exponent + 1)
        return cause("stiffness", powers, float(np.abs(peak + depth).max()) / 2 * (exponent + 1))
    sign = np.sign(impulse[0])
    together = all((np.sign(values) == sign).all() for values in (impulse, peak, depth, -duration))
    if min(np.abs(impulse)) > _LEAST and within(speed, impulse) and together:
        return cause("restitution", impulse, float(np.abs(speed).max()))
    return []


def _exponent(table: Table) -> float:
    scene = table.scene
    return 1.5 if scene is None or scene.is_linkage else float(scene.data["contact"]["exponent"])


def missing_contact(
    results: Channels, tables: Tables, period: float | None, outside_from: float
) -> list[Cause]:
    """Name the contact that only one run has, where the difference begins with it."""
    if isnan(outside_from):
        return []
    time = next(iter(results.values())).time
    step = float(np.median(np.diff(time)))
    near = max(2 * step, _NEAR * (period or 0.0))
    for corner in CONTACTS:
        force = results.get(f"corner_{corner}_normal")
        values = (None, None) if force is None else (force.a, force.b)
        spans = [_spans(table.events, corner, time, own) for table, own in zip(tables, values, strict=True)]
        for side, other in ((0, 1), (1, 0)):
            for start, end in spans[side]:
                if not start <= outside_from <= end + 2 * step:
                    continue
                partner = [its for its in spans[other] if abs(its[0] - start) <= near]
                if partner and not _silent(force, side, partner[0]):
                    continue
                return [Cause("contact", side="ab"[other], time=start, place=corner)]
    return []


def _spans(
    events: pd.DataFrame | None, corner: str, time: Array, force: Array | None
) -> list[tuple[float, float]]:
    """Return starts and ends of a corner's contacts, of events or else of samples with a force."""
    if events is not None:
        rows, starts = starts_at(events, corner)
        return list(zip(starts.tolist(), events["end"].to_numpy(np.float64)[rows].tolist(), strict=True))
    if force is None:
        return []
    edges = np.flatnonzero(np.diff(np.concatenate([[False], force > 0.0, [False]]).astype(np.int8)))
    return [(float(time[n]), float(time[m - 1])) for n, m in edges.reshape(-1, 2)]


def _silent(force: ChannelComparison | None, side: int, span: tuple[float, float]) -> bool:
    """Whether the samples show no force in a contact of their own run, where those of the other run do."""
    if force is None:
        return False
    own, other = (force.a, force.b) if side == 0 else (force.b, force.a)
    inside = (force.time > span[0]) & (force.time < span[1]) & (own > 0.0)
    return bool(inside.any() and not other[inside].any())


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

    Of tables without uncertainty only the first sample outside the tolerance is found.
    """
    excited = {name: channel for name, channel in results.items() if channel.verdict != "unexcited"}
    # A scene may differ by a time shift alone, which no channel shows: then all channels count.
    deciding = {name: channel for name, channel in excited.items() if channel.verdict == verdict} or excited
    outside = _first(deciding if verdict == "differ" else excited)
    if scene is None or not excited or any(channel.u is None for channel in excited.values()):
        return outside
    first, second = (
        _refinement(label, model, scene, excited) for label, model in zip(labels, runs, strict=True)
    )
    return replace(
        outside,
        explained=_explained(excited),
        remaining=_remaining(runs, deciding),
        refinements=(first, second),
        unpredictable=_unpredictable(results),
    )


def _first(channels: Channels) -> Attribution:
    """Find the first sample outside; of several channels the one that is the farthest outside there."""
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


def _explained(channels: Channels) -> float:
    total = sum(int(channel.judged.sum()) for channel in channels.values())
    return 1.0 - sum(int(c.beyond.sum()) for c in channels.values()) / total if total else nan


def _remaining(runs: tuple[Runs, Runs], deciding: Channels) -> dict[str, float]:
    """Return the share of the difference that is left with the run of "a", "b" or "both" refined."""
    differs = _explained(deciding) < next(iter(deciding.values())).limits.share
    squares = dict.fromkeys(("base", "a", "b", "both"), 0.0)
    for name, channel in deciding.items():
        mask = channel.beyond if differs else channel.judged
        a, b = channel.a[mask], channel.b[mask]
        fine_a, fine_b = (model.finer.values(name)[mask] for model in runs if model.finer is not None)
        for key, apart in {"base": a - b, "a": fine_a - b, "b": a - fine_b, "both": fine_a - fine_b}.items():
            squares[key] += float(np.sum((apart / channel.scale) ** 2))
    base = squares.pop("base")
    return {key: sqrt(square / base) if base > 0 else nan for key, square in squares.items()}


def _unpredictable(results: Channels) -> dict[str, float]:
    """Return by whose uncertainty samples of the indeterminate channels are not predictable."""
    count = dict.fromkeys(("a", "b", "each", "together"), 0)
    for channel in results.values():
        if channel.verdict != "indeterminate":
            continue
        # The position that it follows must be predictable too.
        parts = [channel, *filter(None, [results.get(channel.definition.follows or "")])]
        of_a, of_b = (
            np.any([~part.limits.predictable(u, part.scale) for part, u in own if u is not None], axis=0)
            for own in ([(part, part.u_a) for part in parts], [(part, part.u_b) for part in parts])
        )
        cases = of_a & ~of_b, of_b & ~of_a, of_a & of_b, ~(of_a | of_b)
        for key, case in zip(count, cases, strict=True):
            count[key] += int((~channel.predictable & case).sum())
    total = sum(count.values())
    return {key: number / total for key, number in count.items()} if total else {}


def _refinement(label: str, model: Runs, scene: Scene, excited: Channels) -> Refinement:
    """Describe the setting that a level changes, and those changed along with it."""
    factor, order = model.refinement
    refined, settings = finer(label, scene), {}
    if refined is not None:
        old, new = (which.data["solver"][label] for which in (scene, refined))
        changed = [key for key in old if old[key] != new[key]]
        chief = min(changed, key=lambda key: abs(old[key] / new[key] - factor))
        settings = {chief: old[chief]} | {key: old[key] for key in changed}
    judged = {name: (channel.predictable, channel.scale) for name, channel in excited.items()}
    return Refinement(label, settings, factor, order, observed_order(model, judged))
