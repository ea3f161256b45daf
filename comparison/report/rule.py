"""The rule behind the verdicts, in words and as the curve that a difference is held against."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from comparison.accuracy.thresholds import thresholds
from comparison.accuracy.uncertainty import (
    ENSEMBLE_FACTOR,
    SAFETY_FACTOR,
    SAFETY_FACTOR_IN_ORDER,
    TWIN_SHIFT,
    WINDOW,
)
from comparison.agreement.confirmation_starts import ENOUGH, MEMBERS, OTHER_MEMBERS
from comparison.agreement.results import ChannelComparison, SceneComparison
from comparison.formatting import number
from comparison.tables.arrays import Array, BoolArray


def definition(comparisons: Sequence[SceneComparison]) -> list[str]:
    """Return how the verdicts of these scenes are made, one step a line."""
    tiers = {tier.tier: thresholds(tier.tier) for scene in comparisons for tier in scene.tiers}
    fixed = thresholds()
    alpha = _by_tier({name: f"{limits.alpha:g}" for name, limits in tiers.items()})
    floor = _by_tier({name: f"{limits.coverage:.0%}" for name, limits in tiers.items()})
    shift = number(TWIN_SHIFT, 1).removeprefix("1·")
    lines = [
        f"Uncertainty u(t) of one model: {SAFETY_FACTOR:g} times the largest distance of its run to its "
        "refined run, to its coarser run (divided by what a level should gain) "
        f"and of that to its twins (start moved by {shift} of the clearance, offset and angle with equal and "
        "with opposite signs) "
        f"within ±{WINDOW:.0%} of a crank turn; where the three levels show the method's order, "
        f"{SAFETY_FACTOR_IN_ORDER:g} times the error they extrapolate to; never below round-off. "
        "Of both models: u = √(u₁² + u₂²).",
        f"Predictable: the samples with u ≤ {alpha} of the channel's scale; of a force or an "
        "acceleration only where the position that decides about it is predictable too. "
        f"Coverage is their share; below {floor} the channel is indeterminate.",
        f"Agree: |difference| ≤ {fixed.k:g} u on at least {fixed.share:.0%} of the predictable samples "
        "(explained); samples at which both models are exactly zero count for nothing. Differ: on fewer. "
        "A scene differs if one channel does; else its coverage, the mean over its excited channels (one "
        "without a sample to judge counts as zero), is held against the same floor: below it is "
        "indeterminate, at or above it agrees.",
    ]
    if any(channel.u is not None for scene in comparisons for channel in scene.channels.values()):
        lines.append(
            "Differ is confirmed before it is reported: each model runs anew from at least "
            f"{OTHER_MEMBERS} starts (the reference {MEMBERS['reference']}) that are moved by what its own "
            "error is worth there, and the other model's run is ranked in that ensemble by its largest "
            "distance from the centre. It is confirmed where this is larger than that of every run left out "
            "of the ensemble, in both. Else the uncertainty had been underestimated: "
            f"{ENSEMBLE_FACTOR:g} times the largest distance in the ensemble replaces it, and the runs are "
            "judged anew. Five bodies are ranked in an ensemble of the other model. With fewer than "
            f"{ENOUGH} runs the difference stays unconfirmed."
        )
    if any(tier.attribution and tier.attribution.cause for scene in comparisons for tier in scene.tiers):
        lines.append(
            "Where a difference comes from: one model's run is replaced by its refined one, the other's is "
            "kept. A setting whose refinement removes the difference explains it; what no refinement removes "
            "and is beyond the threshold is a difference of models."
        )
    if "tight" in tiers:
        lines.insert(
            0,
            "Each scene is judged at two tiers. Standard: the scene's settings, what a user runs. Tight: "
            "the closest look, the reference at its strict setting and Exudyn on what the drive leaves free, "
            "with error control; a scene that needs all five bodies (no clearance, reactions) runs them as "
            "it says.",
        )
    if any(channel.u is None for scene in comparisons for channel in scene.channels.values()):
        lines.append(
            "Tables without a refined run carry no uncertainty: a fixed tolerance (a share of the scale) is "
            "the threshold and every sample counts as predictable; without one the verdict is indeterminate."
        )
    return lines


def _by_tier(numbers: Mapping[str, str]) -> str:
    """Return "0.01 (standard tier) or 5e-05 (tight tier)", of one tier the number alone."""
    if len(numbers) < 2:
        return next(iter(numbers.values()), "")
    return " or ".join(f"{text} ({tier} tier)" for tier, text in numbers.items())


def threshold(channel: ChannelComparison) -> tuple[Array | None, str]:
    """Return what |difference| is held against, shape (n,), and its name.

    k u where the tables carry an uncertainty, else the fixed tolerance; None without either.
    """
    if channel.u is not None:
        return channel.limits.k * channel.u, f"{channel.limits.k:g} u"
    if np.isnan(channel.worst_threshold):
        return None, "threshold"
    return np.broadcast_to(channel.worst_threshold, channel.difference.shape), "tolerance"


def limit_of_predictability(channel: ChannelComparison) -> float:
    """Return the threshold above which a sample is not predictable; nan where there is no uncertainty."""
    fixed = channel.limits
    return fixed.k * fixed.alpha * channel.scale if channel.u is not None else float("nan")


def beyond(channel: ChannelComparison) -> BoolArray:
    """Return where predictable samples are beyond the threshold, shape (n,)."""
    held_against, _ = threshold(channel)
    if held_against is None:
        return np.zeros(channel.difference.shape, dtype=np.bool_)
    return channel.predictable & (np.abs(channel.difference) > held_against)
