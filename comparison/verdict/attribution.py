"""Attribution of a difference to a setting of one model, the numerics of both, or the models themselves.

Each side is refined separately. With the difference E = a - b, the remainders are E_a = a_finer - b and E_b =
a - b_finer: if b's step causes the difference, refining b divides E by factor^order and refining a leaves it
unchanged; if the equations differ, neither has an effect. Magnitudes are root mean squares over the channel's
scale, of the decisive samples: those outside their band where the models differ, else all judged samples, in
the channels whose verdict is the scene's.
"""

from collections.abc import Mapping
from dataclasses import replace
from math import hypot, inf, nan, sqrt
from typing import Any

import numpy as np
from scipy.ndimage import maximum_filter1d

from comparison.accuracy.levels import AccuracyError, finer, solver_values
from comparison.accuracy.uncertainty import Runs, observed_order, round_off, spread, window_samples
from comparison.scene import Scene
from comparison.tables.channels import Array, BoolArray
from comparison.verdict.results import Attribution, ChannelComparison, Refinement

Channels = Mapping[str, ChannelComparison]

_NEAR = 5  # windows of u to either side, i.e. 5 % of a cycle: about one flight between two impacts
_HALF = 0.5  # of what a refinement should remove; less explains nothing
_LITTLE = 0.1  # of the difference: what the other's refinement may also remove
_REFINED = ("a", "b", "both")


def attribute(
    runs: tuple[Runs, Runs],
    results: Channels,
    *,
    verdict: str,
    tier: str,
    labels: tuple[str, str],
    scene: Scene | None,
) -> Attribution:
    """Attribute the differences of a scene's judged channels.

    For tables without uncertainty only the first sample outside the tolerance is found.
    """
    excited = {name: channel for name, channel in results.items() if channel.verdict != "unexcited"}
    # A scene may differ by a time shift alone, which no channel shows: then all channels count.
    deciding = {name: channel for name, channel in excited.items() if channel.verdict == verdict} or excited
    outside = _first(deciding if verdict == "differ" else excited)
    if scene is None or not excited or any(channel.u is None for channel in excited.values()):
        return outside
    some = next(iter(excited.values()))
    differs = _explained(deciding) < some.limits.share
    samples = window_samples(scene.period, float(some.time[-1] - some.time[0]) / (some.time.size - 1))
    unpredictable = _unpredictable(runs, results, samples)
    first, second = (
        _refinement(label, model, scene, excited) for label, model in zip(labels, runs, strict=True)
    )
    return replace(
        outside,
        explained=_explained(excited),
        still_moves=_still_moves(runs, deciding, _NEAR * samples) if differs else {},
        refinements=(first, second),
        strict_helps=tier == "standard" and _coarser_than_strict(unpredictable, labels, scene),
        **_causes(runs, deciding, differs=differs),
        **unpredictable,
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


def _finer(model: Runs, name: str) -> Array:
    assert model.finer is not None
    return model.finer.values(name)


def _causes(runs: tuple[Runs, Runs], deciding: Channels, *, differs: bool) -> dict[str, Any]:
    """Return the remainder of the difference under refinement on the decisive samples, and its cause."""
    total, channels, count, rounded = dict.fromkeys(("base", *_REFINED), 0.0), {}, 0, 0
    for name, channel in deciding.items():
        mask = channel.beyond if differs else channel.judged
        a, b = channel.a[mask], channel.b[mask]
        fine_a, fine_b = (_finer(model, name)[mask] for model in runs)
        differences = {"base": a - b, "a": fine_a - b, "b": a - fine_b, "both": fine_a - fine_b}
        squares = {key: float(np.sum((values / channel.scale) ** 2)) for key, values in differences.items()}
        channels[name] = _remaining(squares)
        total = {key: total[key] + square for key, square in squares.items()}
        absolute, time = channel.definition.round_off, runs[0].base.time
        floor = hypot(*(round_off(values, time, absolute) for values in (channel.a, channel.b)))
        count += a.size
        rounded += int((np.abs(a - b) <= floor).sum())
    remaining = _remaining(total)
    gain = {"a": runs[0].gain, "b": runs[1].gain, "both": min(model.gain for model in runs)}
    removes = {key: 1 - remaining[key] >= _HALF * (1 - 1 / gain[key]) for key in _REFINED}
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
    return {"cause": cause, "remaining": remaining, "channels": channels}


def _remaining(squares: Mapping[str, float]) -> dict[str, float]:
    base = squares["base"]
    return {key: sqrt(squares[key] / base) if base > 0 else nan for key in _REFINED}


def _still_moves(runs: tuple[Runs, Runs], deciding: Channels, half_width: int) -> dict[str, float]:
    """Return the share of outside samples near which refinement changes a run by as much as its error.

    That is by 1 - 1/gain of the difference. At the sample itself it cannot, or u would be larger; nearby it
    indicates that u is small by chance.
    """
    shares = {}
    for side, model in zip("ab", runs, strict=True):
        far = []
        for name, channel in deciding.items():
            moved = np.abs(_finer(model, name) - model.base.values(name))
            widest = maximum_filter1d(moved, 2 * half_width + 1, mode="nearest")
            far.append((widest >= (1 - 1 / model.gain) * np.abs(channel.difference))[channel.beyond])
        everywhere = np.concatenate(far)
        shares[side] = float(everywhere.mean()) if everywhere.size else nan
    return shares


def _unpredictable(runs: tuple[Runs, Runs], results: Channels, half_width: int) -> dict[str, Any]:
    """Return why the samples of the indeterminate channels are not predictable, and from when."""

    def spread_of(model: Runs, name: str) -> Array:
        perturbed = [run.values(name) for run in model.perturbed_runs]
        return spread(model.original.values(name), perturbed, half_width)

    masks: dict[str, list[BoolArray]] = {key: [] for key in ("a", "b", "each", "together", "neighbours")}
    for name, channel in results.items():
        if channel.verdict != "indeterminate":
            continue
        # With those of the position that it follows.
        parts = [results[key] for key in (name, channel.definition.follows or "") if key in results]
        of_a, of_b, neighbours = (
            np.any([u > part.limits.alpha * part.scale for part, u in sizes if u is not None], axis=0)
            for sizes in (
                [(part, part.u_a) for part in parts],
                [(part, part.u_b) for part in parts],
                [(part, spread_of(model, part.channel)) for model in runs for part in parts],
            )
        )
        cases = of_a & ~of_b, of_b & ~of_a, of_a & of_b, ~(of_a | of_b), neighbours
        for of_case, case in zip(masks.values(), cases, strict=True):
            of_case.append(~channel.predictable & case)
    count = {key: sum(int(mask.sum()) for mask in of_case) for key, of_case in masks.items()}
    causes = ("a", "b", "each", "together")
    total = sum(count[key] for key in causes)
    if not total:
        return {}
    chief = max(causes, key=lambda key: count[key])
    first = int(np.any(masks[chief], axis=0).argmax())
    return {
        "unpredictable": {key: number / total for key, number in count.items()},
        "unpredictable_from": float(next(iter(results.values())).time[first]),
    }


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


def _coarser_than_strict(unpredictable: Mapping[str, Any], labels: tuple[str, str], scene: Scene) -> bool:
    """Return whether a model that limits the coverage runs at a setting coarser than strict."""
    if not (shares := unpredictable.get("unpredictable")):
        return False
    most = max(shares["a"], shares["b"])
    for label in (label for key, label in zip("ab", labels, strict=True) if shares[key] == most):
        try:
            strict = solver_values(label, "strict", scene)
        except AccuracyError:
            continue
        settings = scene.data["solver"].get(label, {})
        if all(settings[key.rpartition(".")[2]] > value for key, value in strict.items()):
            return True
    return False
