"""The rule of the verdicts: its description, and the threshold curve of a difference."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from comparison.accuracy.levels import thresholds
from comparison.accuracy.uncertainty import (
    ENSEMBLE_FACTOR,
    PERTURBATION,
    SAFETY_FACTOR,
    SAFETY_FACTOR_IN_ORDER,
    WINDOW,
)
from comparison.agreement.confirmation_starts import ENOUGH, MEMBERS, OTHER_MEMBERS
from comparison.agreement.results import ChannelComparison, SceneComparison
from comparison.formatting import number
from comparison.tables.arrays import Array


def definition(comparisons: Sequence[SceneComparison]) -> list[str]:
    """Return the definition of the verdicts of these scenes, one step per line."""
    tiers = {tier.tier: thresholds(tier.tier) for scene in comparisons for tier in scene.tiers}
    fixed = thresholds()
    alpha = _by_tier({name: f"{limits.alpha:g}" for name, limits in tiers.items()})
    floor = _by_tier({name: f"{limits.coverage:.0%}" for name, limits in tiers.items()})
    shift = number(PERTURBATION, 1).removeprefix("1·")
    lines = [
        f"Uncertainty u(t) of one model: {SAFETY_FACTOR:g} times the largest distance of its run to its "
        "refined run, to its coarser run (divided by the error ratio expected between two levels) "
        f"and of the coarser run to its perturbed runs (start moved by {shift} of the clearance, offset and "
        "angle with equal and with opposite signs) "
        f"within ±{WINDOW:.0%} of a crank cycle; where the three levels show the method's order, "
        f"{SAFETY_FACTOR_IN_ORDER:g} times the extrapolated error; never below round-off. "
        "Of both models: u = √(u₁² + u₂²).",
        f"Predictable: the samples with u ≤ {alpha} of the channel's scale; of a force or an "
        "acceleration only where the position that it depends on is predictable too. "
        f"Coverage is their share; below {floor} the channel is indeterminate.",
        f"Agree: |difference| ≤ {fixed.k:g} u on at least {fixed.share:.0%} of the predictable samples "
        f"(explained), so that |E|/{fixed.k:g}u ({fixed.share:.0%}), the ratio that this share stays within, "
        "is at most 1; that of a scene is the largest of its channels. Samples at which both models are "
        "exactly zero are not counted. Differ: on fewer; of a "
        "channel below the floor, if it would be fewer even with all other samples explained. "
        "A scene differs if one channel does; else its coverage, the mean over its excited channels (one "
        "without a sample to judge counts as zero), is compared with the same floor: below it is "
        "indeterminate, at or above it agrees.",
    ]
    if any(channel.u is not None for scene in comparisons for channel in scene.channels.values()):
        lines.append(
            "Differ is confirmed before it is reported: each model is rerun from at least "
            f"{OTHER_MEMBERS} starts (the reference {MEMBERS['reference']}) that are moved by the initial "
            "perturbation equivalent to its own error, and the other model's run is ranked in that "
            "ensemble by its largest "
            "distance from the centre. It is confirmed if this exceeds, in both ensembles, the distance of "
            "every member left out. Otherwise the uncertainty was underestimated: "
            f"{ENSEMBLE_FACTOR:g} times the largest distance in the ensemble replaces it, and the runs are "
            "judged again. Exudyn's run of five bodies is ranked in an ensemble of the other model; any "
            "verdict of theirs but agree is first judged again at half the step, up to four times, until it "
            "is known what they converge to, and a difference of models is what outlasts this. With fewer "
            f"than {ENOUGH} runs the difference stays unconfirmed."
        )
    if any(tier.attribution and tier.attribution.cause for scene in comparisons for tier in scene.tiers):
        lines.append(
            "Attribution of a difference: one model's run is replaced by its refined run, the other's is "
            "kept. A setting whose refinement removes the difference explains it; a difference above the "
            "threshold that no refinement removes is a difference of models."
        )
    if "tight" in tiers:
        lines.insert(
            0,
            "Each scene is judged at two tiers. Standard: the scene's settings, as a user runs it. Tight: "
            "the reference at its strict setting and Exudyn's tree of free bodies with error control; a "
            "scene that requires five bodies (no clearance, reactions) runs with its own settings.",
        )
    if any(channel.u is None for scene in comparisons for channel in scene.channels.values()):
        lines.append(
            "Tables without a refined run carry no uncertainty: a fixed tolerance (a share of the scale) is "
            "the threshold, every sample counts as predictable and all must be within it, unless a smaller "
            "share was asked for; without a tolerance the verdict is indeterminate."
        )
    return lines


def ratio(comparisons: Sequence[SceneComparison]) -> tuple[str, str]:
    """Return the name of the ratio that these verdicts rest on, and what it is."""
    channels = [c for scene in comparisons for tier in scene.tiers for c in tier.channels.values()]
    limits = channels[0].limits if channels else thresholds()
    against = "tolerance" if channels and channels[0].u is None else f"{limits.k:g}u"
    share = f"{100 * limits.share:g}%"
    name = channels[0].ratio_name if channels else f"|E|/{against} ({share})"
    return name, f"the |difference| / {against} that {share} of the judged samples stay within"


def _by_tier(numbers: Mapping[str, str]) -> str:
    """Return "0.01 (standard tier) or 5e-05 (tight tier)"; for a single tier the number alone."""
    if len(numbers) < 2:
        return next(iter(numbers.values()), "")
    return " or ".join(f"{text} ({tier} tier)" for tier, text in numbers.items())


def threshold(channel: ChannelComparison) -> tuple[Array | None, str]:
    """Return the threshold of |difference|, shape (n,), and its name.

    k u where the tables carry an uncertainty, else the fixed tolerance; None without either.
    """
    if channel.u is not None:
        return channel.threshold, f"{channel.limits.k:g} u"
    return channel.threshold, "threshold" if channel.threshold is None else "tolerance"


def limit_of_predictability(channel: ChannelComparison) -> float:
    """Return the threshold above which a sample is not predictable; nan where there is no uncertainty."""
    fixed = channel.limits
    return fixed.k * fixed.alpha * channel.scale if channel.u is not None else float("nan")
