"""Verdict of two results (agree, differ, indeterminate) for one channel.

After ASME V&V 20-2009 (section 1) a difference ``E`` is explained by the numerical uncertainty ``u`` where
``|E| <= k u``; applied sample by sample, where the uncertainty is small against the channel's scale.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from comparison.accuracy.levels import Thresholds
from comparison.metrics.signals import information, scaled
from comparison.tables.channels import Array, BoolArray, Channel
from comparison.verdict.results import Basis, ChannelComparison, Check


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
    absolute: bool = False,
    limits: Thresholds,
    share: float = 1.0,
    time_tolerance: float = 0.0,
    gate: Mapping[str, float] | None = None,
) -> ChannelComparison:
    """Judge one channel on a common grid; arrays of shape (n,), options as of `comparison.verdict.compare`.

    A sample at which both results are exactly zero is no evidence: a force that is missing altogether would
    agree with the 99 % of the samples at which a corner is free. Where too few samples are predictable, a
    channel still differs if too few are explained even with all unpredictable ones counted as explained: a
    model's error may be what makes its motion unpredictable. So does a position or a velocity if even the
    largest uncertainty of all times explains too few samples: in a wrong unit the uncertainty, too, may be
    too large for any sample to be predictable.

    An uncertainty in ``u`` that is None makes both unused; then the scale is the range of ``a`` alone, which
    an outlier in ``b`` must not widen. ``within`` are the samples that may be judged at all: where the
    position that this channel follows is predictable, and its value follows from samples.
    """
    known = u[0] is not None and u[1] is not None
    scale = channel.scale_value(scene, float(np.ptp(np.concatenate([a, b]) if known else a)))
    result = ChannelComparison(
        definition=channel,
        scale=scale,
        time=time,
        a=a,
        b=b,
        u_a=u[0],
        u_b=u[1],
        tolerance=None if known or tolerance is None else tolerance * (1.0 if absolute else scale),
        predictable=np.ones(time.shape, dtype=np.bool_) if within is None else within,
        limits=limits if known else replace(limits, share=share),
        verdict="indeterminate",
        basis=Basis.NO_LIMIT,
        time_tolerance=0.0 if known else time_tolerance,
    )
    if result.u is not None:
        result = replace(result, predictable=result.predictable & (result.u <= limits.alpha * scale))
    result = replace(result, **_by_samples(result))
    # Not where a position must be known first: a force whose contact all runs of a model miss has u = 0.
    if result.verdict == "indeterminate" and result.u is not None and channel.follows is None:
        result = replace(result, **_by_largest_uncertainty(result, limits.k * float(result.u.max())))
    if gate and not known and result.verdict != "unexcited":
        result = replace(result, **_by_gate(result, gate))
    return result


def _by_samples(channel: ChannelComparison) -> dict[str, Any]:
    """Compare the judged samples with their thresholds; return the judgement's fields."""
    judged, threshold, limits = channel.judged, channel.threshold, channel.limits
    count, outside = int(judged.sum()), int(channel.beyond.sum())
    fixed = channel.u is None
    judgement: dict[str, Any] = {"outside": outside}
    explained = (count - outside) / count if count else 0.0
    if threshold is not None and count:
        # A fixed threshold may be zero: of a channel that is constant in the first table.
        divisor = 1.0 if fixed else np.maximum(threshold, np.finfo(np.float64).tiny)
        worst = int(np.where(judged, channel.size / divisor, -1.0).argmax())
        judgement |= {"explained": explained, "worst": worst, "worst_threshold": float(threshold[worst])}
    few_outside = not fixed and outside < limits.least_outside
    verdict = "indeterminate"
    if channel.extent < channel.definition.floor:
        verdict, basis = "unexcited", Basis.RANGE
    elif threshold is None:
        basis = Basis.NO_LIMIT
    elif channel.coverage < limits.coverage and outside <= (1.0 - limits.share) * int(channel.nonzero.sum()):
        basis = Basis.COVERAGE
    elif not count:
        basis = Basis.NOTHING_JUDGED
    elif few_outside and count < limits.least_judged:
        basis = Basis.FEW_JUDGED
    elif few_outside and explained < limits.share:
        basis = Basis.FEW_OUTSIDE
    else:
        verdict, basis = "differ" if explained < limits.share else "agree", Basis.SAMPLES
    return judgement | {"verdict": verdict, "basis": basis}


def _by_largest_uncertainty(channel: ChannelComparison, largest: float) -> dict[str, Any]:
    """Let a channel differ if even the largest threshold of all times explains too few samples."""
    inside = channel.size[channel.nonzero] <= largest
    if not inside.size or np.mean(inside) >= channel.limits.share:
        return {}
    return {
        "verdict": "differ",
        "basis": Basis.LARGEST,
        "explained": np.nan,
        "outside": int((~inside).sum()),
        "worst": int(channel.size.argmax()),
        "worst_threshold": largest,
    }


def _by_gate(channel: ChannelComparison, gate: Mapping[str, float]) -> dict[str, Any]:
    """Hold the metrics of a channel against their limits; a difference that samples show remains."""
    values = information(channel.time, channel.a, channel.b, position=channel.definition.rate is not None)
    values["max_scaled"], values["rms_scaled"] = channel.max_scaled, channel.rms_scaled
    values["peak_scaled"] = scaled(values["peak_difference"], channel.scale)
    checks = tuple(Check(metric, values[metric], limit) for metric, limit in gate.items())
    decided: dict[str, Any] = {}
    if channel.verdict != "differ" and not all(check.met for check in checks):
        decided = {"verdict": "differ", "basis": Basis.GATE}
    elif channel.basis is Basis.NO_LIMIT:
        decided = {"verdict": "agree", "basis": Basis.GATE}
    return {"checks": checks} | decided
