"""The verdict card of a scene, and the definition of the verdicts, for pages."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import isnan

from comparison.accuracy.levels import thresholds
from comparison.accuracy.uncertainty import (
    ENSEMBLE_FACTOR,
    PERTURBATION,
    SAFETY_FACTOR,
    SAFETY_FACTOR_IN_ORDER,
    WINDOW,
)
from comparison.formatting import NO_BREAK, number, percent, quantity
from comparison.scene import Scene, command_line
from comparison.verdict.confirmation import ENOUGH, MEMBERS, OTHER_MEMBERS
from comparison.verdict.results import SceneComparison
from comparison.words.differences import instant_of
from comparison.words.verdicts import bound, mark, scene_reason

_CHATTER = 0.05  # of a crank cycle before an instant: about one flight between two impacts
_MANY = 5  # contacts that begin in it


@dataclass(frozen=True)
class Card:
    """Texts of a card: one plain sentence, the observed orders, what to do next."""

    sentence: str
    order: str
    advice: str
    commands: tuple[str, ...]


def card(scene: SceneComparison) -> Card:
    """Return the card of a scene at one tier."""
    advice, commands = _next(scene)
    order = ", ".join(
        f"{change.label} {number(change.observed, 2)} (expected {change.order:g})"
        for change in scene.attribution.refinements
        if not isnan(change.observed)
    )
    return Card(_sentence(scene), order, advice, tuple(filter(None, commands)))


def _sentence(scene: SceneComparison) -> str:
    if scene.verdict == "indeterminate":
        return f"Not decided: {_undecided(scene)}."
    channel = scene.decisive
    if channel is None:
        return f"{scene_reason(scene)}."
    size, limit = (
        quantity(value, channel.unit, 2) for value in (channel.worst_size, channel.worst_threshold)
    )
    most = "" if channel.limits.share == 1.0 else f", the maximum {number(channel.largest_ratio, 2)}"
    text = (
        f"{channel.label}: {channel.ratio_name} is {number(channel.ratio, 2)}{most}: {size} against {limit}"
    )
    if scene.verdict == "differ":
        since = scene.attribution.outside_from
        since = channel.worst_time if isnan(since) else since
        text += f"; the trajectories diverge at {instant_of(since, scene)}{_chatter(scene, since)}"
    else:
        text += f", at {channel.worst_time:.4g}{NO_BREAK}s; no channel is nearer to its limit"
    if scene.refined and scene.confirmation is None:
        text += f", of finer runs ({mark(scene)})"
    return f"{text}{_card_confirmation(scene)}."


def _chatter(scene: SceneComparison, time: float) -> str:
    """Return ", just after chatter (7 contacts in the 20 ms before)"; empty where there was none."""
    table = next((events for events in scene.events if events is not None), None)
    if table is None or scene.period is None:
        return ""
    before = _CHATTER * scene.period
    count = int(((table["start"] > time - before) & (table["start"] <= time)).sum())
    if count < _MANY:
        return ""
    return f", just after chatter ({count} contacts in the {quantity(before, 's', 2)} before)"


def _card_confirmation(scene: SceneComparison) -> str:
    result = scene.confirmation
    if result is None:
        return ""
    if result.outcome == "underestimated":
        return f"; the uncertainty had been underestimated {number(result.factor, 2)} times and is corrected"
    return f"; {mark(scene)}"


def _undecided(scene: SceneComparison) -> str:
    worst = scene.worst_channel
    if worst is None or isnan(scene.coverage) or scene.unsettled:
        return scene_reason(scene)
    text = f"{percent(scene.coverage)} of the samples are predictable, at least "
    text += f"{worst.limits.coverage:.0%} are required"
    excited = [channel for channel in scene.channels.values() if channel.verdict != "unexcited"]
    if any(channel.coverage > worst.coverage for channel in excited):
        text += f"; least of all {worst.label} ({percent(worst.coverage)})"
    return text + _card_confirmation(scene)


def _next(scene: SceneComparison) -> tuple[str, list[str]]:
    """Return what to do next, and the commands for it; the latter empty where there is nothing to do."""
    if scene.verdict == "indeterminate" and scene.closer_command:
        tables = "State the difference that is allowed, as a share of each scale:"
        return tables if scene.ran is None else "See whether finer settings decide it:", [
            scene.closer_command
        ]
    if scene.ran is None or scene.verdict == "indeterminate":
        return "", []
    if scene.verdict == "cannot compare":
        if scene.failed is None:
            return "Run the scene again once the cause is removed:", [scene.command]
        return "Repeat the run that failed, by itself:", [_run(scene, scene.failed.scene, scene.failed.model)]
    if scene.verdict == "differ":
        return "Find which model errs, by a third opinion:", _third_opinion(scene, scene.ran)
    if scene.confirmation is not None and scene.confirmation.suspicious:
        what, closer = "A discontinuous event decides", scene.closer_command
        return (f"{what}; look at it at finer settings:", [closer]) if closer else (f"{what}.", [])
    return "Nothing to do.", []


def _third_opinion(scene: SceneComparison, ran: Scene) -> list[str]:
    """Return commands that run another formulation of one model and compare it with the reference."""
    model, formulation = "exudyn", "full"
    if ran.data["solver"]["exudyn"]["formulation"] == "full":
        # The reference's multipliers are for an ideal crank pin.
        ideal = ran.data["joints"]["crank_pin"] == "ideal"
        model, formulation = ("reference", "multiplier") if ideal else ("exudyn", "tree")
    host = scene.labels[1] if model == "reference" else scene.labels[0]
    third = ran.variant({f"solver.{model}.formulation": formulation})
    return [
        _run(scene, third, model, formulation),
        _run(scene, ran, host),
        command_line("compare", [f"{scene.name}-{which}.csv" for which in (host, formulation)], {}),
    ]


def _run(scene: SceneComparison, ran: Scene, model: str, what: str = "") -> str:
    """Return the command of one run."""
    return ran.command("run", "--model", model, "--out", f"{scene.name}-{what or model}.csv")


def definition(scenes: Sequence[SceneComparison]) -> list[str]:
    """Return the definition of the verdicts of these scenes, one step per line."""
    tiers = {tier.tier: thresholds(tier.tier) for scene in scenes for tier in scene.tiers}
    judged = [tier for scene in scenes for tier in scene.tiers]
    channels = [channel for tier in judged for channel in tier.channels.values()]
    known = [channel.u is not None for channel in channels]
    fixed = thresholds()
    alpha = _by_tier({name: f"{limits.alpha:g}" for name, limits in tiers.items()})
    floor = _by_tier({name: f"{limits.coverage:.0%}" for name, limits in tiers.items()})
    lines = []
    if "tight" in tiers:
        lines.append(
            "Each scene is judged at two tiers. Standard: the scene's settings, as a user runs it. Tight: "
            "the reference at its strict setting and Exudyn's tree of free bodies with error control; a "
            "scene that requires five bodies (no clearance, reactions) runs with its own settings."
        )
    if any(known) or not known:
        lines += [
            f"Uncertainty u(t) of one model: {SAFETY_FACTOR:g} times the largest distance of its run to its "
            "refined run, to its coarser run (divided by the error ratio expected between two levels) and of "
            f"the coarser run to its perturbed runs (start moved by {number(PERTURBATION, 1)} of the "
            "clearance, offset and angle with equal and with opposite signs) "
            f"within ±{WINDOW:.0%} of a crank cycle; where the three levels show the method's order, "
            f"{SAFETY_FACTOR_IN_ORDER:g} times the extrapolated error; never below round-off. "
            "Of both models: u = √(u₁² + u₂²).",
            f"Predictable: the samples with u ≤ {alpha} of the channel's scale; of a force or an "
            "acceleration only where the position that it depends on is predictable too. "
            f"Coverage is their share; below {floor} the channel is indeterminate.",
            f"Agree: |difference| ≤ {fixed.k:g} u on at least {fixed.share:.0%} of the predictable samples "
            f"(explained), so that |E|/{fixed.k:g}u ({fixed.share:.0%}), the ratio that this share stays "
            "within, is at most 1; that of a scene is the largest of its channels. Samples at which both "
            "models are exactly zero are not counted. Differ: on fewer; of a channel below the floor, if it "
            "would be fewer even with all other samples explained. A scene differs if one channel does; else "
            "its coverage, the mean over its excited channels (one without a sample to judge counts as "
            "zero), is compared with the same floor: below it is indeterminate, at or above it agrees.",
        ]
    if any(known):
        lines.append(
            "Differ is confirmed before it is reported: each model is rerun from at least "
            f"{OTHER_MEMBERS} starts (the reference {MEMBERS['reference']}) that are moved by the initial "
            "perturbation equivalent to its own error, and the other model's run is ranked in that ensemble "
            "by its largest distance from the centre. It is confirmed if this exceeds, in both ensembles, "
            "the distance of every member left out. Otherwise the uncertainty was underestimated: "
            f"{ENSEMBLE_FACTOR:g} times the largest distance in the ensemble replaces it, and the runs are "
            "judged again. Exudyn's run of five bodies is ranked in an ensemble of the other model; any "
            "verdict of theirs but agree is first re-tested at half the step, up to four times, until it is "
            "known what they converge to, and a difference of models is what outlasts this. With fewer than "
            f"{ENOUGH} runs the difference stays unconfirmed."
        )
    if any(tier.attribution.cause for tier in judged):
        lines.append(
            "Attribution of a difference: one model's run is replaced by its refined run, the other's is "
            "kept. A setting whose refinement removes the difference explains it; a difference above the "
            "threshold that no refinement removes is a difference of models."
        )
    if not all(known):
        lines.append(
            "Tables without a refined run carry no uncertainty: a fixed tolerance (a share of the scale) is "
            "the threshold, every sample counts as predictable and all must be within it, unless a smaller "
            "share was asked for; without a tolerance the verdict is indeterminate."
        )
    late = {channel.time_tolerance: None for channel in channels if channel.time_tolerance}
    lines += [
        f"Either table may be early or late by {quantity(time, 's')}: a sample must be within the tolerance "
        "of the range that the other table has within this time to either side."
        for time in late
    ]
    checks = (check for channel in channels for check in channel.checks)
    limits = dict.fromkeys(f"{check.metric} {bound(check)}" for check in checks)
    if limits:
        lines.append(
            "Limits of metrics, which every channel must meet beside the tolerance, or alone where there is "
            f"none: {', '.join(limits)}."
        )
    return lines


def ratio(scenes: Sequence[SceneComparison]) -> tuple[str, str]:
    """Return the name of the ratio that these verdicts rest on, and what it is."""
    channels = [c for scene in scenes for tier in scene.tiers for c in tier.channels.values()]
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
