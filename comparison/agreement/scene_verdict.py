"""Verdict of two results for a scene, from those of its channels (`comparison.agreement.verdict`)."""

from __future__ import annotations

from collections.abc import Mapping
from math import floor as floor_of

from comparison.agreement.results import ChannelComparison, scene_coverage


def scene_verdict(results: Mapping[str, ChannelComparison], floor: float) -> tuple[str, str]:
    """Verdict of a scene and its reason, by the rule of a channel applied to all excited ones together.

    One channel that differs makes the scene differ. Else its coverage
    (`comparison.agreement.results.scene_coverage`) is held against the same floor as a channel's. Channels
    that are by themselves indeterminate are named in the reason. A scene without an excited channel is
    indeterminate: nothing was compared.

    Parameters
    ----------
    results
        The channels.
    floor
        Smallest coverage, `Thresholds.coverage`.
    """
    excited = [result for result in results.values() if result.verdict != "unexcited"]
    if not excited:
        return "indeterminate", "no channel is excited: nothing was compared"
    if differing := [result for result in excited if result.verdict == "differ"]:
        worst = max(differing, key=lambda result: result.excess)
        return (
            "differ",
            f"{len(differing)} of {len(excited)} channels differ, most of all {worst.channel}: "
            f"{worst.reason}",
        )
    unsettled = [result for result in excited if result.verdict == "indeterminate"]
    agreeing = [result for result in excited if result.verdict == "agree"]
    coverage = scene_coverage(results)
    if not agreeing or coverage < floor:
        worst = min(unsettled, key=lambda result: result.coverage)
        return (
            "indeterminate",
            f"{len(unsettled)} of {len(excited)} channels are indeterminate, most of all {worst.channel}: "
            f"{worst.reason}",
        )
    worst = min(agreeing, key=lambda result: result.explained)
    reason = f"{len(agreeing)} of {len(excited)} excited channels agree, least of all {worst.channel}: "
    # Cut off, as in the tables, where the same number stands.
    reason += f"{worst.reason}; {floor_of(1e4 * coverage) / 1e4:.2%} of all samples are predictable"
    if unsettled:
        names = ", ".join(f"{result.channel} ({result.reason})" for result in unsettled)
        reason += f"; indeterminate: {names}"
    return "agree", reason
