"""The verdict card of a scene, and the definition of the verdicts, for pages."""

import re
from collections.abc import Sequence
from importlib.resources import files
from math import isnan
from typing import NamedTuple

import jinja2

from comparison.accuracy import uncertainty
from comparison.accuracy.levels import thresholds
from comparison.formatting import number, quantity
from comparison.scene import Scene, command_line
from comparison.verdict.confirmation import ENOUGH, MEMBERS, OTHER_MEMBERS
from comparison.verdict.results import SceneComparison
from comparison.words.verdicts import bound, mark, scene_reason

_DEFINITION = jinja2.Template(
    files("comparison.words").joinpath("definition.j2").read_text("utf-8"),
    undefined=jinja2.StrictUndefined,
    trim_blocks=True,
    lstrip_blocks=True,
)


class Card(NamedTuple):
    """Texts of a card: the reason of the verdict, the observed orders, what to do next."""

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
    sentence = "; ".join(filter(None, (scene_reason(scene, brief=True), mark(scene))))
    return Card(f"{sentence}.", order, *_next(scene))


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
        failed = scene.failed
        return "Repeat the run that failed, alone:", (_run(failed.scene, failed.model, scene.name),)
    if scene.verdict == "differ":
        return "Find which model errs, by a third opinion:", _third_opinion(scene, ran)
    if scene.confirmation is not None and scene.confirmation.suspicious:
        what = "A discontinuous event decides"
        return (f"{what}; look at it at finer settings:", (closer,)) if closer else (f"{what}.", ())
    return "Nothing to do.", ()


def _third_opinion(scene: SceneComparison, ran: Scene) -> tuple[str, ...]:
    """Return commands that run another formulation of one model and compare it with the reference."""
    model, formulation, host = "exudyn", "full", scene.labels[0]
    if ran.data["solver"]["exudyn"]["formulation"] == "full":
        formulation = "tree"
        if ran.data["joints"]["crank_pin"] == "ideal":  # as the reference's multipliers need it
            model, formulation, host = "reference", "multiplier", scene.labels[1]
    third = ran.variant({f"solver.{model}.formulation": formulation})
    compare = command_line("compare", [f"{scene.name}-{which}.csv" for which in (host, formulation)], {})
    return _run(third, model, scene.name, formulation), _run(ran, host, scene.name), compare


def _run(scene: Scene, model: str, name: str, what: str = "") -> str:
    return scene.command("run", "--model", model, "--out", f"{name}-{what or model}.csv")


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
