"""Verdict of two results for a scene, from those of its channels (`comparison.agreement.verdict`)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import floor as floor_of

from comparison.agreement.results import ChannelComparison, decisive, scene_coverage
from comparison.formatting import number


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
        return (
            "differ",
            f"{len(differing)} of {len(excited)} channels differ, most of all {_named(differing)}",
        )
    unsettled = [result for result in excited if result.verdict == "indeterminate"]
    agreeing = [result for result in excited if result.verdict == "agree"]
    coverage = scene_coverage(results)
    if not agreeing or coverage < floor:
        worst = min(unsettled, key=lambda result: result.coverage)
        which = "" if len({result.reason for result in unsettled}) == 1 else f", most of all {worst.channel}"
        reason = f"{len(unsettled)} of {len(excited)} channels are indeterminate{which}: {worst.reason}"
        return "indeterminate", reason
    reason = (
        f"{len(agreeing)} of {len(excited)} excited channels agree, nearest to its limit {_named(agreeing)}"
    )
    # Cut off, as in the tables, where the same number stands.
    reason += f"; {floor_of(1e4 * coverage) / 1e4:.2%} of all samples are predictable"
    if unsettled:
        names = ", ".join(f"{result.channel} ({result.reason})" for result in unsettled)
        reason += f"; indeterminate: {names}"
    return "agree", reason


def _named(results: Sequence[ChannelComparison]) -> str:
    """Return which of the judged channels is the worst, and why."""
    worst = decisive(results)
    assert worst is not None
    return f"{worst.channel}, {worst.ratio_name} = {number(worst.ratio, 2)}: {worst.reason}"
