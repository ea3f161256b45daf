"""The verdict card of a scene, and the definition of the verdicts, for pages."""

import re
from collections.abc import Sequence
from importlib.resources import files
from math import isnan
from typing import NamedTuple

import jinja2

from comparison.accuracy import uncertainty
from comparison.accuracy.levels import thresholds
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


class Card(NamedTuple):
    """Texts of a card: one plain sentence, the observed orders, what to do next."""

    sentence: str
    order: str
    advice: str
    commands: tuple[str, ...]


def card(scene: SceneComparison) -> Card:
    """Return the card of a scene at one tier."""
    order = ", ".join(
        f"{change.label} {number(change.observed, 2)} (expected {change.order:g})"
        for change in scene.attribution.refinements
        if not isnan(change.observed)
    )
    return Card(f"{_sentence(scene)}.", order, *_next(scene))


def _sentence(scene: SceneComparison) -> str:
    result, channel, confirmed = scene.confirmation, scene.decisive, ""
    if result is not None and result.outcome == "underestimated":
        factor = number(result.factor, 2)
        confirmed = f"; the uncertainty had been underestimated {factor} times and is corrected"
    elif result is not None:
        confirmed = f"; {mark(scene)}"
    if scene.verdict == "indeterminate":
        worst = scene.worst_channel
        if worst is None or isnan(scene.coverage) or scene.unsettled:
            return f"Not decided: {scene_reason(scene)}"
        text = f"Not decided: {percent(scene.coverage)} of the samples are predictable, at least "
        text += f"{worst.limits.coverage:.0%} are required"
        if any(channel.coverage > worst.coverage for channel in scene.excited.values()):
            text += f"; least of all {worst.label} ({percent(worst.coverage)})"
        return text + confirmed
    if channel is None:
        return scene_reason(scene)
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
    if scene.refined and result is None:
        text += f", of finer runs ({mark(scene)})"
    return text + confirmed


def _chatter(scene: SceneComparison, time: float) -> str:
    """Return ", just after chatter (7 contacts in the 20 ms before)"; empty where there was none."""
    table = next((events for events in scene.events if events is not None), None)
    if table is None or scene.period is None:
        return ""
    before = _CHATTER * scene.period
    count = int(((table["start"] > time - before) & (table["start"] <= time)).sum())
    lately = f", just after chatter ({count} contacts in the {quantity(before, 's', 2)} before)"
    return lately if count >= _MANY else ""


def _next(scene: SceneComparison) -> tuple[str, tuple[str, ...]]:
    """Return what to do next, and the commands for it; the latter empty where there is nothing to do."""
    closer, ran = scene.closer_command, scene.ran
    if scene.verdict == "indeterminate" and closer:
        tables = "State the difference that is allowed, as a share of each scale:"
        return tables if ran is None else "See whether finer settings decide it:", (closer,)
    if ran is None or scene.verdict == "indeterminate":
        return "", ()
    if scene.verdict == "cannot compare":
        if scene.failed is None:
            again = (scene.command,) if scene.command else ()
            return "Run the scene again once the cause is removed:", again
        repeated = _run(scene, scene.failed.scene, scene.failed.model)
        return "Repeat the run that failed, alone:", (repeated,)
    if scene.verdict == "differ":
        return "Find which model errs, by a third opinion:", _third_opinion(scene, ran)
    if scene.confirmation is not None and scene.confirmation.suspicious:
        what = "A discontinuous event decides"
        return (f"{what}; look at it at finer settings:", (closer,)) if closer else (f"{what}.", ())
    return "Nothing to do.", ()


def _third_opinion(scene: SceneComparison, ran: Scene) -> tuple[str, ...]:
    """Return commands that run another formulation of one model and compare it with the reference."""
    model, formulation = "exudyn", "full"
    if ran.data["solver"]["exudyn"]["formulation"] == "full":
        # The reference's multipliers are for an ideal crank pin.
        ideal = ran.data["joints"]["crank_pin"] == "ideal"
        model, formulation = ("reference", "multiplier") if ideal else ("exudyn", "tree")
    host = scene.labels[1] if model == "reference" else scene.labels[0]
    third = ran.variant({f"solver.{model}.formulation": formulation})
    files = [f"{scene.name}-{which}.csv" for which in (host, formulation)]
    return (
        _run(scene, third, model, formulation),
        _run(scene, ran, host),
        command_line("compare", files, {}),
    )


def _run(scene: SceneComparison, ran: Scene, model: str, what: str = "") -> str:
    """Return the command of one run."""
    return ran.command("run", "--model", model, "--out", f"{scene.name}-{what or model}.csv")


def definition(scenes: Sequence[SceneComparison]) -> list[str]:
    """Return the definition of the verdicts of these scenes, one step per line."""
    judged = [tier for scene in scenes for tier in scene.tiers]
    channels = [channel for tier in judged for channel in tier.channels.values()]
    text = _DEFINITION.render(
        u=uncertainty,
        usual=thresholds(),
        tiers={tier.tier: thresholds(tier.tier) for tier in judged},
        uncertain=any(channel.u is not None for channel in channels),
        fixed=any(channel.u is None for channel in channels),
        perturbation=number(uncertainty.PERTURBATION, 1),
        other_members=OTHER_MEMBERS,
        members=MEMBERS["reference"],
        enough=ENOUGH,
        attributed=any(tier.attribution.cause for tier in judged),
        late=[quantity(time, "s") for time in dict.fromkeys(c.time_tolerance for c in channels) if time],
        limits=", ".join(
            dict.fromkeys(f"{check.metric} {bound(check)}" for c in channels for check in c.checks)
        ),
    )
    return [" ".join(part.split("\n")) for part in re.split("\n\n+", text.strip()) if part]


def ratio_name(scenes: Sequence[SceneComparison]) -> str:
    """Return the name of the ratio that these verdicts rest on."""
    channels = (c.ratio_name for scene in scenes for tier in scene.tiers for c in tier.channels.values())
    limits = thresholds()
    return next(channels, f"|E|/{limits.k:g}u ({100 * limits.share:g}%)")
