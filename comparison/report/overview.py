"""Overview of the report: scenes by tiers, and on demand by channels, as grids of ratios and coverage."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from comparison.formatting import MISSING, number, percent
from comparison.verdict.results import SceneComparison, rank
from comparison.words.verdicts import mark

MODELS = {
    "reference": "a hand-written solver of the paper's equations",
    "exudyn": "the same press, written independently as a multibody model in Exudyn",
}
"""What a built-in model is, for its label."""


def failing_first(comparisons: Sequence[SceneComparison]) -> list[SceneComparison]:
    """Return the scenes, the worst verdict first; equal ones in their order."""
    return sorted(comparisons, key=lambda scene: -rank(scene.worst_verdict))


def failing(comparisons: Sequence[SceneComparison], keys: Sequence[str]) -> list[dict[str, str]]:
    """Return name, tier, verdict and link target of every scene and tier that does not agree."""
    return [
        {"name": scene.name, "tier": tier.tier, "verdict": tier.verdict, "key": f"{key}-{tier.tier}"}
        for scene, key in zip(comparisons, keys, strict=True)
        for tier in scene.tiers
        if rank(tier.verdict) > rank("agree")
    ]


def tiers(comparisons: Sequence[SceneComparison]) -> list[str]:
    """Return the tiers that occur, in their order."""
    return list(dict.fromkeys(tier.tier for scene in comparisons for tier in scene.tiers))


def grid(comparisons: Sequence[SceneComparison], keys: Sequence[str]) -> list[dict[str, Any]]:
    """Return one row per scene with a cell for each of the `tiers`; None where one was not run.

    Parameters
    ----------
    comparisons, keys
        Scenes in display order and the prefixes of their ids.
    """
    columns = tiers(comparisons)
    rows = []
    for scene, key in zip(comparisons, keys, strict=True):
        judged = {tier.tier: tier for tier in scene.tiers}
        cells = [_cell(judged[tier], f"{key}-{tier}") if tier in judged else None for tier in columns]
        rows.append({"key": key, "name": scene.name, "title": scene.title, "cells": cells})
    return rows


def channel_grid(comparisons: Sequence[SceneComparison], keys: Sequence[str]) -> dict[str, Any]:
    """Return names of all channels, and one row per scene and tier with a cell for each of them."""
    names = list(
        dict.fromkeys(name for scene in comparisons for tier in scene.tiers for name in tier.channels)
    )
    rows = []
    for scene, key in zip(comparisons, keys, strict=True):
        for tier in scene.tiers:
            cells = []
            for name in names:
                channel = tier.channels.get(name)
                ratio = MISSING if channel is None else number(channel.ratio, 2)
                verdict = "" if channel is None else channel.verdict
                cells.append({"verdict": verdict, "ratio": "" if ratio == MISSING else ratio})
            if tier.channels:
                rows.append(
                    {"key": f"{key}-{tier.tier}", "name": scene.name, "tier": tier.tier, "cells": cells}
                )
    return {"names": names, "rows": rows}


def models(comparisons: Sequence[SceneComparison]) -> list[dict[str, str]]:
    """Return each label with what it is, one sentence, and the formulations and versions it ran with."""
    found = []
    for label in dict.fromkeys(label for scene in comparisons for label in scene.labels):
        ran = [
            run
            for scene in comparisons
            for tier in scene.tiers
            for name, run in tier.provenance.items()
            if name == label
        ]
        forms = list(dict.fromkeys(str(run["formulation"]) for run in ran if run.get("formulation")))
        versions: dict[str, str] = next((run["versions"] for run in ran if run.get("versions")), {})
        own = {name: versions[name] for name in (label, "sixbar-crossval") if name in versions}
        found.append(
            {
                "label": label,
                "what": MODELS.get(label, ""),
                "ran": "; ".join(forms),
                "versions": ", ".join(f"{name} {version}" for name, version in own.items()),
            }
        )
    return found


def _cell(tier: SceneComparison, key: str) -> dict[str, Any]:
    channel = tier.decisive
    coverage = tier.coverage
    return {
        "key": key,
        "verdict": tier.verdict,
        "ratio": "" if channel is None else number(channel.ratio, 2),
        "channel": "" if channel is None else channel.channel,
        "coverage": percent(coverage) if coverage == coverage else "",
        "share": round(100 * coverage) if coverage == coverage else 0,
        "mark": mark(tier),
    }
