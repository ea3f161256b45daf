"""Attribution of a difference to a setting of one model, the numerics of both, or the models themselves.

Each side is refined separately. With the difference E = a - b, the remainders are E_a = a_finer - b and E_b =
a - b_finer: if b's step causes the difference, refining b divides E by factor^order and refining a leaves it
unchanged; if the equations differ, neither has an effect. Magnitudes are root mean squares over the channel's
scale, of the decisive samples: those outside their band where the models differ, else all judged samples, in
the channels whose verdict is the scene's.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from math import hypot, inf, nan, sqrt
from typing import Any

import numpy as np
from scipy.ndimage import maximum_filter1d

from comparison.accuracy.uncertainty import Runs, round_off, spread, window_samples
from comparison.agreement.attribution_text import sentences
from comparison.agreement.results import Attribution, ChannelComparison
from comparison.scene import Scene
from comparison.tables.arrays import Array, BoolArray

Channels = Mapping[str, ChannelComparison]
Masks = Mapping[str, BoolArray]

_NEAR = 5  # windows of u to either side, i.e. 5 % of a cycle: about one flight between two impacts
_HALF = 0.5  # of what a refinement should remove; less explains nothing
_LITTLE = 0.1  # of the difference: what the other's refinement may also remove
_REFINED = ("a", "b", "both")


def attribute(
    runs: tuple[Runs, Runs],
    results: Channels,
    time: Array,
    *,
    verdict: str,
    tier: str,
    labels: tuple[str, str],
    scene: Scene | None,
) -> Attribution:
    """Attribute the differences of a scene.

    Parameters
    ----------
    runs
        Of both models.
    results, time
        The judged channels and their common time (s), shape (n,).
    verdict, tier, labels, scene
        As in `comparison.agreement.results.SceneComparison`.

    Returns
    -------
    attribution
        For tables without uncertainty only the first sample outside the tolerance.
    """
    excited = {name: channel for name, channel in results.items() if channel.verdict != "unexcited"}
    judged = {name: channel.judged for name, channel in excited.items()}
    outside = {name: channel.beyond for name, channel in excited.items()}
    # A scene may differ by a time shift alone, which no channel shows: then all channels count.
    deciding = {name: c for name, c in excited.items() if c.verdict == verdict} or excited
    found = _first(deciding if verdict == "differ" else excited, time)
    if scene is not None and excited and all(channel.u is not None for channel in excited.values()):
        share = next(iter(excited.values())).limits.share
        differs = _explained(judged, outside, deciding) < share
        samples = window_samples(scene.period, float(time[-1] - time[0]) / (time.size - 1))
        found = replace(
            found,
            explained=_explained(judged, outside, excited),
            still_moves=_still_moves(runs, deciding, outside, _NEAR * samples) if differs else {},
            **_causes(runs, deciding, outside if differs else judged, differs=differs),
            **_unpredictable(runs, results, time, samples),
        )
    return replace(found, sentences=sentences(found, runs, labels=labels, scene=scene, tier=tier))


def _first(channels: Channels, time: Array) -> Attribution:
    """Find the first sample outside; of several channels the one that is the farthest outside there."""
    starts = []
    for name, channel in channels.items():
        beyond, threshold = channel.beyond, channel.threshold
        if threshold is not None and beyond.any():
            first = int(beyond.argmax())
            limit = float(threshold[first])
            starts.append((first, -abs(float(channel.difference[first])) / limit if limit else -inf, name))
    if not starts:
        return Attribution()
    first, _, name = min(starts)
    return Attribution(outside_from=float(time[first]), outside_in=name)


def _explained(judged: Masks, outside: Masks, names: Iterable[str]) -> float:
    total = sum(int(judged[name].sum()) for name in names)
    return 1.0 - sum(int(outside[name].sum()) for name in names) / total if total else nan


def _causes(runs: tuple[Runs, Runs], deciding: Channels, masks: Masks, *, differs: bool) -> dict[str, Any]:
    """Return the remainder of the difference under refinement on the masked samples, and its cause."""
    parts = {name: _squares(runs, channel, masks[name]) for name, channel in deciding.items()}
    total = {key: sum(part[key] for part in parts.values()) for key in ("base", *_REFINED)}
    remaining = _remaining(total)
    causes: dict[str, Any] = {
        "remaining": remaining,
        "channels": {name: _remaining(part) for name, part in parts.items()},
    }
    gain = {"a": runs[0].gain, "b": runs[1].gain, "both": min(of.gain for of in runs)}
    removes = {key: 1 - remaining[key] >= _HALF * (1 - 1 / gain[key]) for key in _REFINED}
    count = sum(int(masks[name].sum()) for name in deciding)
    rounded = sum(_rounded(channel, masks[name], runs[0].base.time) for name, channel in deciding.items())
    if not count:
        cause = ""
    elif differs:
        cause = "models"
    elif rounded == count:
        cause = "round-off"
    elif removes["a"] and remaining["b"] >= 1 - _LITTLE:
        cause = "a"
    elif removes["b"] and remaining["a"] >= 1 - _LITTLE:
        cause = "b"
    else:
        cause = "both" if removes["both"] else "neither"
    return causes | {"cause": cause}


def _squares(runs: tuple[Runs, Runs], channel: ChannelComparison, mask: BoolArray) -> dict[str, float]:
    """Sum the squares of the scaled difference, original and refined, on the masked samples."""
    a, b = channel.a[mask], channel.b[mask]
    fine_a, fine_b = (_finer(of, channel)[mask] for of in runs)
    differences = {"base": a - b, "a": fine_a - b, "b": a - fine_b, "both": fine_a - fine_b}
    return {key: float(np.sum((values / channel.scale) ** 2)) for key, values in differences.items()}


def _rounded(channel: ChannelComparison, mask: BoolArray, time: Array) -> int:
    """Count the masked samples at which the difference is within round-off."""
    absolute = channel.definition.round_off
    floor = hypot(*(round_off(values, time, absolute) for values in (channel.a, channel.b)))
    return int((np.abs(channel.difference[mask]) <= floor).sum())


def _remaining(squares: Mapping[str, float]) -> dict[str, float]:
    base = squares["base"]
    return {key: sqrt(squares[key] / base) if base > 0 else nan for key in _REFINED}


def _still_moves(
    runs: tuple[Runs, Runs], deciding: Channels, outside: Masks, half_width: int
) -> dict[str, float]:
    """Return the share of outside samples near which refinement changes a run by as much as its error.

    That is by 1 - 1/gain of the difference. At the sample itself it cannot, or u would be larger; nearby it
    indicates that u is small by chance.
    """
    shares = {}
    for side, of in zip("ab", runs, strict=True):
        count = total = 0
        for name, channel in deciding.items():
            moved = np.abs(_finer(of, channel) - of.base.values(name))
            widest = maximum_filter1d(moved, 2 * half_width + 1, mode="nearest")
            far = (widest >= (1 - 1 / of.gain) * np.abs(channel.difference))[outside[name]]
            count, total = count + int(far.sum()), total + far.size
        shares[side] = count / total if total else nan
    return shares


def _unpredictable(
    runs: tuple[Runs, Runs], results: Channels, time: Array, half_width: int
) -> dict[str, Any]:
    """Return why the samples of the indeterminate channels are not predictable, and from when."""
    reasons: dict[str, list[BoolArray]] = {}
    for name, channel in results.items():
        if channel.verdict != "indeterminate":
            continue
        followed = [results[key] for key in (name, channel.definition.follows or "") if key in results]
        by = [np.logical_or.reduce([_large(c, (c.u_a, c.u_b)[side]) for c in followed]) for side in (0, 1)]
        spreads = [
            np.logical_or.reduce([_large(c, _spread(of, c, half_width)) for c in followed]) for of in runs
        ]
        missing = ~channel.predictable
        cases = {
            "a": by[0] & ~by[1],
            "b": by[1] & ~by[0],
            "each": by[0] & by[1],
            "together": ~(by[0] | by[1]),
        }
        for key, case in (cases | {"neighbours": spreads[0] | spreads[1]}).items():
            reasons.setdefault(key, []).append(missing & case)
    count = {key: sum(int(mask.sum()) for mask in masks) for key, masks in reasons.items()}
    total = sum(count[key] for key in ("a", "b", "each", "together")) if count else 0
    if not total:
        return {}
    chief = max(("a", "b", "each", "together"), key=lambda key: count[key])
    first = int(np.logical_or.reduce(reasons[chief]).argmax())
    return {
        "unpredictable": {key: number / total for key, number in count.items()},
        "unpredictable_from": float(time[first]),
    }


def _large(channel: ChannelComparison, u: Array | None) -> BoolArray:
    """Return where a part of u alone is too large to predict the sample, shape (n,)."""
    if u is None:
        return np.zeros(channel.difference.shape, dtype=np.bool_)
    return u > channel.limits.alpha * channel.scale


def _spread(of: Runs, channel: ChannelComparison, half_width: int) -> Array:
    name = channel.channel
    return spread(of.original.values(name), [run.values(name) for run in of.perturbed_runs], half_width)


def _finer(of: Runs, channel: ChannelComparison) -> Array:
    """Return the refined run of a channel that has an uncertainty, shape (n,)."""
    assert of.finer is not None
    return of.finer.values(channel.channel)
