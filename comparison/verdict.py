"""What a comparison found: one channel, and a scene of channels.

The rule is that of verification and validation after ASME V&V 20-2009 (section 1): a difference
``E`` between two results is explained by their numerical uncertainty ``u`` where ``|E| <= k u``;
beyond it there is a difference of models. It is applied sample by sample, on the samples where the
uncertainty is small against what the channel means (the predictable ones).
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from importlib.resources import files
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from comparison.channels import CONTACTS, Channel, channels
from comparison.measures.impacts import Impacts, impacts_of
from comparison.measures.information import information
from comparison.measures.metrics import maximum, rms, scaled
from comparison.shift import Shift
from comparison.uncertainty import combined

Array = NDArray[np.float64]
BoolArray = NDArray[np.bool_]


@dataclass(frozen=True)
class Thresholds:
    """The fixed numbers of a tier, explained in ``thresholds.toml``."""

    k: float
    share: float
    alpha: float
    coverage: float


@dataclass(frozen=True)
class ChannelComparison:
    """One channel of two runs, on their common time grid of ``n`` samples."""

    channel: str
    label: str
    unit: str
    scale: float
    time: Array
    """s, shape (n,)."""
    a: Array
    b: Array
    difference: Array
    """a - b, shape (n,)."""
    u_a: Array | None
    u_b: Array | None
    u: Array | None
    """Numerical uncertainties of a, b and their difference, shape (n,); None where the tables carry none."""
    predictable: BoolArray
    """u <= alpha * scale; all True where u is None."""
    verdict: str
    """"agree", "differ", "indeterminate" or "unexcited"."""
    coverage: float
    """Share of predictable samples."""
    explained: float
    """Share of the predictable samples within k u, or the tolerance; nan if there is none of either."""
    max_difference: float
    rms_difference: float
    max_scaled: float
    rms_scaled: float
    """The four over all samples, predictable or not."""
    worst_time: float
    worst_difference: float
    worst_threshold: float
    """The predictable sample with the largest |E| / threshold; nan where there is none."""
    reason: str
    """One plain sentence."""
    limits: Thresholds
    """The numbers it was judged by."""

    @cached_property
    def metrics(self) -> Mapping[str, float]:
        """Measures of b against a that no verdict rests on; empty where unexcited: a constant has none.

        See `comparison.measures.information`. Made when first asked for: they cost more than the verdict.
        """
        if self.verdict == "unexcited":
            return {}
        position = channels()[self.channel].rate is not None
        return information(self.time, self.a, self.b, position=position)


@dataclass(frozen=True)
class Attribution:
    """Where the difference of a scene at one tier comes from; what cannot be told is nan or empty."""

    explained: float = float("nan")
    """Share of the judged samples of all excited channels together that are within k u."""
    cause: str = ""
    """"a" or "b" (whose refinement removes it), "both", "round-off", "neither" or "models"."""
    remaining: dict[str, float] = field(default_factory=dict)
    """What is left of its size where the run of "a", of "b" or of "both" is the refined one; 1: all of it."""
    channels: dict[str, dict[str, float]] = field(default_factory=dict)
    """The same by channel."""
    still_moves: dict[str, float] = field(default_factory=dict)
    """"a", "b": share of the samples beyond the band near which refinement moves the run by as much."""
    unpredictable: dict[str, float] = field(default_factory=dict)
    """Why the samples of the indeterminate channels are not predictable: share by the u of "a" alone, of "b"
    alone, of "each" by itself, of the two only "together"; and that of "neighbours" whose spread suffices."""
    unpredictable_from: float = float("nan")
    """First of the most frequent of these, s."""
    beyond_from: float = float("nan")
    """First judged sample beyond the band or the tolerance, s; of the channels that differ, if any does."""
    beyond_in: str = ""
    """Its channel."""
    sentences: tuple[str, ...] = ()
    """All this in plain words."""


@dataclass(frozen=True)
class SceneComparison:
    """All channels of one scene, with what is needed to read and to repeat the comparison."""

    name: str
    title: str
    description: str
    labels: tuple[str, str]
    verdict: str
    reason: str
    warnings: tuple[str, ...]
    time: Array
    period: float | None
    """Seconds a crank turn takes; turns = time / period. None where the tables do not say."""
    channels: dict[str, ChannelComparison]
    events: tuple[pd.DataFrame | None, pd.DataFrame | None]
    provenance: dict[str, dict[str, Any]] = field(default_factory=dict)
    """Of every run used: "reference", "reference finer", "reference twin", "exudyn", ..."""
    scene: dict[str, Any] | None = None
    """The scene mapping."""
    command: str = ""
    """Reproduces this comparison."""
    tier: str = "standard"
    attribution: Attribution | None = None
    """None where nothing could be compared."""
    tight: SceneComparison | None = None
    """The same scene at the tight tier, where it was run."""
    shift: Shift | None = None
    """Estimated time shift between the two; None where nothing was compared."""

    @property
    def tiers(self) -> tuple[SceneComparison, ...]:
        """The comparison itself and that at the tight tier, if there is one."""
        return (self,) if self.tight is None else (self, self.tight)

    @cached_property
    def impacts(self) -> Mapping[str, Impacts] | None:
        """Contacts of b against those of a, see `comparison.measures.impacts.impacts_of`.

        A contact is predictable where its corner's gap is, or x where the tables hold no gaps.
        """
        x = self.channels.get("slider_x")
        decisive = {place: self.channels.get(f"corner_{place}_gap", x) for place in CONTACTS}
        return impacts_of(
            *self.events,
            time=self.time,
            period=self.period,
            predictable={
                place: channel.predictable
                for place, channel in decisive.items()
                if channel is not None and channel.u is not None
            },
        )


def thresholds_record() -> dict[str, Any]:
    """Read ``thresholds.toml``."""
    return tomllib.loads(files("comparison").joinpath("thresholds.toml").read_text("utf-8"))


def thresholds(tier: str = "standard") -> Thresholds:
    """Return the numbers of a tier, ``"standard"`` or ``"tight"``."""
    record = thresholds_record()
    return Thresholds(k=record["k"], share=record["share"], **record[tier])


def compare_channel(
    channel: Channel,
    time: Array,
    a: Array,
    b: Array,
    *,
    scene: Mapping[str, Any] | None,
    u: tuple[Array | None, Array | None],
    within: BoolArray | None = None,
    tolerance: float | None,
    limits: Thresholds,
) -> ChannelComparison:
    """Judge one channel on a common grid; arrays of shape (n,).

    A sample at which both results are exactly zero is no evidence: a corner force is zero most of the time,
    and a force that is missing altogether would agree with 99 % of the samples. The share of explained
    samples is therefore taken over the predictable samples at which at least one of the two is not zero.

    Where too few samples are predictable, a position or a velocity still differs if even the largest
    uncertainty of all times explains too few samples. A channel in a wrong unit has an uncertainty in that
    unit, which may be too large for any sample to be predictable and nothing beside the difference.

    Parameters
    ----------
    channel
        What is compared.
    time, a, b
        Common time (s) and the two results.
    scene
        The scene mapping, for the scale; None: the range is the scale.
    u
        Numerical uncertainties of a and of b; one that is None makes both unused.
    within
        The samples that may be judged at all: where the position that this channel follows is predictable,
        and where its value follows from samples; None: all.
    tolerance
        Share of the scale that is allowed where there is no uncertainty; None: "indeterminate".
    limits
        The tier's numbers.
    """
    both_ranges = float(max(a.max(), b.max()) - min(a.min(), b.min()))
    scale = channel.scale_value(scene, both_ranges)
    difference = a - b
    u_a, u_b = u
    u_both = None if u_a is None or u_b is None else combined(u_a, u_b)
    threshold: Array | None
    if u_both is not None:
        threshold, predictable = limits.k * u_both, u_both <= limits.alpha * scale
    else:
        predictable = np.ones(time.shape, dtype=np.bool_)
        threshold = None if tolerance is None else np.broadcast_to(tolerance * scale, time.shape)
    if within is not None:
        predictable &= within
    judged = predictable & ((a != 0) | (b != 0))
    explained = worst_time = worst_difference = worst_threshold = float("nan")
    if threshold is not None and judged.any():
        size = np.abs(difference)
        explained = float(np.mean((size <= threshold)[judged]))
        excess = np.where(judged, size / np.maximum(threshold, np.finfo(np.float64).tiny), -1.0)
        worst = int(excess.argmax())
        worst_time, worst_difference = float(time[worst]), float(difference[worst])
        worst_threshold = float(threshold[worst])
    coverage = float(predictable.mean())
    gross: bool | np.bool_ = False
    # Not where a position must be known first: a force whose contact all runs of a model miss has u = 0.
    if u_both is not None and channel.follows is None and (coverage < limits.coverage or not judged.any()):
        largest = limits.k * float(u_both.max())
        happens = (a != 0) | (b != 0)
        gross = bool(happens.any()) and np.mean(np.abs(difference[happens]) <= largest) < limits.share
        if gross:
            worst = int(np.abs(difference).argmax())
            worst_time, worst_difference = float(time[worst]), float(difference[worst])
            worst_threshold = largest
    if both_ranges < channel.floor:
        verdict = "unexcited"
        reason = (
            f"its range in both, {both_ranges:.2g} {channel.unit}, is below {channel.floor:g} {channel.unit}"
        )
    elif gross:
        verdict = "differ"
        reason = (
            f"at t = {worst_time:.6g} s the difference is {worst_difference:.3g} {channel.unit}, "
            f"{limits.k:g} times the largest uncertainty of all times {worst_threshold:.2g} {channel.unit}"
        )
    elif threshold is None:
        verdict = "indeterminate"
        reason = "there is neither an uncertainty nor a tolerance to judge by"
    elif coverage < limits.coverage:
        verdict = "indeterminate"
        reason = f"{coverage:.1%} of the samples are predictable, {limits.coverage:.0%} are needed"
    elif not judged.any():
        verdict = "indeterminate"
        reason = "no sample at which something happens is predictable"
    elif explained < limits.share:
        verdict = "differ"
        reason = (
            f"at t = {worst_time:.6g} s the difference is {worst_difference:.3g} {channel.unit}, "
            f"the threshold {worst_threshold:.2g} {channel.unit}; "
            f"{explained:.1%} of the predictable samples are within theirs, {limits.share:.0%} are needed"
        )
    else:
        verdict = "agree"
        reason = f"{explained:.2%} of the predictable samples are within their threshold"
    max_difference, rms_difference = maximum(difference), rms(difference)
    return ChannelComparison(
        channel=channel.name,
        label=channel.label,
        unit=channel.unit,
        scale=scale,
        time=time,
        a=a,
        b=b,
        difference=difference,
        u_a=u_a,
        u_b=u_b,
        u=u_both,
        predictable=predictable,
        verdict=verdict,
        coverage=coverage,
        explained=explained,
        max_difference=max_difference,
        rms_difference=rms_difference,
        max_scaled=scaled(max_difference, scale),
        rms_scaled=scaled(rms_difference, scale),
        worst_time=worst_time,
        worst_difference=worst_difference,
        worst_threshold=worst_threshold,
        reason=reason,
        limits=limits,
    )


def scene_verdict(results: Mapping[str, ChannelComparison], floor: float) -> tuple[str, str]:
    """Verdict of a scene and its reason, by the rule of a channel applied to all excited ones together.

    One channel that differs makes the scene differ. Else its coverage, the share of predictable samples among
    those of all excited channels, is held against the same floor as a channel's. Channels that are by
    themselves indeterminate are named in the reason. A scene without an excited channel is indeterminate:
    nothing was compared.

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
        worst = max(differing, key=lambda result: abs(result.worst_difference) / result.worst_threshold)
        return (
            "differ",
            f"{len(differing)} of {len(excited)} channels differ, most of all {worst.channel}: "
            f"{worst.reason}",
        )
    unsettled = [result for result in excited if result.verdict == "indeterminate"]
    agreeing = [result for result in excited if result.verdict == "agree"]
    # A channel without a sample to judge covers nothing, however many are predictably zero.
    judged = [0.0 if np.isnan(result.explained) else result.coverage for result in excited]
    coverage = sum(judged) / len(excited)
    if not agreeing or coverage < floor:
        worst = min(unsettled, key=lambda result: result.coverage)
        return (
            "indeterminate",
            f"{len(unsettled)} of {len(excited)} channels are indeterminate, most of all {worst.channel}: "
            f"{worst.reason}",
        )
    worst = min(agreeing, key=lambda result: result.explained)
    reason = f"{len(agreeing)} of {len(excited)} excited channels agree, least of all {worst.channel}: "
    reason += f"{worst.reason}; {coverage:.1%} of all samples are predictable"
    if unsettled:
        names = ", ".join(f"{result.channel} ({result.reason})" for result in unsettled)
        reason += f"; by itself indeterminate: {names}"
    return "agree", reason
