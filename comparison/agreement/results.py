"""Results of a comparison: of one channel, and of a scene."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from math import inf, isnan, nan
from typing import Any

import numpy as np
import pandas as pd

from comparison.accuracy.thresholds import Thresholds
from comparison.execution.run import Job
from comparison.metrics.impacts import Impacts, impacts_of
from comparison.metrics.signal_ratings import information
from comparison.reliability.difference import ReliabilityComparison
from comparison.scene import Scene
from comparison.tables.arrays import Array, BoolArray
from comparison.tables.channels import CONTACTS, Channel
from comparison.tables.times import Shift

_TIMES = ("", "once", "twice", "three times", "four times")
SUSPICIOUS = 10.0
"""An underestimation of the uncertainty by more than this factor is reported as suspicious. By chance alone a
factor of 6 has been observed, for five runs whose errors spread over decades.
"""


@dataclass(frozen=True)
class ChannelComparison:
    """Comparison of one channel of two runs on their common time grid of ``n`` samples."""

    channel: str
    definition: Channel
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
    """Numerical uncertainties of a, b and their difference, shape (n,); None if unknown."""
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
    """These four are taken over all samples, predictable or not; the largest is that of the samples."""
    worst_time: float
    worst_difference: float
    worst_threshold: float
    """The predictable sample with the largest |E| / threshold; nan where there is none."""
    outside: int
    """Number of judged samples outside their threshold."""
    reason: str
    """Reason of the verdict, one sentence."""
    limits: Thresholds
    """Thresholds of the verdict."""
    coverage_error: float = nan
    rms_error: float = nan
    """Estimated errors of coverage and RMS by sampling, see `comparison.agreement.compare`; nan: unknown."""

    @property
    def threshold(self) -> Array | None:
        """Threshold of |E|, shape (n,): k u, or the tolerance; None without either."""
        if self.u is not None:
            return self.limits.k * self.u
        return None if isnan(self.worst_threshold) else np.full(self.time.shape, self.worst_threshold)

    @property
    def judged(self) -> BoolArray:
        """Where the verdict looks, shape (n,): at predictable samples at which not both results are zero."""
        happens: BoolArray = (self.a != 0) | (self.b != 0)
        return self.predictable & happens

    @property
    def beyond(self) -> BoolArray:
        """Judged samples outside their threshold, shape (n,)."""
        if self.threshold is None:
            return np.zeros(self.time.shape, dtype=np.bool_)
        return self.judged & (np.abs(self.difference) > self.threshold)

    @cached_property
    def ratio(self) -> float:
        """The |E| / threshold that the required share of the judged samples stays within.

        The one number of a channel in every report, under `ratio_name`: at most 1 exactly where the channel
        agrees, nan unless it agrees or differs. The share is 99 %, or 100 % of a tolerance. Where a channel
        differs without being predictable, all samples count, against the largest threshold of all times.
        """
        if self.verdict not in ("agree", "differ") or self.threshold is None:
            return nan
        blind = isnan(self.explained)
        counted = (self.a != 0) | (self.b != 0) if blind else self.judged
        size = np.abs(self.difference[counted])
        if not size.size:
            return nan
        limit = np.full(size.shape, self.worst_threshold) if blind else self.threshold[counted]
        ratios = np.sort(np.divide(size, limit, out=np.where(size > 0.0, inf, 0.0), where=limit > 0.0))
        enough = np.arange(1, size.size + 1) / size.size >= self.limits.share
        return float(ratios[enough.argmax()])

    @property
    def largest_ratio(self) -> float:
        """The largest |E| / threshold of the judged samples; nan without one."""
        if self.worst_difference == 0.0:
            return 0.0
        return abs(self.worst_difference) / self.worst_threshold if self.worst_threshold else inf

    @property
    def ratio_name(self) -> str:
        """Name of `ratio`: "|E|/2u (99%)", or "|E|/tolerance"."""
        share = "" if self.limits.share == 1.0 else f" ({100 * self.limits.share:g}%)"
        return f"|E|/{'tolerance' if self.u is None else f'{self.limits.k:g}u'}{share}"

    @cached_property
    def metrics(self) -> Mapping[str, float]:
        """Measures of b against a, for information only; empty for unexcited (constant) channels.

        See `comparison.metrics.signal_ratings`. Made when first asked for: they cost more than the verdict.
        """
        if self.verdict == "unexcited":
            return {}
        position = self.definition.rate is not None
        return information(self.time, self.a, self.b, position=position)


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
    sentences: tuple[str, ...] = ()
    """Summary sentences."""


@dataclass(frozen=True)
class Confirmation:
    """Result of ensembles of runs from moved starts for a verdict "differ"; unknown values are nan or empty.

    See `comparison.agreement.confirmation`.
    """

    outcome: str
    """"confirmed"; "unconfirmed": too few runs succeeded; "underestimated": the difference is numerical, the
    uncertainty was too small, and the comparison holds the corrected one.
    """
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
    contact: str = ""
    """First contact that occurs in some runs only and separates them."""
    sentence: str = ""
    """Summary sentences."""

    @property
    def mark(self) -> str:
        """The outcome in a few words, to stand beside a verdict."""
        fewest = min((count for count in self.members if count), default=0)
        return {
            "confirmed": f"confirmed by at least {fewest} runs",
            "unconfirmed": f"unconfirmed, {fewest} runs",
            "underestimated": f"uncertainty underestimated {self.factor:.2g} times",
        }[self.outcome]

    @property
    def suspicious(self) -> bool:
        """Whether a discontinuous event decides, possibly an intermittent fault of a model."""
        return self.outcome == "underestimated" and (self.clustered or self.factor > SUSPICIOUS)


@dataclass(frozen=True)
class SceneComparison:
    """Comparison of all channels of one scene, with the data to interpret and reproduce it."""

    name: str
    title: str
    description: str
    labels: tuple[str, str]
    verdict: str
    reason: str
    warnings: tuple[str, ...]
    time: Array
    period: float | None
    """Period of a crank cycle, s. None if it is neither recorded nor stated."""
    channels: dict[str, ChannelComparison]
    events: tuple[pd.DataFrame | None, pd.DataFrame | None]
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
    failed: Job | None = None
    """The run that did not succeed, where one is why nothing could be compared."""
    tier: str = "standard"
    refined: int = 0
    """How many levels finer than the scene's settings the models ran, see `comparison.agreement.refine`."""
    attribution: Attribution | None = None
    """None where nothing could be compared."""
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
        """The channel nearest to its limit, or farthest beyond it; see `decisive`."""
        return decisive(self.channels.values())

    @property
    def coverage(self) -> float:
        """Share of predictable samples (`scene_coverage`); nan where no table carries uncertainties."""
        known = any(channel.u is not None for channel in self.channels.values())
        return scene_coverage(self.channels) if known else nan

    @property
    def why(self) -> str:
        """The reason of the verdict, preceded by what its runs and its confirmation need explained."""
        before = [] if self.confirmation is None else [self.confirmation.sentence]
        before += [self.finer_runs] if self.refined else []
        return ". ".join([*before, self.reason])

    @property
    def finer_runs(self) -> str:
        """Settings of refined runs, in one sentence; empty where the models ran at the scene's own."""
        if not self.refined or self.scene is None:
            return ""
        step = self.scene["solver"]["exudyn"]["step"]
        return (
            f"judged with finer runs, since those at the scene's settings left the verdict open: step of "
            f"five bodies halved {_TIMES[self.refined]}, to {step:.3g} s"
        )

    @property
    def mark(self) -> str:
        """What stands beside the verdict, in a few words: that its runs are finer, and its confirmation."""
        marks = [f"step halved {_TIMES[self.refined]}"] if self.refined else []
        return "; ".join(marks if self.confirmation is None else [*marks, self.confirmation.mark])

    @property
    def tiers(self) -> tuple[SceneComparison, ...]:
        """The comparison itself and that at the tight tier, if there is one."""
        return (self,) if self.tight is None else (self, self.tight)

    @cached_property
    def impacts(self) -> Mapping[str, Impacts] | None:
        """Contacts of b against those of a, see `comparison.metrics.impacts.impacts_of`.

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
    judged = [0.0 if isnan(channel.explained) else channel.coverage for channel in excited]
    return sum(judged) / len(judged) if judged else nan


def no_comparison(
    scene: Scene, reason: str, *, labels: tuple[str, str], command: str, tier: str
) -> SceneComparison:
    """Return the comparison of a scene whose runs cannot be compared: without channels, and why."""
    return SceneComparison(
        name=scene.name,
        title=scene.title,
        description=scene.description,
        labels=labels,
        verdict="cannot compare",
        reason=reason,
        warnings=scene.warnings,
        time=np.empty(0),
        period=scene.period,
        channels={},
        events=(None, None),
        scene=scene.data,
        command=command,
        tier=tier,
    )
