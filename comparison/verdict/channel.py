"""Criteria of a comparison, and the verdict on one channel of two results.

After ASME V&V 20-2009 (section 1) a difference ``E`` is explained by the numerical uncertainty ``u`` where
``|E| <= k u``; applied sample by sample, where the uncertainty is small against the channel's scale. Without
uncertainties the threshold is a tolerance; metrics can have limits besides, or instead. The criteria are one
set of options of the command line, Python and the fixture of pytest.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import inf, nan
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
from pydantic import BeforeValidator, Field
from pydantic_core import PydanticCustomError

from comparison.accuracy.levels import Thresholds
from comparison.accuracy.uncertainty import REGAINED, combined, so_far
from comparison.metrics import Extrema, scaled_value
from comparison.scene.schema import Compare, NotNegative, Positive, Real
from comparison.tables.arguments import Options
from comparison.tables.channels import Array, BoolArray, Channel
from comparison.tables.table import Table, TableError
from comparison.verdict.results import METRICS, Basis, ChannelComparison, Check
from comparison.verdict.until import differs, enough, settled_count, until


def _names(value: object) -> object:
    if not isinstance(value, list | tuple) or not value:
        raise PydanticCustomError("rule", "", {"text": "must be a list of names"})
    return list(value)


class Criteria(Options, Compare):
    """Channels of two tables to compare, at which times, and by which limits.

    Tolerances, share, time tolerance and gate count only without an uncertainty.
    """

    tolerances: dict[str, Positive] = Field(default={})
    """Channel -> its own tolerance."""
    absolute: bool = False
    """Tolerances are in the channels' units, not shares of their scales."""
    share: Annotated[float, Field(gt=0, le=1, allow_inf_nan=False)] = 1.0
    """Share of the samples that must be within the tolerance, without those exactly zero in both tables."""
    time_tolerance: NotNegative = 0.0
    """Time, s, by which either may be early or late; neither may lack what the other has."""
    gate: dict[str, Real] = Field(default={})
    """Metric of `comparison.verdict.results.METRICS` -> its limit, for every channel."""
    channels: Annotated[list[Annotated[str, Field(min_length=1)]] | None, BeforeValidator(_names)] = None
    """Channels to compare; None: all."""
    at_events: Literal["left", "right", "both"] | None = None
    """Rows that count where a file repeats a time."""
    common_time: bool = False
    """Tables of different spans are compared where both have samples, instead of refused."""
    period: Positive | None = None
    """Period of the motion, s, a hundredth of which is the window of an uncertainty; None: that of the scene,
    else the median time between two turning points."""

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        check_gate(self.gate)

    def tolerance_of(self, channel: Channel) -> float | None:
        """Return the tolerance of a channel; None without one."""
        of_all = None if channel.unscaled and not self.absolute else self.tolerance
        return self.tolerances.get(channel.name, of_all)

    def over(self, *usual: Mapping[str, Any]) -> "Criteria":
        """Return these criteria completed by ``usual``, the last of which has precedence; gates join."""
        options = self.model_dump(exclude_unset=True)
        gate = {metric: limit for each in (*usual, options) for metric, limit in each.get("gate", {}).items()}
        return Criteria(
            **{name: value for each in (*usual, options) for name, value in each.items()} | {"gate": gate}
        )


def check_gate(gate: Mapping[str, float]) -> None:
    """Raise `TableError` for an unknown metric, and for a limit that all values meet, or none."""
    for metric, limit in gate.items():
        if metric not in METRICS:
            raise TableError(f"gate: {metric!r} is not a metric; there are {', '.join(METRICS)}")
        if METRICS[metric] > 0 and limit < 0:
            raise TableError(f"gate: {metric} = {limit:g} must be >= 0: it limits the size of an error")
        if METRICS[metric] < 0 and not -1 <= limit <= 1:
            raise TableError(f"gate: {metric} = {limit:g} must be -1 to 1: it is a rating")


# ---- the verdict

NO_CRITERIA = Criteria()
"""Criteria of runs with uncertainties."""


class Samples(NamedTuple):
    """A channel of two results at common times (s), with their uncertainties, if known; shape (n,)."""

    time: Array
    a: Array
    b: Array
    u_a: Array | None = None
    u_b: Array | None = None


def compare_channel(
    channel: Channel,
    samples: Samples,
    *,
    scene: Mapping[str, Any] | None,
    within: BoolArray | None = None,
    before: BoolArray | None = None,
    criteria: Criteria = NO_CRITERIA,
    limits: Thresholds,
    window: float = 0.0,
    learnt: int | None = None,
) -> ChannelComparison:
    """Judge one channel on a common grid.

    A sample at which both results are exactly zero is no evidence: a force that is missing altogether would
    agree with the 99 % of the samples at which nothing touches. Where too few samples are predictable, a
    channel still differs if too few are explained even with all unpredictable ones counted as explained: a
    model's error may be what makes its motion unpredictable. So does a position or a velocity if even the
    largest uncertainty of all times explains too few samples: in a wrong unit the uncertainty, too, may be
    too large for any sample to be predictable.

    If one uncertainty is None neither is used; then the scale is the range of ``a`` alone, which an outlier
    in ``b`` must not widen. ``within``, shape (n,), masks the samples that may be judged at all: where the
    position that this channel follows is predictable, and its value follows from samples. ``before``, shape
    (n,), masks those that were outside at the level before: where only the present level is outside, u is
    too small and becomes |a - b| / k.

    After `until` the uncertainties count `REGAINED` times: runs that part and that the same last contacts
    bring together again are nearer to one another than to the truth.

    ``window`` is that of the uncertainty, s. The end of a scene's run is stated. Without a scene the first
    ``learnt`` samples count at once, and scales are ranges up to each sample: a longer run changes no result.
    """
    time, a, b, u_a, u_b = samples
    has_u, tolerance = u_a is not None and u_b is not None, criteria.tolerance_of(channel)
    if before is not None and u_a is not None and u_b is not None:
        floor = np.abs(a - b) / limits.k
        small = ~before & (floor > combined(u_a, u_b))
        u_a, u_b = (np.where(small, np.maximum(u, floor), u) for u in (u_a, u_b))
    scale = channel.scale_value(scene, float(np.ptp(np.concatenate([a, b]) if has_u else a)))
    count = settled_count(time, window) if has_u and learnt is not None else time.size
    largest_u = so_far(combined(u_a, u_b), learnt) if u_a is not None and u_b is not None else None
    result = ChannelComparison(
        definition=channel,
        scale=scale,
        time=time,
        a=a,
        b=b,
        u_a=u_a,
        u_b=u_b,
        tolerance=None if has_u or tolerance is None else tolerance * (1.0 if criteria.absolute else scale),
        predictable=np.ones(time.shape, dtype=np.bool_) if within is None else within,
        limits=limits if has_u else replace(limits, share=criteria.share, least_outside=1),
        verdict="indeterminate",
        basis=Basis.NO_LIMIT,
        time_tolerance=0.0 if has_u else criteria.time_tolerance,
    )
    if result.u is not None:
        extent = so_far(np.maximum(a, b), learnt) + so_far(-np.minimum(a, b), learnt)
        scales = np.broadcast_to(channel.scale_value(scene, extent), time.shape)
        predictable = result.predictable & limits.predictable(result.u, scales) & (scales > 0.0)
        end, isolated = until(time, predictable[:count], window)
        factor = np.where(time > end, REGAINED, 1.0)
        predictable &= limits.predictable(factor * result.u, scales)
        u_a, u_b = (None if u is None else factor * u for u in (u_a, u_b))
        result = replace(result, u_a=u_a, u_b=u_b, predictable=predictable, until=end, isolated=isolated)
    result = replace(result, **_by_samples(result, count, demanded=learnt is None))
    # Not where a position must be known first: a force whose contact all runs of a model miss has u = 0.
    if largest_u is None or channel.follows is not None or result.verdict == "unexcited":
        return result
    if learnt is None:
        undecided = np.arange(1, time.size + 1) == time.size * (result.verdict == "indeterminate")
    else:
        undecided = (np.arange(time.size) < count) & ~enough(result.predictable, result.nonzero, limits)
    return replace(result, **_by_largest_uncertainty(result, limits.k * largest_u, undecided))


def _by_samples(channel: ChannelComparison, stop: int, *, demanded: bool) -> dict[str, Any]:
    """Compare the judged samples with their thresholds; return the fields of a `ChannelComparison`.

    Only the samples before ``stop`` show a difference. If ``demanded`` a channel is indeterminate where too
    few samples are predictable.
    """
    if channel.extent < channel.definition.floor:
        return {"verdict": "unexcited", "basis": Basis.RANGE}
    mask, threshold, limits = channel.judged, channel.threshold, channel.limits
    count, outside = int(mask.sum()), int(channel.beyond.sum())
    fixed = channel.u is None
    judgement: dict[str, Any] = {"outside": outside}
    explained = (count - outside) / count if count else 0.0
    if threshold is not None and count:
        # A fixed threshold may be zero: of a channel that is constant in the first table.
        divisor = 1.0 if fixed else np.maximum(threshold, np.finfo(np.float64).tiny)
        worst = int(np.where(mask, channel.size / divisor, -1.0).argmax())
        judgement |= {"explained": explained, "worst": worst, "worst_threshold": float(threshold[worst])}
    where = differs(channel.predictable, channel.nonzero, channel.beyond, limits)
    where = where[-1:] if fixed else where[:stop]  # the share that a user states is of the whole table
    verdict = "indeterminate"
    if threshold is None:
        basis = Basis.ERROR if channel.definition.unscaled else Basis.NO_LIMIT
    elif where.any():
        verdict, basis = "differ", Basis.SAMPLES
        judgement["differs_from"] = nan if fixed else float(channel.time[where.argmax()])
    elif channel.coverage < limits.coverage and (demanded or fixed or explained < limits.share):
        basis = Basis.COVERAGE
    elif not count:
        basis = Basis.NOTHING_JUDGED
    elif not fixed and count < limits.least_judged:
        basis = Basis.FEW_JUDGED
    elif explained < limits.share:
        basis = Basis.FEW_OUTSIDE
    else:
        verdict, basis = "agree", Basis.SAMPLES
    return judgement | {"verdict": verdict, "basis": basis}


def _by_largest_uncertainty(channel: ChannelComparison, bounds: Array, mask: BoolArray) -> dict[str, Any]:
    """Let a channel differ where even the largest thresholds explain too few of the samples up to there.

    ``mask``, shape (n,), has the samples up to which its own thresholds decide nothing.
    """
    limits, beyond = replace(channel.limits, least_outside=1), channel.nonzero & (channel.size > bounds)
    differing = mask & differs(np.zeros_like(beyond), channel.nonzero, beyond, limits)
    first = int(differing.argmax())
    if not differing.any() or channel.time[first] >= channel.differs_from:
        return {}
    return {
        "verdict": "differ",
        "basis": Basis.LARGEST,
        "explained": np.nan,
        "outside": int(beyond.sum()),
        "worst": int(channel.size[: first + 1].argmax()),
        "worst_threshold": float(bounds[first]),
        "differs_from": float(channel.time[first]),
    }


def extrema_of(channel: ChannelComparison, tables: Sequence[Table]) -> Extrema:
    """Return the extrema of a channel between its samples, of both tables or of none.

    A force between two samples may be twice that of the samples. Extrema outside the compared span do not
    count, nor those that do not enclose the samples: a mapping has turned or scaled the column.
    """
    if channel.definition.angle or not all(channel.channel in table.extrema for table in tables):
        return ((), ())
    first, last = float(channel.time[0]), float(channel.time[-1])
    rows: list[list[tuple[float, float]]] = []
    for table, samples in zip(tables, (channel.a, channel.b), strict=True):
        extrema = table.extrema[channel.channel]
        if not extrema.get("min", inf) <= samples.min() <= samples.max() <= extrema.get("max", -inf):
            return ((), ())
        ends = [(extrema.get(f"time_of_{end}", nan), extrema[end]) for end in ("min", "max")]
        rows.append([(at, value) for at, value in ends if first <= at <= last])
    return rows[0], rows[1]


def apply_gate(channel: ChannelComparison, gate: Mapping[str, float]) -> ChannelComparison:
    """Check a channel's metrics against their limits; a difference by samples remains."""
    if channel.u is not None or channel.verdict == "unexcited" or channel.definition.unscaled:
        return channel
    values = dict(channel.metrics)
    values["max_scaled"], values["rms_scaled"] = channel.max_scaled, channel.rms_scaled
    values["peak_scaled"] = scaled_value(values["peak_difference"], channel.scale)
    checks = tuple(Check(metric, values[metric], limit) for metric, limit in gate.items())
    judgement: dict[str, Any] = {}
    if channel.verdict != "differ" and not all(check.met for check in checks):
        judgement = {"verdict": "differ", "basis": Basis.GATE}
    elif channel.basis is Basis.NO_LIMIT:
        judgement = {"verdict": "agree", "basis": Basis.GATE}
    return replace(channel, checks=checks, **judgement)
