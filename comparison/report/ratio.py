"""Difference over its threshold, |E| / 2u, as the one number of a channel or a scene at one tier."""

from __future__ import annotations

from math import nan

import numpy as np

from comparison.agreement.results import ChannelComparison, SceneComparison
from comparison.report import rule


def deciding_ratio(channel: ChannelComparison) -> float:
    """Return the ratio |difference| / threshold that the required share of the judged samples stays within.

    At most 1 exactly where the channel agrees; nan where nothing was judged.
    """
    threshold, _ = rule.threshold(channel)
    if threshold is None or channel.verdict not in {"agree", "differ"}:
        return nan
    judged = channel.predictable & ((channel.a != 0) | (channel.b != 0))
    if np.isnan(channel.explained) or not judged.any():
        # A channel that differs by more than its largest uncertainty, without a predictable sample.
        return float(abs(channel.worst_difference) / channel.worst_threshold)
    ratios = np.abs(channel.difference[judged]) / np.maximum(threshold[judged], np.finfo(np.float64).tiny)
    return float(np.quantile(ratios, channel.limits.share, method="inverted_cdf"))


def deciding_channel(scene: SceneComparison) -> tuple[ChannelComparison | None, float]:
    """Return the judged channel with the largest ratio and this ratio; None and nan without one."""
    ratios = {name: deciding_ratio(channel) for name, channel in scene.channels.items()}
    known = {name: ratio for name, ratio in ratios.items() if not np.isnan(ratio)}
    if not known:
        return None, nan
    name = max(known, key=lambda name: known[name])
    return scene.channels[name], known[name]
