"""Verdict of all scenes at both tiers in one sentence, and the decisive channel of a scene."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence

import numpy as np

from comparison.agreement.results import ChannelComparison, SceneComparison

SYMBOLS = {
    "agree": "✓",
    "differ": "✗",
    "indeterminate": "?",
    "undecided": "?",
    "unexcited": "○",
    "cannot compare": "!",
}
"""Signs beside the words of a verdict, so that colour is not needed to find it."""

_RANK = {"unexcited": 0, "agree": 1, "indeterminate": 2, "differ": 3, "cannot compare": 4}
_COUNTED = {
    "cannot compare": ("cannot be compared", "cannot be compared"),
    "differ": ("differs", "differ"),
    "indeterminate": ("is indeterminate", "are indeterminate"),
    "agree": ("agrees", "agree"),
}


def rank(verdict: str) -> int:
    """Return the severity of a verdict; an unknown one is the worst."""
    return _RANK.get(verdict, len(_RANK))


def worst_verdict(scene: SceneComparison) -> str:
    """Return the worse of a scene's verdicts at its tiers."""
    return max((tier.verdict for tier in scene.tiers), key=rank)


def overall_verdict(comparisons: Sequence[SceneComparison]) -> str:
    """Return the worst verdict of the scenes at any tier; without a scene nothing was compared."""
    return max((worst_verdict(scene) for scene in comparisons), key=rank, default="cannot compare")


def sentence(comparisons: Sequence[SceneComparison]) -> str:
    """Return one sentence for all scenes: "Of 8 scenes 1 differs and 7 agree.".

    Where some were also compared at the tight tier: "At the standard tier all 8 agree; at the tight tier of 8
    scenes 1 differs and 7 agree.". A second one follows where an uncertainty had been underestimated.
    """
    closer = [scene.tight for scene in comparisons if scene.tight is not None]
    if not closer:
        said = _of_tier(comparisons)
        return f"{said[0].upper()}{said[1:]}.{_corrected(comparisons)}"
    return (
        f"At the standard tier {_of_tier(comparisons)}; at the tight tier {_of_tier(closer)}."
        f"{_corrected([*comparisons, *closer])}"
    )


def _corrected(judged: Sequence[SceneComparison]) -> str:
    found = [of.confirmation for of in judged if of.confirmation is not None]
    count = sum(confirmation.outcome == "underestimated" for confirmation in found)
    if not count:
        return ""
    words = "1 of these verdicts rests" if count == 1 else f"{count} of these verdicts rest"
    return f" {words} on a corrected uncertainty."


def _of_tier(comparisons: Sequence[SceneComparison]) -> str:
    if not comparisons:
        return "there is no scene to compare"
    count = Counter(scene.verdict for scene in comparisons)
    words = [
        f"{number} {_COUNTED.get(verdict, (verdict, verdict))[number > 1]}"
        for verdict, number in sorted(count.items(), key=lambda item: -rank(item[0]))
    ]
    said = words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"
    if len(comparisons) == 1:
        return f"the scene {comparisons[0].name} {said.removeprefix('1 ')}"
    return f"all {said}" if len(words) == 1 else f"of {len(comparisons)} scenes {said}"


def worst_channel(scene: SceneComparison) -> ChannelComparison | None:
    """Return the channel that decides a scene: the same that the reason of its verdict names.

    Where it is indeterminate that with the least coverage, else `SceneComparison.decisive`.
    """
    unsettled = [channel for channel in scene.channels.values() if channel.verdict == "indeterminate"]
    if scene.verdict == "indeterminate" and unsettled:
        return min(unsettled, key=lambda channel: channel.coverage)
    return scene.decisive


def largest_predictable(channel: ChannelComparison) -> float:
    """Return the largest |difference| of the predictable samples, in the channel's unit; nan without one."""
    part = channel.difference[channel.predictable]
    return float(np.max(np.abs(part))) if part.size else math.nan
