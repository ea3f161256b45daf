"""Verdicts of scenes as lines of a terminal: one a scene and tier, and on demand their reasons."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite

from comparison.cli.console import coloured, columns, wrapped
from comparison.formatting import MISSING, NO_BREAK, number, percent
from comparison.verdict.results import SceneComparison
from comparison.words.cards import ratio_name
from comparison.words.verdicts import mark, reason, reasons

_COVERAGE, _RATIO = 3, 4


def verdict_lines(comparisons: Sequence[SceneComparison], *, verbose: bool = False) -> list[str]:
    """Return one line per scene and tier, below a heading; with their reasons below each if verbose.

    The columns are the verdict, the share of predictable samples, the ratio of the decisive channel, and
    where the trajectories diverge, or what is missing.
    """
    tiers = [(scene.name, tier) for scene in comparisons for tier in scene.tiers]
    headings = ("scene", "tier", "verdict", "coverage", ratio_name(comparisons), "")
    rows = [
        (
            name,
            tier.tier,
            tier.verdict,
            percent(tier.coverage).replace(NO_BREAK, " "),
            MISSING if tier.decisive is None else number(tier.decisive.ratio, 2),
            _note(tier),
        )
        for name, tier in tiers
    ]
    heading, *lines = columns(
        [headings, *rows], right=(_COVERAGE, _RATIO), paint={2: lambda cell: coloured(cell, cell)}
    )
    shown = [heading]
    for line, (_, tier) in zip(lines, tiers, strict=True):
        shown.append(line)
        for topic, text in reasons(tier) if verbose else ():
            shown += wrapped(text, first=f"    {topic:<12}  ")
    return shown


def channel_lines(comparison: SceneComparison) -> list[str]:
    """Return one line per channel: verdict, largest difference, coverage, samples outside, RMS."""
    heading = ("channel", "verdict", "max", "unit", "max/scale", "coverage", "outside", "rms", "rms/scale")
    rows = [
        (
            channel.channel,
            channel.verdict,
            f"{channel.max_difference:.3g}",
            channel.unit,
            f"{channel.max_scaled:.3g}",
            f"{channel.coverage:.1%}",
            str(channel.outside) if isfinite(channel.worst_threshold) else "",
            f"{channel.rms_difference:.3g}",
            f"{channel.rms_scaled:.3g}",
        )
        for channel in comparison.channels.values()
    ]
    return columns([heading, *rows], right=(2, 4, 5, 6, 7, 8), paint={1: lambda cell: coloured(cell, cell)})


def _note(tier: SceneComparison) -> str:
    """Return in a few words where the trajectories diverge, or what is missing."""
    if tier.error:
        return tier.error
    notes = []
    if tier.verdict == "differ" and tier.attribution.outside_in:
        notes.append(f"{tier.attribution.outside_in} from {tier.attribution.outside_from:.3f} s")
    notes.append(mark(tier))
    if tier.verdict == "indeterminate" and (worst := tier.worst_channel) is not None:
        notes.append(f"{worst.channel}: {reason(worst)}")
    return "; ".join(filter(None, notes))
