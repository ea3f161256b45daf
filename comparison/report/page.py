"""The report: one self-contained HTML file of the verdict, the worst channel, an overview and the scenes."""

from __future__ import annotations

from collections.abc import Sequence
from math import isnan
from pathlib import Path
from typing import Any

from comparison.files import write_text
from comparison.formatting import MISSING, number, percent, quantity
from comparison.metrics.contacts import WINDOW
from comparison.reliability.difference import MARGIN
from comparison.report import tables
from comparison.report.figures import channel_figure
from comparison.report.plots import is_derived, scene_plots
from comparison.report.schematic import schematic
from comparison.report.templates import Origin, interactive_page
from comparison.verdict.results import ChannelComparison, SceneComparison, rank
from comparison.words import cards, differences, verdicts
from comparison.words.reliability import notes

_BUILT_IN = {
    "reference": "a hand-written solver of the paper's equations",
    "exudyn": "the same press, written independently as a multibody model in Exudyn",
}
"""What a built-in model is, for its label."""


def write_report(
    comparisons: Sequence[SceneComparison],
    out: Path,
    *,
    title: str,
    command: str,
    origin: Origin | None = None,
) -> Path:
    """Write ``report.html`` of scenes into a folder; equal arguments give identical bytes.

    ``command`` reproduces the whole report; where it comes from is stated if it is given.
    """
    path = out / "report.html"
    write_text(render(comparisons, title=title, command=command, origin=origin), path)
    return path


def render(
    comparisons: Sequence[SceneComparison], *, title: str, command: str, origin: Origin | None = None
) -> str:
    """Return the page as text; see `write_report`."""
    # Equally severe scenes stay in their order.
    ordered = sorted(comparisons, key=lambda scene: -rank(scene.worst_verdict))
    judged = [tier for scene in ordered for tier in scene.tiers]
    channels = [channel for tier in judged for channel in tier.channels.values()]
    of_tables = bool(ordered) and all(scene.ran is None and scene.failed is None for scene in ordered)
    if of_tables and len(ordered) == 1 and not all(label in title for label in ordered[0].labels):
        title = f"{' and '.join(ordered[0].labels)}: {title[0].lower()}{title[1:]}"
    # What decides: "uncertainty", "tolerance" or "" where nothing does.
    threshold = "tolerance" if any(channel.threshold is not None for channel in channels) else ""
    limits = [verdicts.threshold_name(channel) for channel in channels if channel.u is not None]
    scenes = [_scene(scene, f"s{n}") for n, scene in enumerate(ordered)]
    cells = [cell for scene in scenes for cell in scene["tiers"]]
    if len(ordered) == 1:  # of many they would be most of the page; summary.json has them
        scenes[0]["information"] = tables.information_table(ordered[0])
    return interactive_page(
        "report.html.j2",
        title=title,
        command=command,
        verdict_of_all=verdicts.overall_verdict(comparisons),
        headline=verdicts.headline(comparisons),
        failing=[cell for cell in cells if rank(cell["of"].verdict) > rank("agree")],
        worst=_worst(cells),
        tiers=list(dict.fromkeys(tier.tier for tier in judged)),
        ratio=cards.ratio_name(comparisons),
        threshold="uncertainty" if limits else threshold,
        limit=limits[0] if limits else "",
        of_tables=of_tables,
        gated=any(channel.checks for channel in channels),
        models=_models(judged),
        origin=origin,
        scenes=scenes,
        channel_names=list(dict.fromkeys(channel.channel for channel in channels)),
        reliability=any(tier.reliability for tier in judged),
        margin=MARGIN,
        definition=cards.definition(comparisons),
        ratio_of=_ratio,
        percent_of=lambda share, error=0.0: "" if isnan(share) else percent(share, error),
        tables=tables,
        verdicts=verdicts,
        differences=differences,
        notes=notes,
    )


def _ratio(channel: ChannelComparison | None) -> str:
    return "" if channel is None or isnan(channel.ratio) else number(channel.ratio, 2)


def _worst(cells: Sequence[dict[str, Any]]) -> dict[str, Any] | None:
    """Return the channel nearest to its limit, or farthest beyond it, of the tier with the worst verdict.

    None where no channel was judged.
    """
    drawn = [(cell, channel) for cell in cells if (channel := _drawn(cell["of"])) is not None]
    if not drawn:
        return None

    def severity(item: tuple[dict[str, Any], ChannelComparison]) -> tuple[int, float]:
        return rank(item[0]["of"].verdict), -1.0 if isnan(item[1].ratio) else item[1].ratio

    cell, channel = max(drawn, key=severity)
    return cell | _figure(cell["of"], channel, "worst")


def _drawn(tier: SceneComparison) -> ChannelComparison | None:
    """Return the channel to be drawn of a scene: that which decides, else the first that was excited."""
    excited = (channel for channel in tier.channels.values() if channel.verdict != "unexcited")
    return tier.worst_channel or next(excited, None)


def _figure(tier: SceneComparison, channel: ChannelComparison, key: str) -> dict[str, Any]:
    sign = channel.definition.sign
    heading = f"{channel.label} ({sign})" if sign else channel.label
    drawing = channel_figure(tier, channel, key)
    return {"tier": tier.tier, "channel": channel, "labels": tier.labels, "heading": heading, "svg": drawing}


def _scene(scene: SceneComparison, key: str) -> dict[str, Any]:
    """Return a scene with what is derived from it for the template; ``key`` is the prefix of its ids."""
    # The tier with the worst verdict first.
    plotted = sorted(scene.tiers, key=lambda tier: -rank(tier.verdict))
    plots = [{"tier": tier.tier, "text": text} for tier in plotted if (text := scene_plots(tier))]
    drawn = [(tier, channel) for tier in plotted if (channel := _drawn(tier)) is not None]
    contacts = tables.contact_table(scene)
    without_contact = all(events is not None and events.empty for events in scene.events)
    sections = {
        "plots": ("Plots", plots),
        f"{scene.tier}-why": ("Why", True),
        f"{scene.tier}-channels": ("Channels", scene.channels),
        "contacts": ("Contacts", contacts or without_contact),
        "reliability": ("Reliability", any(tier.reliability for tier in scene.tiers)),
        "runs": ("Runs", any(tier.provenance for tier in scene.tiers)),
    }
    channels = scene.channels.items()
    return {
        "of": scene,
        "key": key,
        "sections": [(id_, name) for id_, (name, there) in sections.items() if there],
        "schematic": schematic(scene.scene),
        "plots": plots,
        "figure": _figure(*drawn[0], key) if drawn else None,
        "tiers": [_tier(tier, scene.name, f"{key}-{tier.tier}") for tier in scene.tiers],
        "derived": ", ".join(name for name, channel in channels if is_derived(channel)),
        "unexcited": ", ".join(name for name, channel in channels if channel.verdict == "unexcited"),
        "without_contact": without_contact,
        "contacts": contacts,
        "impacts": tables.impact_table(scene) if contacts is not None else None,
        "impact_window": quantity(WINDOW * scene.period, "s") if scene.period else MISSING,
        "information": None,
    }


def _tier(tier: SceneComparison, name: str, key: str) -> dict[str, Any]:
    """Return a scene at one tier with what its card and table need."""
    card = cards.card(tier)
    facts = {
        "Predictable": percent(tier.coverage, tier.coverage_error),
        "Of these explained": percent(tier.attribution.explained),
        "Order of convergence": card.order,
    }
    reasons = {
        name: verdicts.reason(channel)
        for name, channel in tier.channels.items()
        if channel.verdict not in {"agree", "unexcited"}
    }
    return {
        "of": tier,
        "name": name,
        "key": key,
        "card": card,
        "facts": {fact: value for fact, value in facts.items() if value not in {"", MISSING}},
        "open": reasons,
    }


def _models(tiers: Sequence[SceneComparison]) -> dict[str, str]:
    """Return of each label what it is, and the formulations and versions it ran with."""
    models = {}
    for label in dict.fromkeys(label for tier in tiers for label in tier.labels):
        runs = [tier.provenance[label] for tier in tiers if label in tier.provenance]
        formulations = dict.fromkeys(str(run["formulation"]) for run in runs if run.get("formulation"))
        versions: dict[str, str] = next((run["versions"] for run in runs if run.get("versions")), {})
        own = [f"{name} {versions[name]}" for name in (label, "sixbar-crossval") if name in versions]
        parts = [_BUILT_IN.get(label, ""), "; ".join(formulations), ", ".join(own)]
        models[label] = "; ".join(part for part in parts if part)
    return {label: words for label, words in models.items() if words}
