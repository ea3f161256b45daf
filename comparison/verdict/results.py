"""Results of a comparison as data: of one channel, of a scene at one tier, and why it is so.

No sentences: `comparison.words.verdicts` makes them of these numbers.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum, auto
from functools import cached_property
from math import inf, isnan, nan
from typing import Any, TypeVar

import numpy as np
import pandas as pd

from comparison.accuracy.levels import Thresholds
from comparison.accuracy.uncertainty import combined
from comparison.execution.run import Job
from comparison.metrics.contacts import Impacts, Pulse, impacts_of, pin_share, time_shares
from comparison.metrics.outliers import Parting
from comparison.metrics.signals import information, maximum, rms, scaled, tube_distance
from comparison.reliability.difference import ReliabilityComparison
from comparison.scene import Scene
from comparison.tables.arrays import Array, BoolArray
from comparison.tables.channels import CONTACTS, Channel
from comparison.tables.times import Shift

T = TypeVar("T")

SUSPICIOUS = 10.0
"""An underestimation of the uncertainty by more than this factor is reported as suspicious. By chance alone a
factor of 6 has been observed, for five runs whose errors spread over decades.
"""
EXIT_CODES = {"agree": 0, "differ": 1, "cannot compare": 2, "indeterminate": 3}
_WORST_FIRST = (70, 2, 1, 3, 0)
_RANK = {"unexcited": 0, "agree": 1, "indeterminate": 2, "differ": 3, "cannot compare": 4}


class Basis(Enum):
    """What the verdict of a channel rests on."""

    RANGE = auto()
    """Unexcited: its range in both is below the channel's floor."""
    NO_LIMIT = auto()
    """Indeterminate: there is neither an uncertainty nor a tolerance."""
    COVERAGE = auto()
    """Indeterminate: too few samples are predictable."""
    NOTHING_JUDGED = auto()
    """Indeterminate: no predictable sample is non-zero."""
    FEW_JUDGED = auto()
    """Indeterminate: too few predictable samples are non-zero."""
    FEW_OUTSIDE = auto()
    """Indeterminate: too many samples are outside to agree, too few to differ."""
    SAMPLES = auto()
    """Agree or differ, by the share of the judged samples within their threshold."""
    GATE = auto()
    """Agree or differ, by limits of metrics."""
    LARGEST = auto()
    """Differ, although too little is predictable: even the largest u of all times explains too little."""


METRICS = {
    **dict.fromkeys(("max_scaled", "rms_scaled", "peak_scaled"), 1),
    **dict.fromkeys((f"sprague_geers_{part}" for part in ("magnitude", "phase", "combined")), 1),
    **dict.fromkeys((f"russell_{part}" for part in ("magnitude", "phase", "comprehensive")), 1),
    "peak_time_difference": 1,
    "iso18571": -1,
    **dict.fromkeys((f"iso18571_{part}" for part in ("corridor", "phase", "magnitude", "slope")), -1),
    **dict.fromkeys(("tube_share", "correlation"), -1),
}
"""Metrics that a gate can limit: 1 where the size of an error is limited, -1 where a rating must reach it.

Scaled ones are shares of the channel's scale; `comparison.metrics.signals.information` has the others.
"""


@dataclass(frozen=True)
class Check:
    """A metric of a channel against the limit of a gate."""

    metric: str
    value: float
    limit: float

    @property
    def met(self) -> bool:
        """Whether an error is at most, a rating at least its limit; not where the metric is undefined."""
        return abs(self.value) <= self.limit if METRICS[self.metric] > 0 else self.value >= self.limit


@dataclass(frozen=True)
class ChannelComparison:
    """Comparison of one channel of two runs at ``n`` common times; arrays have shape (n,)."""

    definition: Channel
    scale: float
    time: Array
    """s."""
    a: Array
    b: Array
    u_a: Array | None
    u_b: Array | None
    """Numerical uncertainties of a and b; None if unknown."""
    tolerance: float | None
    """Allowed |a - b| in the channel's unit, where there is no uncertainty."""
    predictable: BoolArray
    """u <= alpha * scale; all True where u is None."""
    limits: Thresholds
    verdict: str
    """"agree", "differ", "indeterminate" or "unexcited"."""
    basis: Basis
    explained: float = nan
    """Share of the judged samples within their threshold; nan if there is none of either."""
    outside: int = 0
    """Number of samples outside their threshold, of those that decide."""
    worst: int | None = None
    """Index of the sample with the largest |a - b| / threshold, of those that decide."""
    worst_threshold: float = nan
    """Threshold there."""
    time_tolerance: float = 0.0
    """s, by which either may be early or late; zero where there is an uncertainty."""
    checks: tuple[Check, ...] = ()
    """Of the metrics that a gate limits."""
    coverage_error: float = nan
    rms_error: float = nan
    """Estimated errors of coverage and RMS by sampling, see `comparison.verdict.compare`; nan: unknown."""

    @property
    def channel(self) -> str:
        """Name of the channel."""
        return self.definition.name

    @property
    def label(self) -> str:
        """Words for the channel."""
        return self.definition.label

    @property
    def unit(self) -> str:
        """Unit of the channel; empty where it is unknown."""
        return self.definition.unit

    @cached_property
    def difference(self) -> Array:
        """A - b, shape (n,)."""
        return self.a - self.b

    @cached_property
    def size(self) -> Array:
        """What is held against the threshold, shape (n,): |a - b|, or within the time tolerance less."""
        if self.time_tolerance:
            return tube_distance(self.time, self.a, self.b, self.time_tolerance)
        return np.abs(self.difference)

    @cached_property
    def u(self) -> Array | None:
        """Numerical uncertainty of the difference, shape (n,); None if unknown."""
        return None if self.u_a is None or self.u_b is None else combined(self.u_a, self.u_b)

    @cached_property
    def threshold(self) -> Array | None:
        """Threshold of |a - b|, shape (n,): k u, or the tolerance; None without either."""
        if self.u is not None:
            return self.limits.k * self.u
        return None if self.tolerance is None else np.full(self.time.shape, self.tolerance)

    @property
    def extent(self) -> float:
        """Range of both results together."""
        return float(max(self.a.max(), self.b.max()) - min(self.a.min(), self.b.min()))

    @property
    def nonzero(self) -> BoolArray:
        """Samples at which not both results are zero, shape (n,): a zero force in both is no evidence."""
        happens: BoolArray = (self.a != 0) | (self.b != 0)
        return happens

    @property
    def judged(self) -> BoolArray:
        """Samples on which the verdict rests, shape (n,): predictable and non-zero."""
        return self.predictable & self.nonzero

    @property
    def beyond(self) -> BoolArray:
        """Judged samples outside their threshold, shape (n,)."""
        if self.threshold is None:
            return np.zeros(self.time.shape, dtype=np.bool_)
        return self.judged & (self.size > self.threshold)

    @property
    def coverage(self) -> float:
        """Share of predictable samples."""
        return float(self.predictable.mean())

    @property
    def worst_time(self) -> float:
        """Time of the worst sample, s; nan without one."""
        return nan if self.worst is None else float(self.time[self.worst])

    @property
    def worst_difference(self) -> float:
        """Difference at the worst sample; nan without one."""
        return nan if self.worst is None else float(self.difference[self.worst])

    @property
    def worst_size(self) -> float:
        """What was held against the threshold at the worst sample; nan without one."""
        return nan if self.worst is None else float(self.size[self.worst])

    @cached_property
    def max_difference(self) -> float:
        """Largest |a - b| of all samples, predictable or not."""
        return maximum(self.difference)

    @cached_property
    def rms_difference(self) -> float:
        """Root mean square of a - b over time, of all samples."""
        return rms(self.time, self.difference)

    @property
    def max_scaled(self) -> float:
        """`max_difference` over the scale."""
        return scaled(self.max_difference, self.scale)

    @property
    def largest_predictable(self) -> float:
        """Largest |a - b| of the predictable samples; nan without one."""
        part = self.difference[self.predictable]
        return float(np.max(np.abs(part))) if part.size else nan

    @property
    def rms_scaled(self) -> float:
        """`rms_difference` over the scale."""
        return scaled(self.rms_difference, self.scale)

    @cached_property
    def ratio(self) -> float:
        """The |a - b| / threshold that the required share of the judged samples stays within.

        The one number of a channel in every report, under `ratio_name`: at most 1 exactly where the channel
        agrees, nan unless it agrees or differs by its samples. The share is 99 %, or 100 % of a tolerance.
        Where the largest u of all times decides, all non-zero samples count.
        """
        if self.verdict not in ("agree", "differ") or self.threshold is None or self.basis is Basis.GATE:
            return nan
        largest = self.basis is Basis.LARGEST
        counted = self.nonzero if largest else self.judged
        size = self.size[counted]
        if not size.size:
            return nan
        limit = np.full(size.shape, self.worst_threshold) if largest else self.threshold[counted]
        ratios = np.sort(np.divide(size, limit, out=np.where(size > 0.0, inf, 0.0), where=limit > 0.0))
        enough = np.arange(1, size.size + 1) / size.size >= self.limits.share
        return float(ratios[enough.argmax()])

    @property
    def largest_ratio(self) -> float:
        """The largest |a - b| / threshold of the samples that decide; nan without one."""
        if self.worst_size == 0.0:
            return 0.0
        return self.worst_size / self.worst_threshold if self.worst_threshold else inf

    @property
    def ratio_name(self) -> str:
        """Name of `ratio`: "|E|/2u (99%)", or "|E|/tolerance"."""
        share = "" if self.limits.share == 1.0 else f" ({100 * self.limits.share:g}%)"
        return f"|E|/{'tolerance' if self.u is None else f'{self.limits.k:g}u'}{share}"

    @cached_property
    def metrics(self) -> Mapping[str, float]:
        """Measures of b against a, for information only; empty for unexcited (constant) channels.

        See `comparison.metrics.signals.information`. They cost more than the verdict.
        """
        if self.verdict == "unexcited":
            return {}
        return information(self.time, self.a, self.b, position=self.definition.rate is not None)


@dataclass(frozen=True)
class Refinement:
    """What a level finer changes in one model.

    Attributes
    ----------
    label
        The model.
    settings
        The settings that it changes, as they are now; first the one whose ratio is ``factor``.
    factor, order
        Ratio of that setting between two levels, and order at which the error should follow it.
    observed
        Order that the three levels show, nan if unknown: `comparison.accuracy.uncertainty.observed_order`.
    """

    label: str
    settings: Mapping[str, float]
    factor: float
    order: float
    observed: float = nan

    @property
    def gain(self) -> float:
        """Expected ratio of the errors of two levels."""
        return float(self.factor**self.order)


@dataclass(frozen=True)
class Attribution:
    """Attribution of the difference of a scene at one tier; unknown values are nan or empty."""

    explained: float = nan
    """Share of the judged samples of all excited channels together that are within k u."""
    cause: str = ""
    """"a" or "b" (whose refinement removes it), "both", "round-off", "neither" or "models"."""
    remaining: dict[str, float] = field(default_factory=dict)
    """Remaining share of the difference with the run of "a", "b" or "both" refined."""
    channels: dict[str, dict[str, float]] = field(default_factory=dict)
    """The same by channel."""
    still_moves: dict[str, float] = field(default_factory=dict)
    """"a", "b": share of the samples outside the band near which refinement moves the run by as much."""
    unpredictable: dict[str, float] = field(default_factory=dict)
    """Why the samples of the indeterminate channels are not predictable: share by the u of "a" alone, of "b"
    alone, of "each" by itself, of the two only "together"; and that of "neighbours" whose spread suffices."""
    unpredictable_from: float = nan
    """First of the most frequent of these, s."""
    outside_from: float = nan
    """First judged sample outside the band or the tolerance, s; of the channels that differ, if any does."""
    outside_in: str = ""
    """Its channel."""
    refinements: tuple[Refinement, ...] = ()
    """Of both models, where both can be refined."""
    strict_helps: bool = False
    """Whether the model that limits the coverage runs coarser than at "strict"."""


class Doubt(Enum):
    """Why a difference could not be confirmed."""

    TOLERANCE = auto()
    """The verdict uses a tolerance, to which ensembles do not apply."""
    RIGID = auto()
    """No joint has clearance, so no start can be moved."""
    SLOW = auto()
    """Both models are too slow for an ensemble."""
    NO_STARTS = auto()
    """No runs from moved starts beyond those of the uncertainty are there."""
    FEW_RUNS = auto()
    """Too few runs from moved starts succeeded."""


@dataclass(frozen=True)
class Confirmation:
    """Result of ensembles of runs from moved starts for a verdict "differ"; unknown values are nan or empty.

    See `comparison.verdict.confirmation`.
    """

    outcome: str
    """"confirmed"; "unconfirmed", see `doubt`; "underestimated": the difference is numerical, the uncertainty
    was too small, and the comparison holds the corrected one.
    """
    doubt: Doubt | None = None
    members: tuple[int, int] = (0, 0)
    """Runs in the ensemble of each model."""
    shifts: tuple[float, float] = (nan, nan)
    """Standard deviation of the starts of either ensemble, m."""
    farther: tuple[int, int] = (0, 0)
    """How many of these lie as far from the centre of the others as the other model's run, or farther."""
    excess: float = nan
    """Distance of a model's run from the other's ensemble, over that of the farthest run left out of it: the
    smaller of both."""
    factor: float = nan
    """Factor by which the uncertainty was underestimated."""
    since: float = nan
    """First sample at which the difference exceeded k u, s."""
    clustered: bool = False
    """Whether an ensemble splits into clusters farther apart than they are wide, and than the uncertainty."""
    parting: Parting | None = None
    """First contact that occurs in some runs only and separates them."""
    parted: tuple[str, str] = ("", "")
    """Labels of the models whose runs it separates; twice the same within one ensemble."""

    @property
    def fewest(self) -> int:
        """Runs of the smaller ensemble; 0 without any."""
        return min((count for count in self.members if count), default=0)

    @property
    def suspicious(self) -> bool:
        """Whether a discontinuous event decides, possibly an intermittent fault of a model."""
        return self.outcome == "underestimated" and (self.clustered or self.factor > SUSPICIOUS)


@dataclass(frozen=True)
class SceneComparison:
    """Comparison of all channels of one scene at one tier, with the data to interpret and reproduce it."""

    name: str
    title: str
    description: str
    labels: tuple[str, str]
    verdict: str
    """"agree", "differ", "indeterminate" or "cannot compare"."""
    time: Array
    period: float | None
    """Period of a crank cycle, s. None if it is neither recorded nor stated."""
    channels: dict[str, ChannelComparison]
    events: tuple[pd.DataFrame | None, pd.DataFrame | None] = (None, None)
    warnings: tuple[str, ...] = ()
    pulses: tuple[Sequence[Pulse], Sequence[Pulse]] = ((), ())
    """Contacts of either base run whose forces are resolved in time, for drawings."""
    provenance: dict[str, dict[str, Any]] = field(default_factory=dict)
    """Of every run used: "reference", "reference finer", "reference perturbed", "exudyn", ..."""
    scene: dict[str, Any] | None = None
    """The scene mapping."""
    command: str = ""
    """Command that reproduces this comparison."""
    closer_command: str = ""
    """The same where it may be decided: at finer settings; of tables, by a tolerance. Empty without one."""
    ran: Scene | None = None
    """The scene at the settings of this tier, whose command repeats a run; None for tables."""
    error: str = ""
    """Why nothing could be compared: one line."""
    failed: Job | None = None
    """The run that did not succeed, where one is why nothing could be compared."""
    tier: str = "standard"
    refined: int = 0
    """How many levels finer than the scene's settings the models ran, see `comparison.verdict.refinement`."""
    unsettled: bool = False
    """Whether "indeterminate" because refinement still moves the models by as much as they differ."""
    allowed_shift: float = nan
    """Time shift that the tolerance allows, s, where the verdict is "differ" because it is exceeded."""
    attribution: Attribution = field(default_factory=Attribution)
    tight: SceneComparison | None = None
    """The same scene at the tight tier, where it was run."""
    shift: Shift | None = None
    """Estimated time shift between the two; None where nothing was compared."""
    reliability: ReliabilityComparison | None = None
    """Of the slider's motion; independent of all verdicts. None: not requested."""
    confirmation: Confirmation | None = None
    """Of a verdict that was "differ" before it; None where the models agreed, or for foreign tables."""
    coverage_error: float = nan
    """Estimated error of the coverage by sampling; nan where unknown."""

    @property
    def decisive(self) -> ChannelComparison | None:
        """The channel nearest to its limit; of a scene that differs the one farthest beyond. See `decisive`.

        None where no sample decides: the scene differs by a time shift, or by limits of metrics alone.
        """
        if self.verdict == "differ":
            return decisive(self._with_verdict("differ"))
        return decisive(self.channels.values())

    @property
    def worst_channel(self) -> ChannelComparison | None:
        """The channel that decides: where indeterminate that with the least coverage, else `decisive`.

        Where a scene differs by limits of metrics alone the first that does.
        """
        same = self._with_verdict(self.verdict)
        if self.verdict == "indeterminate" and same:
            return min(same, key=lambda channel: channel.coverage)
        return self.decisive or next(iter(same), None)

    def _with_verdict(self, verdict: str) -> list[ChannelComparison]:
        return [channel for channel in self.channels.values() if channel.verdict == verdict]

    @property
    def coverage(self) -> float:
        """Share of predictable samples (`scene_coverage`); nan where no table carries uncertainties."""
        known = any(channel.u is not None for channel in self.channels.values())
        return scene_coverage(self.channels) if known else nan

    @property
    def tiers(self) -> tuple[SceneComparison, ...]:
        """The comparison itself and that at the tight tier, if there is one."""
        return (self,) if self.tight is None else (self, self.tight)

    @property
    def situations(self) -> tuple[Mapping[str, float] | None, Mapping[str, float] | None]:
        """Time shares of the paper's four contact situations in both results.

        None without events, without corners, or where a contact is a side's.
        """
        corners = self.scene is None or (
            self.scene["joints"]["slider"] == "clearance" and self.scene["contact"]["law"] != "foundation"
        )
        return self._shares(time_shares) if corners else (None, None)

    @property
    def pin_contact(self) -> tuple[float | None, float | None]:
        """Time share of contact at the crank pin in both results; None without events or clearance."""
        clearance = self.scene is not None and self.scene["joints"]["crank_pin"] == "clearance"
        return self._shares(pin_share) if clearance else (None, None)

    def _shares(self, share: Callable[[pd.DataFrame, tuple[float, float]], T]) -> tuple[T | None, T | None]:
        if not self.time.size:
            return None, None
        span = float(self.time[0]), float(self.time[-1])
        first, second = (None if events is None else share(events, span) for events in self.events)
        return first, second

    @property
    def worst_verdict(self) -> str:
        """The worse of the verdicts at its tiers."""
        return max((tier.verdict for tier in self.tiers), key=rank)

    @cached_property
    def impacts(self) -> Mapping[str, Impacts] | None:
        """Contacts of b against those of a, see `comparison.metrics.contacts.impacts_of`.

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


def decisive(channels: Iterable[ChannelComparison]) -> ChannelComparison | None:
    """Return the channel with the largest ratio, of equal ones that with the largest maximum.

    The one whose difference is nearest to its limit or farthest beyond. None if none agrees or differs.
    """
    judged = [channel for channel in channels if not isnan(channel.ratio)]
    return max(judged, key=lambda channel: (channel.ratio, channel.largest_ratio), default=None)


def scene_coverage(channels: Mapping[str, ChannelComparison]) -> float:
    """Return a scene's share of predictable samples: the mean over its excited channels; nan without one.

    The one number for a scene, which its verdict holds against the floor. A channel without a sample to judge
    covers nothing, however many samples are predictably zero: a corner that touches only where nothing can be
    predicted.
    """
    excited = [channel for channel in channels.values() if channel.verdict != "unexcited"]
    judged = [
        0.0 if isnan(channel.explained) and channel.basis is not Basis.GATE else channel.coverage
        for channel in excited
    ]
    return sum(judged) / len(judged) if judged else nan


def no_comparison(
    scene: Scene, error: str, *, labels: tuple[str, str], command: str, tier: str, failed: Job | None = None
) -> SceneComparison:
    """Return the comparison of a scene whose runs cannot be compared: without channels, and why."""
    return SceneComparison(
        name=scene.name,
        title=scene.title,
        description=scene.description,
        labels=labels,
        verdict="cannot compare",
        time=np.empty(0),
        period=scene.period,
        channels={},
        warnings=scene.warnings,
        scene=scene.data,
        command=command,
        ran=scene,
        error=error,
        failed=failed,
        tier=tier,
    )


def rank(verdict: str) -> int:
    """Return the severity of a verdict; an unknown one is the worst."""
    return _RANK.get(verdict, len(_RANK))


def exit_code(codes: Sequence[int], *, allow_indeterminate: bool = False) -> int:
    """Return the worst of several exit codes: 70, 2, 1, 3, 0 in this order."""
    code = next(code for code in _WORST_FIRST if code in codes)
    return 0 if code == 3 and allow_indeterminate else code
