"""The verdict card of a scene, and the definition of the verdicts, for pages."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from math import isnan

import jinja2

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

_DEFINITION = jinja2.Template(
    files("comparison.words").joinpath("definition.j2").read_text("utf-8"),
    undefined=jinja2.StrictUndefined,
    trim_blocks=True,
    lstrip_blocks=True,
)
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
    sizes = (quantity(value, channel.unit, 2) for value in (channel.worst_size, channel.worst_threshold))
    most = "" if channel.limits.share == 1.0 else f", the maximum {number(channel.largest_ratio, 2)}"
    text = f"{channel.label}: {channel.ratio_name} is {number(channel.ratio, 2)}{most}: "
    text += " against ".join(sizes)
    if scene.verdict == "differ":
        since = scene.attribution.outside_from
        since = channel.worst_time if isnan(since) else since
        text += f"; the trajectories diverge at {instant_of(since, scene)}{_chatter(scene, since)}"
    else:
        text += f", at {channel.worst_time:.4g}{NO_BREAK}s; no channel is nearer to its limit"
    if scene.refined and scene.confirmation is None:
        text += f", of finer runs ({mark(scene)})"
    return f"{text}{_confirmation(scene)}."


def _chatter(scene: SceneComparison, time: float) -> str:
    """Return ", just after chatter (7 contacts in the 20 ms before)"; empty where there was none."""
    table = next((events for events in scene.events if events is not None), None)
    if table is None or scene.period is None:
        return ""
    before = _CHATTER * scene.period
    count = int(((table["start"] > time - before) & (table["start"] <= time)).sum())
    lately = f", just after chatter ({count} contacts in the {quantity(before, 's', 2)} before)"
    return lately if count >= _MANY else ""


def _confirmation(scene: SceneComparison) -> str:
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
    if any(channel.coverage > worst.coverage for channel in scene.excited.values()):
        text += f"; least of all {worst.label} ({percent(worst.coverage)})"
    return text + _confirmation(scene)


def _next(scene: SceneComparison) -> tuple[str, list[str]]:
    """Return what to do next, and the commands for it; the latter empty where there is nothing to do."""
    closer, ran = scene.closer_command, scene.ran
    if scene.verdict == "indeterminate" and closer:
        tables = "State the difference that is allowed, as a share of each scale:"
        return tables if ran is None else "See whether finer settings decide it:", [closer]
    if ran is None or scene.verdict == "indeterminate":
        return "", []
    if scene.verdict == "cannot compare":
        if scene.failed is None:
            return "Run the scene again once the cause is removed:", [scene.command]
        return "Repeat the run that failed, by itself:", [_run(scene, scene.failed.scene, scene.failed.model)]
    if scene.verdict == "differ":
        return "Find which model errs, by a third opinion:", _third_opinion(scene, ran)
    if scene.confirmation is not None and scene.confirmation.suspicious:
        what = "A discontinuous event decides"
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
    judged = [tier for scene in scenes for tier in scene.tiers]
    tiers = {tier.tier: thresholds(tier.tier) for tier in judged}
    channels = [channel for tier in judged for channel in tier.channels.values()]
    known, usual = [channel.u is not None for channel in channels], thresholds()
    text = _DEFINITION.render(
        tight="tight" in tiers,
        uncertain=any(known),
        fixed=not all(known),
        safety=f"{SAFETY_FACTOR:g}",
        perturbation=number(PERTURBATION, 1),
        window=f"{WINDOW:.0%}",
        safety_in_order=f"{SAFETY_FACTOR_IN_ORDER:g}",
        alpha=_by_tier({name: f"{limits.alpha:g}" for name, limits in tiers.items()}),
        floor=_by_tier({name: f"{limits.coverage:.0%}" for name, limits in tiers.items()}),
        k=f"{usual.k:g}",
        share=f"{usual.share:.0%}",
        other_members=OTHER_MEMBERS,
        members=MEMBERS["reference"],
        ensemble_factor=f"{ENSEMBLE_FACTOR:g}",
        enough=ENOUGH,
        attributed=any(tier.attribution.cause for tier in judged),
        late=[quantity(time, "s") for time in dict.fromkeys(c.time_tolerance for c in channels) if time],
        limits=", ".join(dict.fromkeys(f"{of.metric} {bound(of)}" for c in channels for of in c.checks)),
    )
    return [" ".join(part.split("\n")) for part in re.split("\n\n+", text.strip()) if part]


def ratio_name(scenes: Sequence[SceneComparison]) -> str:
    """Return the name of the ratio that these verdicts rest on."""
    channels = (c.ratio_name for scene in scenes for tier in scene.tiers for c in tier.channels.values())
    limits = thresholds()
    return next(channels, f"|E|/{limits.k:g}u ({100 * limits.share:g}%)")


def _by_tier(numbers: Mapping[str, str]) -> str:
    """Return "0.01 (standard tier) or 5e-05 (tight tier)"; for a single tier the number alone."""
    if len(numbers) < 2:
        return next(iter(numbers.values()), "")
    return " or ".join(f"{text} ({tier} tier)" for tier, text in numbers.items())
