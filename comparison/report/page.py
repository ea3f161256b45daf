"""The report: one self-contained HTML file of the verdict, the worst channel, an overview and the scenes."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite, isnan
from pathlib import Path
from typing import Any

from comparison.formatting import MISSING, number, percent, quantity
from comparison.metrics.contacts import WINDOW
from comparison.reliability.difference import MARGIN
from comparison.report import tables
from comparison.report.figures import channel_figure
from comparison.report.plots import is_derived, scene_plots
from comparison.report.schematic import schematic
from comparison.report.templates import Origin, interactive_page, write_page
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
    """Write ``report.html`` into a folder and return its path.

    Parameters
    ----------
    comparisons
        Scenes, shown with the worst verdict first; they may have no channels ("cannot compare").
    out
        The folder, created if missing. An existing report is replaced once the new one is complete.
    title
        Heading of the page.
    command
        Command that reproduces the whole report.
    origin
        Of the report; None: not stated.

    Notes
    -----
    Equal arguments give identical bytes.
    """
    html = render(comparisons, title=title, command=command, origin=origin)
    return write_page(html, out / "report.html")


def render(
    comparisons: Sequence[SceneComparison],
    *,
    title: str,
    command: str,
    origin: Origin | None = None,
) -> str:
    """Return the page as text; see `write_report`."""
    # Equally severe scenes stay in their order.
    ordered = sorted(comparisons, key=lambda scene: -rank(scene.worst_verdict))
    tiers = list(dict.fromkeys(tier.tier for scene in ordered for tier in scene.tiers))
    channels = [c for scene in ordered for tier in scene.tiers for c in tier.channels.values()]
    of_tables = bool(ordered) and all(scene.ran is None and scene.failed is None for scene in ordered)
    if of_tables and len(ordered) == 1 and not all(label in title for label in ordered[0].labels):
        title = f"{' and '.join(ordered[0].labels)}: {title[0].lower()}{title[1:]}"
    judged = [tier for scene in ordered for tier in scene.tiers]
    scenes = [_scene(scene, f"s{n}") for n, scene in enumerate(ordered)]
    if len(ordered) == 1:  # of many they would be most of the page; summary.json has them
        scenes[0]["information"] = tables.information_table(ordered[0])
    return interactive_page(
        "report.html.j2",
        title=title,
        command=command,
        verdict_of_all=verdicts.overall_verdict(comparisons),
        headline=verdicts.headline(comparisons),
        failing=[
            {"name": scene.name, "tier": tier.tier, "verdict": tier.verdict, "key": f"s{n}-{tier.tier}"}
            for n, scene in enumerate(ordered)
            for tier in scene.tiers
            if rank(tier.verdict) > rank("agree")
        ],
        worst=_worst(ordered),
        tiers=tiers,
        ratio=cards.ratio_name(comparisons),
        threshold=_threshold(channels),
        limit=next((verdicts.threshold_name(c) for c in channels if c.u is not None), ""),
        of_tables=of_tables,
        gated=any(channel.checks for channel in channels),
        models=_models(judged),
        origin=origin,
        scenes=scenes,
        channel_names=list(dict.fromkeys(channel.channel for channel in channels)),
        reliability=any(scene["reliability"] for scene in scenes),
        margin=MARGIN,
        definition=cards.definition(comparisons),
    )


def _threshold(channels: Sequence[ChannelComparison]) -> str:
    """Return what decides on a page, "uncertainty", "tolerance" or "" where nothing does."""
    if any(channel.u is not None for channel in channels):
        return "uncertainty"
    return "tolerance" if any(channel.threshold is not None for channel in channels) else ""


def _worst(scenes: Sequence[SceneComparison]) -> dict[str, Any] | None:
    """Return the channel nearest to its limit, or farthest beyond it, of the tier with the worst verdict.

    None where no channel was judged.
    """
    drawn = [
        (tier, channel, f"s{n}-{tier.tier}")
        for n, scene in enumerate(scenes)
        for tier in scene.tiers
        if (channel := _drawn(tier)) is not None
    ]
    if not drawn:
        return None
    tier, channel, key = max(
        drawn, key=lambda item: (rank(item[0].verdict), -1.0 if isnan(item[1].ratio) else item[1].ratio)
    )
    return {
        "key": key,
        "scene": tier.name,
        "tier": tier.tier,
        "ratio": number(channel.ratio, 2),
        "figure": _figure(tier, channel, "worst"),
    }


def _drawn(tier: SceneComparison) -> ChannelComparison | None:
    """Return the channel to be drawn of a scene: that which decides, else the first that was excited."""
    excited = [channel for channel in tier.channels.values() if channel.verdict != "unexcited"]
    return tier.worst_channel or next(iter(excited), None)


def _figure(tier: SceneComparison, channel: ChannelComparison, key: str) -> dict[str, Any]:
    sign = channel.definition.sign
    return {
        "svg": channel_figure(tier, channel, key),
        "heading": f"{channel.label} ({sign})" if sign else channel.label,
        "tier": tier.tier,
        "labels": tier.labels,
        "verdict": channel.verdict,
        "worst": f"{channel.worst_time:.4g} s" if isfinite(channel.worst_time) else "",
        "shaded": not channel.predictable.all(),
    }


def _scene(scene: SceneComparison, key: str) -> dict[str, Any]:
    """Return the template data of one scene; ``key`` is the prefix of its ids."""
    tiers = [_tier(tier, f"{key}-{tier.tier}") for tier in scene.tiers]
    # That with the worst verdict first.
    plotted = sorted(scene.tiers, key=lambda tier: -rank(tier.verdict))
    plots = [{"tier": tier.tier, "text": scene_plots(tier)} for tier in plotted]
    drawn = [(tier, channel) for tier in plotted if (channel := _drawn(tier)) is not None]
    contacts = tables.contact_table(scene)
    without_contact = all(events is not None and events.empty for events in scene.events)
    sections = {
        "plots": ("Plots", any(data["text"] for data in plots)),
        f"{scene.tier}-why": ("Why", True),
        f"{scene.tier}-channels": ("Channels", bool(scene.channels)),
        "contacts": ("Contacts", contacts is not None or without_contact),
        "reliability": ("Reliability", any(tier["reliability"] for tier in tiers)),
        "runs": ("Runs", any(tier["runs"] for tier in tiers)),
    }
    return {
        "key": key,
        "name": scene.name,
        "worst": scene.worst_verdict,
        "sections": [(id_, name) for id_, (name, there) in sections.items() if there],
        "title": scene.title,
        "description": scene.description,
        "labels": scene.labels,
        "shift": verdicts.shift_line(scene),
        "warnings": scene.warnings,
        "schematic": schematic(scene.scene),
        "plots": [data for data in plots if data["text"]],
        "figure": _figure(*drawn[0], key) if drawn else None,
        "tiers": tiers,
        "derived": ", ".join(name for name, channel in scene.channels.items() if is_derived(channel)),
        "unexcited": ", ".join(
            name for name, channel in scene.channels.items() if channel.verdict == "unexcited"
        ),
        "without_contact": without_contact,
        "contacts": contacts,
        "impacts": tables.impact_table(scene) if contacts is not None else None,
        "impact_window": quantity(WINDOW * scene.period, "s") if scene.period else MISSING,
        "situations": tables.situation_table(scene),
        "information": None,
        "reliability": any(tier["reliability"] for tier in tiers),
        "numbers": tables.scene_values(scene.scene),
        "command": scene.command,
    }


def _tier(tier: SceneComparison, key: str) -> dict[str, Any]:
    """Return the template data of a scene at one tier."""
    decisive, confirmation = tier.decisive, tier.confirmation
    card = cards.card(tier)
    facts = {
        "Predictable": percent(tier.coverage, tier.coverage_error),
        "Of these explained": percent(tier.attribution.explained),
        "Order of convergence": card.order,
    }
    return {
        "key": key,
        "tier": tier.tier,
        "verdict": tier.verdict,
        "ratio": "" if decisive is None else number(decisive.ratio, 2),
        "channel": "" if decisive is None else decisive.channel,
        "coverage": "" if isnan(tier.coverage) else percent(tier.coverage),
        "mark": verdicts.mark(tier),
        "card": card,
        "facts": {name: value for name, value in facts.items() if value not in {"", MISSING}},
        "confirmation": differences.confirmation(tier),
        "suspicious": confirmation is not None and confirmation.suspicious,
        "reason": verdicts.scene_reason(tier),
        "finer": verdicts.finer_runs(tier),
        "attribution": differences.attribution_lines(tier),
        "channels": tables.channel_table(tier) if tier.channels else None,
        "cells": {
            name: (channel.verdict, "" if isnan(channel.ratio) else number(channel.ratio, 2))
            for name, channel in tier.channels.items()
        },
        "open": tables.open_channels(tier),
        "runs": tables.run_rows(tier.provenance),
        "versions": tables.version_lines(tier.provenance),
        "reliability": None
        if tier.reliability is None
        else {
            "verdict": tier.reliability.verdict,
            "notes": notes(tier.reliability),
            "table": tables.reliability_table(tier),
        },
    }


def _models(tiers: Sequence[SceneComparison]) -> list[dict[str, str]]:
    """Return each label with what it is, and the formulations and versions it ran with."""
    models = []
    for label in dict.fromkeys(label for tier in tiers for label in tier.labels):
        runs = [tier.provenance[label] for tier in tiers if label in tier.provenance]
        formulations = dict.fromkeys(str(run["formulation"]) for run in runs if run.get("formulation"))
        versions: dict[str, str] = next((run["versions"] for run in runs if run.get("versions")), {})
        own = [f"{name} {versions[name]}" for name in (label, "sixbar-crossval") if name in versions]
        parts = [_BUILT_IN.get(label, ""), "; ".join(formulations), ", ".join(own)]
        models.append({"label": label, "words": "; ".join(part for part in parts if part)})
    return [model for model in models if model["words"]]
