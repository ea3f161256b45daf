"""The report: one self-contained HTML file of the verdict, the worst channel, an overview and the scenes."""

from collections.abc import Mapping, Sequence
from math import isnan
from typing import Any

from comparison.formatting import number, percent
from comparison.metrics.contacts import WINDOW
from comparison.reliability.assessment import MARGIN
from comparison.report import tables
from comparison.report.figures import channel_figure
from comparison.report.plots import independent, scene_plots, shown
from comparison.report.schematic import schematic
from comparison.report.templates import interactive_page
from comparison.verdict.results import ChannelComparison, SceneComparison, rank
from comparison.words import differences, verdicts
from comparison.words.reliability import notes

_BUILT_IN = {
    "reference": "a hand-written solver of the paper's equations",
    "exudyn": "the same press, written independently as a multibody model in Exudyn",
}
"""What a built-in model is, for its label."""


def render(
    comparisons: Sequence[SceneComparison],
    *,
    title: str,
    command: str,
    origin: Mapping[str, str] | None = None,
) -> str:
    """Return the page of scenes, which ``command`` reproduces; equal arguments give identical text."""
    # Equally severe scenes stay in their order.
    scenes = sorted(comparisons, key=lambda scene: -rank(scene.worst_verdict))
    cells = [(scene, tier, f"s{n}-{tier.tier}") for n, scene in enumerate(scenes) for tier in scene.tiers]
    judged = [tier for _, tier, _ in cells]
    channels = [channel for tier in judged for channel in tier.channels.values()]
    of_tables = bool(scenes) and all(scene.ran is None and scene.failed is None for scene in scenes)
    if of_tables and len(scenes) == 1 and not all(label in title for label in scenes[0].labels):
        title = f"{' and '.join(scenes[0].labels)}: {title[0].lower()}{title[1:]}"
    # What decides: "uncertainty", "tolerance" or "" where nothing does.
    threshold = "tolerance" if any(channel.threshold is not None for channel in channels) else ""
    limits = [verdicts.threshold_name(channel) for channel in channels if channel.u is not None]

    def severity(figure: tuple[Any, SceneComparison, str, ChannelComparison]) -> tuple[int, bool, float]:
        return rank(figure[1].verdict), not isnan(figure[3].ratio), figure[3].ratio

    # The channel nearest to its limit, or farthest beyond it, of the tier with the worst verdict.
    figures = [(*cell, channel) for cell in cells if (channel := _drawn(cell[1])) is not None]
    return interactive_page(
        "report.html.j2",
        title=title,
        command=command,
        origin=origin,
        scenes=scenes,
        cells=cells,
        failing=[cell for cell in cells if rank(cell[1].verdict) > rank("agree")],
        worst=max(figures, key=severity, default=None),
        verdict_of_all=verdicts.overall_verdict(comparisons),
        headline=verdicts.headline(comparisons),
        tiers=list(dict.fromkeys(tier.tier for tier in judged)),
        ratio=verdicts.ratio_name(comparisons),
        threshold="uncertainty" if limits else threshold,
        limit=limits[0] if limits else "",
        of_tables=of_tables,
        gated=any(channel.checks for channel in channels),
        models=_models(judged),
        channel_names=list(dict.fromkeys(channel.channel for channel in channels)),
        reliability=any(tier.reliability for tier in judged),
        margin=MARGIN,
        impact_window=WINDOW,
        definition=verdicts.definition(comparisons),
        ratio_of=lambda channel: "" if channel is None or isnan(channel.ratio) else number(channel.ratio, 2),
        percent_of=lambda share: "" if isnan(share) else percent(share),
        card_of=verdicts.card,
        channel_figure=channel_figure,
        schematic=schematic,
        by_severity=lambda scene: sorted(scene.tiers, key=lambda tier: -rank(tier.verdict)),
        plots_of=lambda tiers: [(tier.tier, text) for tier in tiers if (text := scene_plots(tier))],
        drawn=_drawn,
        independent=independent,
        sections=_sections,
        without_contact=_without_contact,
        tables=tables,
        verdicts=verdicts,
        differences=differences,
        notes=notes,
    )


def _drawn(tier: SceneComparison) -> ChannelComparison | None:
    """Return the channel to be drawn of a scene: that which decides, else the first that was excited."""
    return tier.worst_channel or next(iter(tier.excited.values()), None)


def _without_contact(scene: SceneComparison) -> bool:
    return all(events is not None and events.empty for events in scene.events)


def _sections(scene: SceneComparison) -> list[tuple[str, str]]:
    """Return the ids and names of what there is of a scene."""
    sections = {
        "plots": ("Plots", any(map(shown, scene.tiers))),
        f"{scene.tier}-why": ("Why", True),
        f"{scene.tier}-channels": ("Channels", scene.channels),
        "contacts": ("Contacts", tables.contact_table(scene) or _without_contact(scene)),
        "reliability": ("Reliability", any(tier.reliability for tier in scene.tiers)),
        "runs": ("Runs", any(tier.provenance for tier in scene.tiers)),
    }
    return [(id_, name) for id_, (name, there) in sections.items() if there]


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
