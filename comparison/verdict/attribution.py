"""Attribution of a difference: how much of it refining either model, or both, leaves.

With the difference E = a - b, the remainders are E_a = a_finer - b and E_b = a - b_finer: if b's step causes
the difference, refining b divides E by factor^order and refining a leaves it unchanged; if the equations
differ, neither has an effect. Magnitudes are root mean squares over the channel's scale, of the decisive
samples: those outside their band where the models differ, else all judged samples, in the channels whose
verdict is the scene's.
"""

from collections.abc import Mapping
from dataclasses import replace
from math import inf, nan, sqrt

import numpy as np

from comparison.accuracy.levels import finer
from comparison.accuracy.uncertainty import Runs, observed_order
from comparison.scene import Scene
from comparison.verdict.results import Attribution, ChannelComparison, Refinement

Channels = Mapping[str, ChannelComparison]


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
        changed = [key for key in old if isinstance(old[key], float) and old[key] != new[key]]
        chief = min(changed, key=lambda key: abs(old[key] / new[key] - factor))
        settings = {chief: old[chief]} | {key: old[key] for key in changed}
    judged = {name: (channel.predictable, channel.scale) for name, channel in excited.items()}
    return Refinement(label, settings, factor, order, observed_order(model, judged))
