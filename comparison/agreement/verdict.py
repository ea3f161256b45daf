"""Verdict of two results (agree, differ, indeterminate) for one channel.

The rule is that of verification and validation after ASME V&V 20-2009 (section 1): a difference ``E`` between
two results is explained by their numerical uncertainty ``u`` where ``|E| <= k u``; outside there is a
difference of models. It is applied sample by sample, on the samples where the uncertainty is small against
the scale of the channel (the predictable ones).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from math import nan
from typing import Any, NamedTuple

import numpy as np

from comparison.accuracy.thresholds import Thresholds
from comparison.accuracy.uncertainty import combined
from comparison.agreement.results import ChannelComparison
from comparison.formatting import instant
from comparison.metrics.signals import maximum, rms, scaled
from comparison.tables.arrays import Array, BoolArray
from comparison.tables.channels import Channel


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
    share: float = 1.0,
) -> ChannelComparison:
    """Judge one channel on a common grid; arrays of shape (n,).

    A sample at which both results are exactly zero is no evidence: a corner force is zero most of the time,
    and a force that is missing altogether would agree with 99 % of the samples. The share of explained
    samples is therefore taken over the predictable samples at which at least one of the two is not zero.

    Where too few samples are predictable, a channel still differs if too few are explained even with all
    unpredictable ones counted as explained: a model's error may be what makes its motion unpredictable. So
    does a position or a velocity if even the largest uncertainty of all times explains too few samples. A
    channel in a wrong unit has an uncertainty in that unit, which may be too large for any sample to be
    predictable and yet negligible against the difference.

    Parameters
    ----------
    channel
        The compared channel.
    time, a, b
        Common time (s) and the two results.
    scene
        The scene mapping, for the scale; None: the range is the scale, of both where there are uncertainties,
        of ``a`` where a tolerance decides: an outlier in ``b`` must not widen what is allowed.
    u
        Numerical uncertainties of a and of b; one that is None makes both unused.
    within
        The samples that may be judged at all: where the position that this channel follows is predictable,
        and where its value follows from samples; None: all.
    tolerance
        Share of the scale that is allowed where there is no uncertainty; None: "indeterminate".
    limits
        The tier's numbers.
    share
        Of the samples that must be within a tolerance.
    """
    extent = float(max(a.max(), b.max()) - min(a.min(), b.min()))
    difference = a - b
    u_both = None if u[0] is None or u[1] is None else combined(u[0], u[1])
    scale = channel.scale_value(scene, float(np.ptp(a)) if u_both is None else extent)
    threshold: Array | None
    if u_both is not None:
        threshold, predictable = limits.k * u_both, u_both <= limits.alpha * scale
    else:
        predictable = np.ones(time.shape, dtype=np.bool_)
        threshold = None if tolerance is None else np.broadcast_to(tolerance * scale, time.shape)
        limits = replace(limits, share=share)
    if within is not None:
        predictable &= within
    happens = (a != 0) | (b != 0)
    found = _judge(
        channel, time, difference, threshold, predictable, happens, extent, limits, fixed=u_both is None
    )
    # Not where a position must be known first: a force whose contact all runs of a model miss has u = 0.
    if u_both is not None and channel.follows is None and found.verdict == "indeterminate":
        found = (
            _outside_all(channel, time, difference, limits.k * float(u_both.max()), happens, limits) or found
        )
    max_difference, rms_difference = maximum(difference), rms(time, difference)
    return ChannelComparison(
        channel=channel.name,
        definition=channel,
        label=channel.label,
        unit=channel.unit,
        scale=scale,
        time=time,
        a=a,
        b=b,
        difference=difference,
        u_a=u[0],
        u_b=u[1],
        u=u_both,
        predictable=predictable,
        verdict=found.verdict,
        coverage=float(predictable.mean()),
        explained=found.explained,
        max_difference=max_difference,
        rms_difference=rms_difference,
        max_scaled=scaled(max_difference, scale),
        rms_scaled=scaled(rms_difference, scale),
        worst_time=found.time,
        worst_difference=found.difference,
        worst_threshold=found.threshold,
        outside=found.outside,
        reason=found.reason,
        limits=limits,
    )


class _Judgement(NamedTuple):
    """A verdict, its reason, the share of explained samples, and the worst of the judged ones."""

    verdict: str
    reason: str
    explained: float = nan
    time: float = nan
    difference: float = nan
    threshold: float = nan
    outside: int = 0
    """Judged samples outside their threshold."""


def _judge(
    channel: Channel,
    time: Array,
    difference: Array,
    threshold: Array | None,
    predictable: BoolArray,
    happens: BoolArray,
    extent: float,
    limits: Thresholds,
    *,
    fixed: bool,
) -> _Judgement:
    """Compare the predictable, non-zero samples with their thresholds; fixed: the same for all."""
    of = partial(_number, channel.unit)
    judged, coverage = predictable & happens, float(predictable.mean())
    numbers, where = (nan, nan, nan, nan, 0), ""
    count = int(judged.sum())
    if threshold is not None and count:
        size = np.abs(difference)
        # A fixed threshold may be zero: of a channel that is constant in the first table.
        divisor = 1.0 if fixed else np.maximum(threshold, np.finfo(np.float64).tiny)
        excess = np.where(judged, size / divisor, -1.0)
        worst = int(excess.argmax())
        inside = (size <= threshold)[judged]
        explained, outside = float(np.mean(inside)), count - int(inside.sum())
        numbers = explained, float(time[worst]), float(difference[worst]), float(threshold[worst]), outside
        where = instant(time[worst], *time[max(0, worst - 1) : worst + 2])
    explained, _, worst_difference, worst_threshold, outside = numbers
    if extent < channel.floor:
        reason = f"its range in both, {of(extent, 2)}, is below {of(channel.floor)}"
        return _Judgement("unexcited", reason, *numbers)
    if threshold is None:
        reason = "there is neither an uncertainty nor a tolerance"
    elif coverage < limits.coverage and outside <= (1.0 - limits.share) * happens.sum():
        reason = f"{coverage:.1%} of the samples are predictable, required: at least {limits.coverage:.0%}"
    elif not judged.any():
        reason = "no predictable sample is non-zero"
    elif not fixed and outside < limits.least_outside and count < limits.least_judged:
        reason = f"{count} predictable samples are non-zero, required: at least {limits.least_judged}"
    elif not fixed and outside < limits.least_outside and explained < limits.share:
        reason = (
            f"{outside} of {count} predictable samples are outside their threshold: too many to agree, fewer "
            f"than the {limits.least_outside} that show a difference"
        )
    else:
        text = (
            f"{outside} of {count} {'samples' if fixed else 'predictable samples'} are outside "
            f"{'the tolerance' if fixed else 'their threshold'}"
            f"{', at worst' if outside else ', the nearest'} at t = {where} s: the difference is "
            f"{of(worst_difference)}, the threshold {of(worst_threshold, 2)}"
        )
        if fixed and worst_threshold == 0.0:
            text += "; the channel is constant in the first table, so its scale is zero unless one is given"
        if explained < limits.share:
            if limits.share < 1.0:
                text += f"; {explained:.1%} are within, required: at least {100 * limits.share:g}%"
            if coverage < limits.coverage:
                text += f"; that is decided although only {coverage:.1%} of the samples are predictable"
            return _Judgement("differ", text, *numbers)
        return _Judgement("agree", text, *numbers)
    return _Judgement("indeterminate", reason, *numbers)


def _outside_all(
    channel: Channel,
    time: Array,
    difference: Array,
    largest: float,
    happens: BoolArray,
    limits: Thresholds,
) -> _Judgement | None:
    """Return that a channel differs if even the largest threshold of all times explains too few samples."""
    if not happens.any():
        return None
    if np.mean(np.abs(difference[happens]) <= largest) >= limits.share:
        return None
    worst, of = int(np.abs(difference).argmax()), partial(_number, channel.unit)
    where = instant(time[worst], *time[max(0, worst - 1) : worst + 2])
    reason = (
        f"at t = {where} s the difference is {of(difference[worst])}, "
        f"{limits.k:g} times the largest uncertainty of all times {of(largest, 2)}"
    )
    return _Judgement(
        "differ",
        reason,
        time=float(time[worst]),
        difference=float(difference[worst]),
        threshold=largest,
        outside=int((np.abs(difference[happens]) > largest).sum()),
    )


def _number(unit: str, value: float, digits: int = 3) -> str:
    """Return value and unit; of a channel of another mechanism the unit may be unknown."""
    return f"{value:.{digits}g} {unit}".rstrip()
